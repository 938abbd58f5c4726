"""A phone's recording as a candump log in the vehicle's axes."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.bus.feed import AXES
from gateway.bus.frames import merge_frames
from gateway.bus.logs import write_candump
from gateway.bus.signals import SHIPPED_PREFIX, Encoder, load_signal_map, shipped_map
from gateway.core.timeline import sample_rate_hz
from gateway.errors import ConfigurationError, SpringscaleError
from gateway.files.whole import refusal_told, write_whole
from gateway.offline.phone.axes import Axes, axes_of
from gateway.offline.phone.quality import Remark, remarks_on, ride_of, still_stretch
from gateway.offline.phone.recording import read_recording
from gateway.offline.phone.tables import PhoneRecording, Vectors
from gateway.records import F64, Frames, iso_utc
from gateway.units import NS_PER_S, STANDARD_GRAVITY_MPS2

MAP_NAME: Final = "phone"
CHANNEL: Final = "phone0"
SHORTEST_S: Final = 60.0  # chosen: least stretch without a movement of the phone
SURE_COMPASS: Final = 0.5  # chosen: correlation that decides the sign
_DEG: Final = np.pi / 180.0  # radians


@dataclass(frozen=True, slots=True)
class Imported:
    """The result of an import: the stretch used [ns], the phone's orientation, and remarks for the user."""

    recording: PhoneRecording
    stretch: tuple[int, int]
    axes: Axes
    sign_from: str
    ride_mps2: float
    remarks: tuple[Remark, ...]

    @property
    def duration_s(self) -> float:
        return (self.stretch[1] - self.stretch[0]) / NS_PER_S

    def to_json(self) -> dict[str, Any]:
        """The result as JSON; unknown is null."""
        axes, recording = self.axes, self.recording
        return {
            "app": recording.app,
            "device": recording.device,
            "t_start": iso_utc(self.stretch[0]),
            "duration_s": self.duration_s,
            "accelerometer_hz": round(sample_rate_hz(recording.accel.t_ns), 2),
            "gyroscope_hz": round(sample_rate_hz(recording.gyro.t_ns), 2),
            "fixes": len(recording.fixes.t_ns),
            "gravity_mps2": axes.gravity_mps2,
            "forward_fit": _known(axes.fit),
            "speed_delay_s": axes.delay_s,
            "sign_from": self.sign_from,
            "compass": _known(axes.compass),
            "ride_mps2": _known(self.ride_mps2),
            "remarks": [{"code": each.code, "text": each.text} for each in self.remarks],
        }


def import_recording(
    path: Path, output: Path, forward: str | None = None, *, with_position: bool = True
) -> tuple[Imported, tuple[Path, ...]]:
    """Write the log and, beside it, phone.toml and phone.dbc; returns the result and the paths, the log first.

    ``forward`` names the phone's axis that points ahead (y is its top edge) if the drive does not show it. Raises
    LogUnreadableError for the recording, ConfigurationError if a file exists or cannot be written, SpringscaleError if
    the recording does not suffice.
    """
    if output.exists():
        raise ConfigurationError(f"{output}: is there already, and is not written over; name another")
    signals, database = (output.parent / f"{MAP_NAME}.{kind}" for kind in ("toml", "dbc"))
    for copy in (signals, database):
        if copy.exists() and copy.read_bytes() != _shipped(copy).read_bytes():
            raise ConfigurationError(f"{copy}: is there already and is another; write {output.name} to another folder")
    found = imported(read_recording(path), forward)
    frames = frames_of(found, with_position=with_position)
    with refusal_told(output, ConfigurationError):
        write_candump(frames, CHANNEL, output)
        for copy in (database, signals):
            if not copy.exists():
                write_whole(copy, _shipped(copy).read_text(encoding="utf-8"))
    return found, (output, signals, database)


def _shipped(copy: Path) -> Path:
    return shipped_map(MAP_NAME).with_name(copy.name)


def imported(recording: PhoneRecording, forward: str | None = None) -> Imported:
    """Find the stretch, the sign and the axes. Raises SpringscaleError if one of them cannot be determined."""
    stretch, moved = still_stretch(recording.accel, recording.gyro)
    seconds = (stretch[1] - stretch[0]) / NS_PER_S
    if seconds < SHORTEST_S:
        raise SpringscaleError(
            f"{recording.path}: the phone lay still for {max(seconds, 0.0):.0f} s at most: fix it to the floor"
        )
    ahead = None if forward is None else AXES[forward]
    part, axes, sign_from, doubts = _signed(recording.within(*stretch), ahead)
    if axes is None:
        raise SpringscaleError(
            f"{recording.path}: which way is forward cannot be told: it takes two minutes of drive with some braking "
            "and bends, and a satellite speed; or name the phone's axis that points ahead by --forward (y: its top)"
        )
    vertical = part.accel.xyz @ axes.to_vehicle[2]
    remarks = [*_moves(moved, stretch), *doubts]
    if abs(axes.gravity_mps2 - STANDARD_GRAVITY_MPS2) > 0.5:
        wrong = f"the accelerometer reads gravity as {axes.gravity_mps2:.2f} m/s2: its scale is wrong"
        remarks.append(Remark("gravity", wrong))
    remarks += remarks_on(part, vertical, stretch)
    ride_mps2, _ = ride_of(part.accel, vertical, part.fixes)
    return Imported(part, stretch, axes, sign_from, ride_mps2, tuple(remarks))


def _signed(part: PhoneRecording, forward: F64 | None) -> tuple[PhoneRecording, Axes | None, str, tuple[Remark, ...]]:
    """The recording with the vehicle's sign of acceleration, its axes, and the evidence for the sign."""
    told = part.accel_sign
    part = _times(part, told or 1)
    axes = axes_of(part.accel, part.gyro, part.fixes, forward)
    compass = axes.compass if axes is not None else np.nan
    if abs(compass) > SURE_COMPASS and (told is None or compass < 0.0):
        says_other = compass < 0.0
        if says_other:
            part = _times(part, -1)
            axes = axes_of(part.accel, part.gyro, part.fixes, forward)
        wrong = Remark(
            "sign", "the compass course contradicts the sign that the metadata tells; the course is believed"
        )
        return part, axes, "course", (wrong,) if told is not None else ()
    if told is not None:
        return part, axes, "metadata", ()
    unsure = Remark(
        "sign",
        "nothing tells the sign of the accelerations (too few bends): taken as Android's; a roll rate may be reversed",
    )
    return part, axes, "assumed", (unsure,)


def _times(part: PhoneRecording, sign: int) -> PhoneRecording:
    return replace(part, accel=Vectors(part.accel.t_ns, sign * part.accel.xyz))


def _moves(moved: tuple[int, ...], stretch: tuple[int, int]) -> Iterator[Remark]:
    """Remarks on movements of the phone, also the usual ones at the beginning and the end."""
    for t_ns in moved:
        yield Remark("phone_moved", f"the phone moved at {iso_utc(t_ns)[11:19]} UTC")
    if moved:
        begin, end = (iso_utc(t_ns)[11:19] for t_ns in stretch)
        yield Remark("cut", f"only {begin} to {end} UTC is taken, the longest time in which it lay still")


def frames_of(found: Imported, *, with_position: bool = True) -> Frames:
    """Frames of dbc/phone.dbc in order of time."""
    encoder = Encoder(load_signal_map(SHIPPED_PREFIX + MAP_NAME))
    recording, fixes = found.recording, found.recording.fixes
    accel = recording.accel.xyz @ found.axes.to_vehicle.T
    rates = recording.gyro.xyz @ found.axes.to_vehicle.T / _DEG
    has_speed = np.isfinite(fixes.speed_mps)
    true_ns = fixes.t_ns[has_speed] - round(found.axes.delay_s * NS_PER_S)
    parts = [
        encoder.encode(
            "PHONE_ACCEL", recording.accel.t_ns, {f"Accel{axis}": accel[:, i] for i, axis in enumerate("XYZ")}
        ),
        encoder.encode(
            "PHONE_GYRO",
            recording.gyro.t_ns,
            {name: rates[:, i] for i, name in enumerate(("RollRate", "PitchRate", "YawRate"))},
        ),
        encoder.encode("PHONE_SPEED", true_ns, {"Speed": fixes.speed_mps[has_speed]}),
    ]
    if with_position:
        at = np.isfinite(fixes.latitude_deg) & np.isfinite(fixes.longitude_deg)
        place = {"Latitude": fixes.latitude_deg[at], "Longitude": fixes.longitude_deg[at]}
        parts.append(encoder.encode("PHONE_POSITION", fixes.t_ns[at], place))
    return merge_frames(parts)


def _known(number: float) -> float | None:
    return number if np.isfinite(number) else None
