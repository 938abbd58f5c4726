"""The quality of a phone's recording: its still stretch, its losses, and whether the road reached it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.signal import welch

from gateway.core.batch import RATE_MIN_SHARE
from gateway.core.settings import BatchSettings
from gateway.core.timeline import onto_grid, sample_rate_hz
from gateway.offline.phone.tables import Fixes, PhoneRecording, Vectors
from gateway.records import F64, I64, iso_utc
from gateway.units import NS_PER_S

HANDLED_RADPS: Final = 1.5  # chosen: about a level axis; a hand turns it so fast, a vehicle does not
TILTED_DEG: Final = 10.0  # chosen: of the mean direction of gravity over a minute; bends to one side cause less
TURNED_SHARE: Final = 0.5  # chosen: of that angle; the gyroscope must show it within SEEN_S, as bends do not turn it
SEEN_S: Final = 15.0  # chosen: on either side
BLOCK_S: Final = 5  # chosen: of a mean direction
BLOCKS_ASIDE: Final = 12  # chosen: on each side of a possible move
MARGIN_NS: Final = 10 * NS_PER_S  # chosen: around a movement by hand
LEAST_RATE_HZ: Final = RATE_MIN_SHARE * BatchSettings().rate_hz
PAUSED_NS: Final = NS_PER_S // 2  # chosen: gap of the inertial sensors that is reported
LOST_NS: Final = 5 * NS_PER_S  # chosen: gap of the speed that is reported
MOST_NAMED: Final = 3  # chosen: gaps listed in a remark
RIDE_HZ: Final = (0.5, 8.0)  # chosen: movement of the body on its springs
SHAKEN_HZ: Final = 20.0  # chosen: upper end of the compared power
LEAST_RIDE_MPS2: Final = (
    0.1  # chosen: of the vertical acceleration; a van on a smooth road (ISO 8608, A) at 50 km/h has 0.3
)
LEAST_RIDE_SHARE: Final = 0.25  # chosen: of the power up to SHAKEN_HZ


@dataclass(frozen=True, slots=True)
class Remark:
    """A remark on a recording for its user; ``code`` is for programs."""

    code: str
    text: str


def still_stretch(accel: Vectors, gyro: Vectors) -> tuple[tuple[int, int], tuple[int, ...]]:
    """The longest stretch [ns] in which the phone was not moved, and the times of movements before, within and
    after.
    """
    begin_ns, end_ns = int(max(accel.t_ns[0], gyro.t_ns[0])), int(min(accel.t_ns[-1], gyro.t_ns[-1]))
    moved = sorted((*_tilts(accel, gyro, begin_ns), *_hands(accel, gyro)))
    pauses = [begin_ns - MARGIN_NS, *moved, end_ns + MARGIN_NS]
    stretches = [(a + MARGIN_NS, b - MARGIN_NS) for a, b in pairwise(pauses)]
    return max(stretches, key=lambda each: each[1] - each[0]), tuple(_apart(moved))


def _hands(accel: Vectors, gyro: Vectors) -> Iterator[int]:
    """Times at which the phone turned about a level axis faster than a vehicle can. A turn about the vertical may be a
    bend.
    """
    level = _about_level_axes(accel, gyro)
    yield from gyro.t_ns[np.linalg.norm(level, axis=1) > HANDLED_RADPS].tolist()


def _about_level_axes(accel: Vectors, gyro: Vectors) -> F64:
    """Turn rates (n, 3) without their part about the vertical."""
    up = np.median(accel.xyz, axis=0)
    up /= np.linalg.norm(up)
    level: F64 = gyro.xyz - np.outer(gyro.xyz @ up, up)
    return level


def _turned(accel: Vectors, gyro: Vectors, near_ns: int) -> tuple[float, int]:
    """Degrees turned about level axes near a time, by the gyroscope without its bias, and the time of the fastest
    turn.
    """
    level = _about_level_axes(accel, gyro)
    near = np.abs(gyro.t_ns - near_ns) < SEEN_S * NS_PER_S
    t_ns, level = gyro.t_ns[near], (level - np.median(level, axis=0))[near]
    if len(t_ns) < 2:
        return 0.0, near_ns
    angles = np.cumsum(level[1:] * np.diff(t_ns)[:, None] / NS_PER_S, axis=0)
    second = max(1, round(len(t_ns) / (2.0 * SEEN_S)))
    speed = np.linalg.norm(
        np.apply_along_axis(np.convolve, 0, level, np.full(second, 1.0 / second), mode="same"), axis=1
    )
    return float(np.degrees(np.linalg.norm(np.ptp(angles, axis=0)))), int(t_ns[int(np.argmax(speed))])


def _tilts(accel: Vectors, gyro: Vectors, begin_ns: int) -> Iterator[int]:
    """Times at which the direction of gravity in the phone changed for good: where medians of a minute differ the
    most.
    """
    block = (accel.t_ns - begin_ns) // (BLOCK_S * NS_PER_S)
    edges = np.searchsorted(block, np.arange(block[-1] + 2))
    pieces = [accel.xyz[a:b] for a, b in pairwise(edges)]
    means = np.array([piece.mean(axis=0) if len(piece) else np.full(3, np.nan) for piece in pieces])
    angle = np.zeros(len(means))
    for i in range(BLOCKS_ASIDE // 2, len(means) - BLOCKS_ASIDE // 2):
        before, after = means[max(0, i - BLOCKS_ASIDE) : i], means[i : i + BLOCKS_ASIDE]
        angle[i] = _angle_deg(_median(before), _median(after))
    for i in np.flatnonzero(angle > TILTED_DEG).tolist():
        if angle[i] == angle[max(0, i - BLOCKS_ASIDE) : i + BLOCKS_ASIDE + 1].max():
            at_ns = begin_ns + i * BLOCK_S * NS_PER_S
            turned_deg, fastest_ns = _turned(accel, gyro, at_ns)
            if turned_deg > TURNED_SHARE * angle[i]:
                yield fastest_ns


def _median(means: F64) -> F64:
    known = means[np.isfinite(means).all(axis=1)]
    return np.median(known, axis=0) if len(known) else np.full(3, np.nan)


def _angle_deg(a: F64, b: F64) -> float:
    lengths = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.degrees(np.arccos(np.clip(a @ b / lengths, -1.0, 1.0)))) if lengths > 0.0 else 0.0


def _apart(times_ns: Sequence[int]) -> Iterator[int]:
    """The first of each group within a minute."""
    last = None
    for t_ns in times_ns:
        if last is None or t_ns - last > 60 * NS_PER_S:
            yield t_ns
        last = t_ns


def remarks_on(recording: PhoneRecording, vertical_mps2: F64, stretch: tuple[int, int]) -> Iterator[Remark]:
    """Obstacles to a good estimate from the recording of one stretch [ns], and their remedies.

    vertical_mps2 (n,) is at the times of accel.
    """
    accel, gyro = recording.accel, recording.gyro
    for what, vectors in (("accelerometer", accel), ("gyroscope", gyro)):
        rate_hz = sample_rate_hz(vectors.t_ns)
        if rate_hz < LEAST_RATE_HZ:
            yield Remark(
                "sample_rate",
                f"the {what} was read {rate_hz:.0f} times a second; {LEAST_RATE_HZ:.0f} are needed: set its rate to "
                "100 Hz or the fastest in the app",
            )
    yield from _pauses(accel.t_ns)
    yield from _lost(recording.fixes, stretch)
    yield from _too_little_ride(accel, vertical_mps2, recording.fixes)
    if recording.n_unusable:
        yield Remark("rows", f"{recording.n_unusable} rows of the export are no numbers or came twice; left out")


def _pauses(t_ns: I64) -> Iterator[Remark]:
    waits = np.diff(t_ns)
    if n := int(np.count_nonzero(waits > PAUSED_NS)):
        at = iso_utc(int(t_ns[int(np.argmax(waits))]))[11:19]
        yield Remark(
            "paused",
            f"the phone stopped recording {n} times, longest for {waits.max() / NS_PER_S:.1f} s at {at} UTC: switch "
            "battery saving off for the app and leave its screen on",
        )


def _lost(fixes: Fixes, stretch: tuple[int, int]) -> Iterator[Remark]:
    """Gaps of the speed."""
    known = fixes.t_ns[np.isfinite(fixes.speed_mps)]
    if not len(known):
        yield Remark(
            "no_speed", "there is no satellite speed: allow the app the precise location, and lie in sight of sky"
        )
        return
    edges = np.r_[stretch[0], known, stretch[1]]
    waits = np.diff(edges)
    lost = [i for i in np.argsort(-waits)[: len(waits)] if waits[i] > LOST_NS]
    if lost:
        longest = ", ".join(
            f"for {waits[i] / NS_PER_S:.0f} s from {iso_utc(int(edges[i]))[11:19]} UTC" for i in lost[:MOST_NAMED]
        )
        more = f" and {len(lost) - MOST_NAMED} times more" if len(lost) > MOST_NAMED else ""
        yield Remark("gps_lost", f"GPS was lost {longest}{more}: these seconds weigh nothing")


def _too_little_ride(accel: Vectors, vertical_mps2: F64, fixes: Fixes) -> Iterator[Remark]:
    """Whether the movement on the springs reaches the phone: below 8 Hz, while the vehicle moves."""
    level_mps2, share = ride_of(accel, vertical_mps2, fixes)
    if level_mps2 < LEAST_RIDE_MPS2 or share < LEAST_RIDE_SHARE:
        yield Remark(
            "little_ride",
            f"too little vibration below {RIDE_HZ[1]:.0f} Hz reaches the phone ({level_mps2:.2f} m/s2, "
            f"{100 * share:.0f} % of what it feels up to {SHAKEN_HZ:.0f} Hz): put it on the floor, neither on a seat "
            "nor in a holder",
        )


def ride_of(accel: Vectors, vertical_mps2: F64, fixes: Fixes) -> tuple[float, float]:
    """Root mean square [m/s2] of the vertical acceleration in RIDE_HZ, and its share of the power up to SHAKEN_HZ.

    Both NaN if the vehicle moved for less than a minute.
    """
    rate_hz = 50.0
    n = int((accel.t_ns[-1] - accel.t_ns[0]) * rate_hz / NS_PER_S)
    grid = onto_grid(accel.t_ns, vertical_mps2, int(accel.t_ns[0]), n, rate_hz, 0.05)
    known = np.isfinite(fixes.speed_mps)
    speed = np.interp(accel.t_ns[0] + np.arange(n) * NS_PER_S / rate_hz, fixes.t_ns[known], fixes.speed_mps[known])
    moving = grid[np.isfinite(grid) & (speed > BatchSettings().speed_min_mps)]
    if len(moving) < 60 * rate_hz:
        return float("nan"), float("nan")
    freq_hz, density = welch(moving, rate_hz, nperseg=int(8 * rate_hz))
    ride = density[(freq_hz >= RIDE_HZ[0]) & (freq_hz <= RIDE_HZ[1])].sum()
    whole = density[(freq_hz >= RIDE_HZ[0]) & (freq_hz <= SHAKEN_HZ)].sum()
    return float(np.sqrt(ride * freq_hz[1])), float(ride / whole)
