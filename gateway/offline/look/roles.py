"""Assigns roles to signals: the axis with gravity, the one that shows braking, and the remaining one.

Gravity shows the vertical axis; the horizontal acceleration that correlates with the change of speed is longitudinal.
Left is up x forward (ISO 8855). The rate about left is the pitch rate and the one about forward the roll rate, by the
right-hand rule of gyroscopes. A name with "pitch" or "roll" takes precedence.
"""

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.bus.signals import MappedMessage, SignalMap
from gateway.bus.signals.mapping import MappedSignal
from gateway.core.batch import GRAVITY_TOLERANCE_MPS2
from gateway.offline.look.readings import SignalReading
from gateway.records import F64, Signal
from gateway.units import STANDARD_GRAVITY_MPS2

LEAST_CORRELATION: Final = 0.4  # chosen: of acceleration and change of speed
LEAST_MOVING_S: Final = 60  # chosen: of driving for that
MOVING_MPS: Final = 3.0  # chosen: above a receiver's noise
FASTEST_MPS: Final = 100.0  # chosen: a higher reading is not a road vehicle's speed
_NO_SPEED: Final = re.compile(r"accura|error|std|dev|limit|vert|max|min|set|_[xyz]$", re.IGNORECASE)
_SPEED: Final = re.compile(r"speed|vel|sog|spd", re.IGNORECASE)
_WORDS: Final = {"vertical": "z", "longitudinal": "x", "forward": "x", "lateral": "y", "transverse": "y"}
_AXES: Final = "xyz"
_PITCH: Final = re.compile(r"pitch", re.IGNORECASE)
ROLL: Final = re.compile(r"(?<!nt)roll", re.IGNORECASE)  # but not "controller"
_CHECK: Final = {
    Signal.PITCH_RATE: "it must go up as braking begins, else sign = -1",
    Signal.ROLL_RATE: "it must go up as a bend to the left begins, else sign = -1",
}


@dataclass(frozen=True, slots=True)
class FoundRole:
    """A reading with its role and sign, and the evidence for it."""

    role: Signal
    reading: SignalReading
    sign: int
    why: str
    is_sure: bool = True


def roles_of(readings: Sequence[SignalReading]) -> tuple[FoundRole, ...]:
    """The roles that could be determined, in the order of Signal."""
    speed = _speed(readings)
    up = upright(readings)
    found = [each for each in (up, speed) if each]
    if up is not None:
        forward = _forward(readings, up, speed)
        pitch, roll = (
            _named(readings, up, role, word) or _about(readings, up, role, axis, why)
            for role, word, axis, why in (
                (Signal.PITCH_RATE, _PITCH, _left(up, forward), "the rate about left = up x forward"),
                (Signal.ROLL_RATE, ROLL, _ahead(up, forward), "the rate about forward"),
            )
        )
        found += [each for each in (forward, pitch, roll) if each]
    return tuple(sorted(found, key=lambda each: list(Signal).index(each.role)))


def upright(readings: Iterable[SignalReading]) -> FoundRole | None:
    """The fastest acceleration that reads gravity."""
    candidates = [
        r for r in readings
        if r.quantity == "acceleration" and abs(abs(r.usual) - STANDARD_GRAVITY_MPS2) < GRAVITY_TOLERANCE_MPS2
    ]  # fmt: skip
    if not candidates:
        return None
    best = max(candidates, key=lambda r: (round(r.rate_hz), -abs(abs(r.usual) - STANDARD_GRAVITY_MPS2)))
    sign = 1 if best.usual > 0.0 else -1
    return FoundRole(Signal.VERTICAL_ACCELERATION, best, sign, f"reads {best.usual:+.2f} m/s2: this axis is vertical")


def tilt_deg(readings: Iterable[SignalReading], up: FoundRole) -> float:
    """Tilt of the vertical axis in degrees, by the other axes of its message; 0 without them."""
    beside = [r.usual for r in readings if _is_beside(r, up.reading) and math.isfinite(r.usual)]
    return math.degrees(math.atan2(math.hypot(*beside), abs(up.reading.usual)))


def _is_beside(reading: SignalReading, other: SignalReading) -> bool:
    return reading is not other and reading.described is other.described and reading.quantity == other.quantity


def axis_of(name: str) -> str:
    """x, y or z by the last letter of a name or a word in it; empty if it has none."""
    bare = name.rstrip("_0123456789")
    if len(bare) > 1 and bare[-1] in "XYZ" and not bare[-2:].isupper():
        return bare[-1].lower()
    if re.search(r"(?:_|^)[xyzXYZ]$", bare) or re.search(r"(?i)(?:acc|gyro|rate|gyr|rot)[xyz]$", bare):
        return bare[-1].lower()
    return next((axis for word, axis in _WORDS.items() if word in name.lower()), "")


def _forward(readings: Sequence[SignalReading], up: FoundRole, speed: FoundRole | None) -> FoundRole | None:
    """The horizontal acceleration that correlates with the change of speed."""
    beside = [r for r in readings if _is_beside(r, up.reading)]
    if speed is None or not beside:
        return None
    found = [(correlation, r) for r in beside if math.isfinite(correlation := _with_braking(r, speed.reading))]
    if not found:
        return None
    correlation, best = max(found, key=lambda pair: abs(pair[0]))
    if abs(correlation) < LEAST_CORRELATION:
        return None
    where = "forward" if correlation > 0.0 else "rearward"
    why = f"points {where}: goes with the change of speed (correlation {correlation:+.2f})"
    return FoundRole(Signal.LONGITUDINAL_ACCELERATION, best, 1 if correlation > 0.0 else -1, why)


def _with_braking(acceleration: SignalReading, speed: SignalReading) -> float:
    """Correlation with the slope of the speed, second by second while the vehicle moves; NaN if it hardly does."""
    if len(speed.t_s) < LEAST_MOVING_S or len(acceleration.t_s) < LEAST_MOVING_S:
        return math.nan
    begin_s, end_s = max(speed.t_s[0], acceleration.t_s[0]), min(speed.t_s[-1], acceleration.t_s[-1])
    n = int(end_s - begin_s)
    if n < LEAST_MOVING_S:
        return math.nan
    speed_mps = np.interp(begin_s + 0.5 + np.arange(n), speed.t_s, speed.x)
    slope = np.gradient(np.convolve(speed_mps, np.full(3, 1.0 / 3.0), mode="same"))
    mean = _second_by_second(acceleration.t_s - begin_s, acceleration.x, n)
    counts = (speed_mps > MOVING_MPS) & np.isfinite(mean)
    counts[[0, -1]] = False
    if np.count_nonzero(counts) < LEAST_MOVING_S or np.ptp(slope[counts]) == 0.0 or np.ptp(mean[counts]) == 0.0:
        return math.nan
    return float(np.corrcoef(mean[counts], slope[counts])[0, 1])


def _second_by_second(t_s: F64, x: F64, n: int) -> F64:
    """(n,) mean of the samples of each second; NaN without any."""
    second = np.floor(t_s).astype(int)
    inside = (second >= 0) & (second < n)
    n_samples = np.bincount(second[inside], minlength=n)
    total = np.bincount(second[inside], x[inside], minlength=n)
    return np.where(n_samples > 0, total / np.maximum(n_samples, 1), np.nan)


def _named(readings: Sequence[SignalReading], up: FoundRole, role: Signal, word: re.Pattern[str]) -> FoundRole | None:
    """The rate with the word in its name; the name gives no sign."""
    fit = [r for r in _rates(readings, up) if word.search(r.signal.name) and "accel" not in r.signal.name.lower()]
    return (
        FoundRole(role, fit[0], 1, f"its name says so; its sign is not: {_CHECK[role]}", is_sure=False) if fit else None
    )


def _about(
    readings: Sequence[SignalReading], up: FoundRole, role: Signal, axis: tuple[str, int, bool], why: str
) -> FoundRole | None:
    """The rate about an axis, given by its name, its sign, and whether it was measured."""
    name, sign, is_sure = axis
    about = next((r for r in _rates(readings, up) if name and axis_of(r.signal.name) == name), None)
    unsure = "" if is_sure else "; that x points forward is a guess: no braking shows it"
    return None if about is None else FoundRole(role, about, sign, why + unsure, is_sure)


def _rates(readings: Sequence[SignalReading], up: FoundRole) -> list[SignalReading]:
    """The angular rates of the same channel, those of the same message first, then the fastest."""
    channel = up.reading.described.heard.channel
    rates = [r for r in readings if r.quantity == "angular_rate" and r.described.heard.channel == channel]
    return sorted(rates, key=lambda r: (r.described is not up.reading.described, -round(r.rate_hz)))


def _left(up: FoundRole, forward: FoundRole | None) -> tuple[str, int, bool]:
    """The axis along left, its sign, and whether it was measured."""
    ahead, ahead_sign, is_sure = _ahead(up, forward)
    if not ahead:
        return "", 1, False
    return *_crossed((axis_of(up.reading.signal.name), up.sign), (ahead, ahead_sign)), is_sure


def _crossed(one: tuple[str, float], other: tuple[str, float]) -> tuple[str, int]:
    """The axis along one x other and its sign; each is given by its name and a number of its sign."""
    turns = np.cross(*(np.sign(sign) * np.eye(3)[_AXES.index(axis)] for axis, sign in (one, other)))
    at = int(np.argmax(np.abs(turns)))
    return _AXES[at], int(np.sign(turns[at]))


def _ahead(up: FoundRole, forward: FoundRole | None) -> tuple[str, int, bool]:
    """The axis along forward, its sign, and whether it was measured; with z up and nothing else known, x is forward."""
    ahead, sign = ("x", 1) if forward is None else (axis_of(forward.reading.signal.name), forward.sign)
    up_axis = axis_of(up.reading.signal.name)
    return (ahead, sign, forward is not None) if up_axis and ahead and up_axis != ahead else ("", 1, False)


def _speed(readings: Iterable[SignalReading]) -> FoundRole | None:
    """Speed over ground if there is one, else of the wheels."""
    named = [r for r in readings if r.quantity == "speed" and _is_speed(r)]
    if not named:
        return None
    best = min(named, key=lambda r: ("wheel" in r.name.lower(), "navig" not in r.name.lower(), -r.rate_hz))
    role = Signal.WHEEL_SPEED if "wheel" in best.name.lower() else Signal.SPEED
    return FoundRole(role, best, 1, f"up to {np.max(best.x) * 3.6:.0f} km/h")


def _is_speed(reading: SignalReading) -> bool:
    is_named = _SPEED.search(reading.name) and not _NO_SPEED.search(reading.signal.name)
    return bool(is_named and len(reading.x) and np.min(reading.x) > -1.0 and np.max(reading.x) < FASTEST_MPS)


_ROLL_SIGN: Final = "sign 1 or -1: it must go up as a bend to the left begins"
_BY_AXES: Final = "its sign by the right-hand rule from the two axes that are mapped"


def unmapped_roll_rate(signal_map: SignalMap) -> str | None:
    """The entry for the map; None if the map has a roll rate, or no name in the message suggests one.

    A name with "roll" takes precedence. Otherwise it is the third axis beside those of the vertical acceleration and of
    the pitch rate: forward = left x up, with left and up as these two are mapped.
    """
    pitch = next(_mapped(signal_map, Signal.PITCH_RATE), None)
    if pitch is None or Signal.ROLL_RATE in signal_map.signals:
        return None
    message, pitch_rate = pitch
    beside = [name for name in message.fields if name != pitch_rate.dbc_signal]
    named = [name for name in beside if ROLL.search(name) and "accel" not in name.lower()]
    if named:
        return _entry(message, named[0], _ROLL_SIGN)
    up = next((signal for _, signal in _mapped(signal_map, Signal.VERTICAL_ACCELERATION)), None)
    axis, sign = "", 1
    if up is not None:
        up_axis, left_axis = axis_of(up.dbc_signal), axis_of(pitch_rate.dbc_signal)
        if up_axis and left_axis and up_axis != left_axis:
            axis, sign = _crossed((left_axis, pitch_rate.to_si), (up_axis, up.to_si))
    like_pitch = [name for name in beside if axis and _with_axis(pitch_rate.dbc_signal, axis) == name]
    return _entry(message, like_pitch[0], f"sign = {sign}, {_BY_AXES}") if like_pitch else None


def _mapped(signal_map: SignalMap, wanted: Signal) -> Iterator[tuple[MappedMessage, MappedSignal]]:
    for message in signal_map.messages:
        yield from ((message, signal) for signal in message.signals if signal.signal is wanted)


def _entry(message: MappedMessage, name: str, sign: str) -> str:
    return f'[signals.roll_rate] with message = "{message.name}", signal = "{name}", and {sign}'


def _with_axis(name: str, axis: str) -> str:
    """The name of the same quantity about another axis: AngularRateZ and y give AngularRateY."""
    at = max(name.lower().rfind(each) for each in _AXES)
    return name[:at] + (axis.upper() if name[at].isupper() else axis) + name[at + 1 :]
