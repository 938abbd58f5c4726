"""The vehicle of the parameters: one car that rolls, of which the half-car is the first two coordinates.

A rigid body stands on two axles, each a spring, a damper in series with its elastic mount, an unsprung mass and a tyre.
Its coordinates are the heights of the body over the front axle and over the rear one, and with roll the height of its
left side over the wheels' mean. The wheels of an axle are alike, so it moves in two ways: both wheels together, and one
against the other, where the anti-roll bar is a further spring. A load off the centre line couples them. The payload is
a point mass on a slightly elastic floor; its own inertia turns with the body. docs/method.md writes the equations out.

This file gives the numbers in these equations from the table's vector and a load; response solves them.
Shapes: k points (a vehicle with a load each), 5 levels of movement.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Final

import numpy as np

from gateway.core.vehicle import Vehicle
from gateway.model.table import BEND_SHARES, INDEX, LOG, NAMES, ROLL, UPRIGHT, N
from gateway.records import F64, I64
from gateway.units import STANDARD_GRAVITY_MPS2

LEAST_SLACK: Final = 0.01
"""Chosen: least share of each sensor's power that comes by no modelled path, such as roll and loose parts."""
LEAST_SLACK_ON_CENTRE_LINE: Final = 0.002
"""The same with roll removed: the coherence of known loads is higher than LEAST_SLACK allows
(benchmarks/accuracy/trials.md).
"""
INVERSE_PAYLOAD_KG: Final = 30.0  # chosen: 1/L becomes L / (L^2 + this^2), as an empty vehicle has no payload position
IMAGINARY_STEP: Final = 1e-30  # its square vanishes beside any number here

LEVEL_STEPS: Final = (0.8, 0.4)
"""Chosen: distances between the levels at which a vehicle is solved, in logarithms of amplitude over the usual one: of
u, the mean of front and rear axle, and of d, half their difference.

Of a rate 1 - p + p exp(-x) quadratic interpolation along u misses at most p |u (u^2 - 0.8^2)| exp(0.8) / 6, which is
0.07 p between the outer levels; p is 0.1 or so. What u and d do together to both axles is left out.
"""
MOST: Final = 1.2  # chosen: limit of the mean u
MOST_APART: Final = 0.8  # chosen: limit of d
LEAST_LEFT: Final = 0.05  # chosen: least part of a rate, for any friction share
_U, _D = LEVEL_STEPS
LEVELS: Final = np.array([(-_U, -_U), (0.0, 0.0), (_U, _U), (_D, -_D), (-_D, _D)])
"""(5, 2) logarithm of the movement of front and rear axle over the usual one."""
USUAL_LEVEL: Final = 1

# The rows of the numbers in the equations of motion. Each slice of two is front and rear axle.
SPRING, DAMPER, MOUNT, TYRE, UNSPRUNG = (slice(i, i + 2) for i in range(0, 10, 2))
MODE, DAMPING, POSITION, LAG = 10, 11, 12, 13
DRIVELINE, GAIN, RIGID, CARRIED = slice(14, 16), 16, slice(17, 20), slice(20, 23)
N_UPRIGHT: Final = 23
RIGID_ROLL, CARRIED_ROLL, UNEVEN, FACTOR, BAR = (
    slice(23, 26),
    slice(26, 29),
    slice(29, 31),
    slice(31, 33),
    slice(33, 35),
)
LEFT, YAW = 35, 36
N_ROLLING: Final = 37

_IS_LOG: Final = np.array([row.scale == LOG for row in (*UPRIGHT, *ROLL)])
_NOT_IN_MOTION: Final = ("slack_", "noise_", "track", "twist_", "delay_scale", "rear_lag_s")
IN_MOTION: Final = frozenset(i for i, name in enumerate(NAMES) if not name.startswith(_NOT_IN_MOTION))
"""The parameters in the equations of motion; the load is in them too."""


@dataclass(frozen=True)
class Ground:
    """The vehicle as known without calibration, and least_slack, the least share of unmodelled power."""

    empty_mass_kg: float
    empty_front_share: float
    wheelbase_m: float
    track_width_m: float | None = None
    least_slack: float = LEAST_SLACK

    @classmethod
    def of(cls, vehicle: Vehicle, *, with_roll: bool = False) -> "Ground":
        """A vehicle as its fitter states it; ``with_roll`` if its sensors are read as on the centre line."""
        least_slack = LEAST_SLACK_ON_CENTRE_LINE if with_roll else LEAST_SLACK
        known = vehicle.empty_mass_kg, vehicle.empty_front_share, vehicle.wheelbase_m, vehicle.track_width_m
        return cls(*known, least_slack)

    @property
    def half_track_m(self) -> float:
        """Half the track's width. Raises ValueError if nobody stated it."""
        if self.track_width_m is None:
            raise ValueError("a vehicle that rolls needs the width of its track")
        return 0.5 * self.track_width_m

    @cached_property
    def bend_loads_kn(self) -> tuple[float, ...]:
        """Rising added axle loads at which a spring's rate may bend."""
        return tuple(0.5 * self.empty_mass_kg * STANDARD_GRAVITY_MPS2 / 1000.0 * share for share in BEND_SHARES)


def has_roll(theta: F64) -> bool:
    """True if the vector theta (..., n) has roll parameters."""
    return bool(theta.shape[-1] > N)


def natural(theta: F64) -> F64:
    """All parameters theta (..., n) in the units that end their names."""
    return np.exp(theta, out=theta.copy(), where=_IS_LOG[: theta.shape[-1]])


def numbers_of(x: F64, load: F64, ground: Ground) -> F64:
    """The numbers (23, k, 5) in the equations of motion at each of LEVELS, with roll (37, k, 5).

    x (k, n) are parameters in their own units; (1, n) are those of all. load (2, k) is payload (kg) and front share
    (0..1), with roll (3, k) also the centre of gravity of the sprung mass left of the centre line (m).
    """
    x = x.T[..., None]
    load = load[..., None]
    rolls = len(x) > N
    k = max(x.shape[1], load.shape[1])
    numbers = np.empty((N_ROLLING if rolls else N_UPRIGHT, k, len(LEVELS)), x.dtype)
    added_kg = _added_kg(load, ground)
    added_kn = added_kg * (STANDARD_GRAVITY_MPS2 / 1000.0)
    springs_npm, numbers[DAMPER] = _at_levels(x)
    np.multiply(springs_npm, _stiffening(x, added_kn, ground), out=numbers[SPRING])
    numbers[_PLAIN] = x[_PLAIN_ENTRIES]
    numbers[GAIN] = _exp(x[_GAIN])
    numbers[RIGID], numbers[CARRIED] = _masses_kg(x, load[0], added_kg, ground)
    if rolls:
        numbers[_PLAIN_ROLL] = x[_PLAIN_ROLL_ENTRIES]
        own_kgm = ground.empty_mass_kg * x[_EMPTY_LEFT]
        moment_kgm = (ground.empty_mass_kg + load[0]) * load[2] - own_kgm
        masses = _roll_masses_kg(x, load[0], added_kg[0], own_kgm, moment_kgm, ground)
        numbers[RIGID_ROLL], numbers[CARRIED_ROLL] = masses
        share = _roll_share_front(numbers)
        moved_kn = (own_kgm + moment_kgm) * (STANDARD_GRAVITY_MPS2 / 1000.0 / ground.half_track_m)
        off_kn = np.array([moved_kn * share, moved_kn * (1.0 - share)])
        left, right = (_stiffening(x, added_kn + off, ground) for off in (off_kn, -off_kn))
        np.multiply(springs_npm, left - right, out=numbers[UNEVEN])
    return numbers


def numbers_about(x: F64, load: F64, ground: Ground, entries: Sequence[int]) -> tuple[F64, F64]:
    """The r directions (5, q, r) in which the numbers of one vehicle x (n,) with load (2 or 3,) move with ``entries``,
    and how far (r, e) along each an entry moves them.

    Entries are those of IN_MOTION and from n on those of the load. A small step along the imaginary axis moves the
    imaginary part by the step times the slope and leaves the real part unchanged (W. Squire, G. Trapp, SIAM Rev. 40,
    1998). The vector holds logarithms of positive parameters: these move by a share of themselves.
    """
    n, rolls = len(x), len(x) > N
    stepping, row = _stepping(tuple(entries), rolls)
    stepped = np.empty((n + len(load), len(stepping)), complex)
    stepped[:n], stepped[n:] = x[:, None], load[:, None]
    scale = np.concatenate([np.where(_IS_LOG[:n], x, 1.0), np.ones(len(load))])
    stepped[stepping, np.arange(len(stepping))] += 1j * IMAGINARY_STEP * scale[stepping]
    slopes = numbers_of(stepped[:n].T, stepped[n:], ground).imag.transpose(2, 0, 1) * (1.0 / IMAGINARY_STEP)
    times = np.ones(n + len(load))
    times[_GYRATION] = load[0] * x[_GYRATION] / x[_PITCH_INERTIA]
    if not rolls:
        added_kn = _added_kg(load, ground) * (STANDARD_GRAVITY_MPS2 / 1000.0)
        times[_SLOPES] = added_kn
        times[_BENDS] = np.maximum(added_kn - np.array(ground.bend_loads_kn)[:, None], 0.0)
    far = np.zeros((len(stepping), len(entries)))
    far[row, np.arange(len(entries))] = times[np.array(entries, int)]
    if not rolls:
        return slopes, far
    acting = slopes.any(axis=(0, 1))  # beyond the load no bend acts
    return np.ascontiguousarray(slopes[..., acting]), far[acting]


@cache
def _stepping(entries: tuple[int, ...], rolls: bool) -> tuple[I64, I64]:
    """The entries that are stepped, and the place among them of the one that moves the numbers as each entry does.

    The payload turns with the body. Without roll a spring's many parameters change its rate alone.
    """
    alike = {_GYRATION: _PITCH_INERTIA}
    if not rolls:
        alike |= {entry: _RATES[axle] for pair in (_SLOPES, *_BENDS) for axle, entry in enumerate(pair)}
    stepping = sorted({alike.get(entry, entry) for entry in entries})
    row = [stepping.index(alike.get(entry, entry)) for entry in entries]
    return np.array(stepping, np.int64), np.array(row, np.int64)


def level_weights(log_movement: F64) -> F64:
    """(b, 5) weights of LEVELS for movements (b, 2) of front and rear axle, by quadratic interpolation."""
    front, rear = log_movement[:, :1], log_movement[:, 1:]
    u = np.clip(0.5 * (front + rear), -MOST, MOST) / LEVEL_STEPS[0]
    d = np.clip(0.5 * (front - rear), -MOST_APART, MOST_APART) / LEVEL_STEPS[1]
    parts = [0.5 * u * (u - 1.0), 1.0 - u**2 - d**2, 0.5 * u * (u + 1.0), 0.5 * d * (d + 1.0), 0.5 * d * (d - 1.0)]
    return np.concatenate(parts, axis=1)


def roll_share_front(theta: F64, load: F64, ground: Ground) -> float:
    """The front axle's part of a steady roll moment, 0..1, from springs, bars and tyres at their usual movement."""
    numbers = numbers_of(natural(theta)[None], np.asarray(load, float)[:, None], ground)
    return float(_roll_share_front(numbers)[0, 1])


def _roll_share_front(numbers: F64) -> F64:
    springs = numbers[SPRING] + numbers[BAR]
    front, rear = springs * numbers[TYRE] / (springs + numbers[TYRE])
    return np.asarray(front / (front + rear))


def _both(kind: str) -> list[int]:
    front, _, rest = kind.partition("*")
    return [INDEX[f"{front}{end}{rest}"] for end in ("front", "rear")]


_PLAIN = slice(MOUNT.start, DRIVELINE.stop)  # the rows that are parameters as they are
_PLAIN_ENTRIES = [
    *_both("damper_mount_*_npm"),
    *_both("tyre_*_npm"),
    *_both("unsprung_*_kg"),
    *(INDEX[name] for name in ("payload_mode_hz", "payload_damping_ratio", "sensor_position_m", "gyro_lag_s")),
    *_both("driveline_*_kg"),
]
_PLAIN_ROLL = slice(FACTOR.start, YAW + 1)
_PLAIN_ROLL_ENTRIES = [
    *_both("damper_against_*"),
    *_both("anti_roll_*_npm"),
    INDEX["sensor_left_m"],
    INDEX["gyro_yaw_rad"],
]
_RATES, _FRICTIONS = (
    _both("spring_*_npm") + _both("damper_*_nspm"),
    _both("spring_friction_*") + _both("damper_friction_*"),
)
_SLOPES, _DIGRESSIONS = _both("spring_slope_*_per_kn"), _both("damper_digression_*")
_BENDS = [_both(f"spring_bend_*_{i}_per_kn") for i in range(len(BEND_SHARES))]
_PITCH_INERTIA, _GYRATION, _ROLL_INERTIA, _ROLL_GYRATION, _GAIN, _EMPTY_LEFT = (
    INDEX[name]
    for name in (
        "pitch_inertia_kgm2",
        "payload_gyration_m2",
        "roll_inertia_kgm2",
        "payload_roll_gyration_m2",
        "accelerometer_gain",
        "empty_left_m",
    )
)
_MORE: Final = LEVELS.T[:, None]  # (2, 1, 5) logarithm of each axle's movement
_LESS: Final = np.expm1(-np.concatenate([_MORE, _MORE]))  # (4, 1, 5) 1/s - 1, of both springs and both dampers


def _exp(z: F64) -> F64:
    """exp, to first order in the imaginary part of complex numbers: numpy's own is slow."""
    if z.dtype == float:
        return np.exp(z)
    real = np.exp(z.real)
    return np.asarray(real + 1j * (real * z.imag))


def _at_levels(x: F64) -> tuple[F64, F64]:
    """Rates (2, k, 5) of the springs without load, and of the dampers: friction makes an axle stiffer where it moves
    less.

    A friction force F acts on a movement of standard deviation s as a damper sqrt(2/pi) F/s does (statistical
    linearisation; J. B. Roberts, P. D. Spanos, Random Vibration and Statistical Linearization, 1990). Where it sticks,
    the bushes act as the spring, and rubber itself is softer in large movements (A. R. Payne, J. Appl. Polym. Sci. 6,
    1962). A share p of each rate is of this kind at the usual amplitude; at s times that amplitude the rate is 1 - p +
    p/s times as large. A digressive damper's force grows as its speed to the power 1 - q: its rate is s^-q times as
    large.
    """
    rates = x[_RATES] * np.maximum(1.0 + x[_FRICTIONS] * _LESS, LEAST_LEFT)
    return rates[:2], rates[2:] * _exp(x[_DIGRESSIONS] * -_MORE)


def _stiffening(x: F64, added_kn: F64, ground: Ground) -> F64:
    """(2, k, 1 or 5) factor of the springs' rates under this added load on the axle.

    The logarithm of a rate has a slope at no load, which changes at each of the bends. Helper springs and bump stops
    cause sharp bends, progressive coils gentle ones.
    """
    log_rate = x[_SLOPES] * added_kn
    most_kn = float(added_kn.real.max(initial=0.0))
    for bend, load_kn in zip(_BENDS, ground.bend_loads_kn, strict=True):
        if load_kn >= most_kn:
            break
        log_rate = log_rate + x[bend] * np.maximum(added_kn - load_kn, 0.0)
    return _exp(log_rate)


def _added_kg(load: F64, ground: Ground) -> F64:
    """(2, k, 1) payload on front and rear axle."""
    front_kg = load[1] * (ground.empty_mass_kg + load[0]) - ground.empty_front_share * ground.empty_mass_kg
    return np.array([front_kg, load[0] - front_kg])


def _inverse_kg(payload_kg: F64) -> F64:
    return np.asarray(payload_kg / (payload_kg**2 + INVERSE_PAYLOAD_KG**2))


def _masses_kg(x: F64, payload_kg: F64, added_kg: F64, ground: Ground) -> tuple[F64, F64]:
    """(3, k, 1) of the rigid body and of the payload, which moves on its floor: front-front, rear-rear and front-rear.

    A point mass L at d adds L (1 - d/l)^2, L (d/l)^2 and L (1 - d/l)(d/l). With its masses F and R on the axles the
    last is q = L/4 - (R - F)^2 / (4 L) and the others F - q and R - q. The payload's own inertia turns with the body: a
    load rests on its edges, so that it rocks on its floor at a higher frequency than it bounces.
    """
    front_kg, rear_kg = added_kg
    q = 0.25 * (payload_kg - (rear_kg - front_kg) ** 2 * _inverse_kg(payload_kg))
    turning = (x[_PITCH_INERTIA] + payload_kg * x[_GYRATION]) / ground.wheelbase_m**2
    front, rear = ground.empty_front_share, 1.0 - ground.empty_front_share
    own = ground.empty_mass_kg * np.array([front**2, rear**2, front * rear])
    return own[:, None, None] + _TURNS * turning, np.array([front_kg - q, rear_kg - q, q])


_TURNS: Final = np.array([1.0, 1.0, -1.0])[:, None, None]


def _roll_masses_kg(
    x: F64, payload_kg: F64, front_kg: F64, own_kgm: F64, moment_kgm: F64, ground: Ground
) -> tuple[F64, F64]:
    """(3, k, 1) of the same two: front and rear with roll, and roll; the coordinate of roll is half a track away.

    A point mass L at (d, y) adds L y (1 - d/l), L y d/l and L y^2. An empty vehicle has no payload to divide by: its
    moment, if any, is distributed like its own mass.
    """
    share, small, half_m = ground.empty_front_share, INVERSE_PAYLOAD_KG**2, ground.half_track_m
    to_front = (front_kg * payload_kg + share * small) / (payload_kg**2 + small)
    turning = x[_ROLL_INERTIA] + payload_kg * x[_ROLL_GYRATION]
    own, moment = own_kgm / half_m, moment_kgm / half_m
    rigid = np.array(np.broadcast_arrays(own * share, own * (1.0 - share), turning / half_m**2))
    return rigid, np.array([moment * to_front, moment * (1.0 - to_front), moment**2 * _inverse_kg(payload_kg)])
