"""Assigns roles to signals: the axis with gravity, the one that shows braking, and the remaining one.

Gravity shows the vertical axis; the horizontal acceleration that correlates with the change of speed is longitudinal.
Left is up x forward (ISO 8855). The rate about left is the pitch rate and the one about forward the roll rate, by the
right-hand rule of gyroscopes. A name with "pitch" or "roll" takes precedence.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from gateway.core.batch import GRAVITY_TOLERANCE_MPS2
from gateway.records import Signal
from gateway.units import STANDARD_GRAVITY_MPS2

if TYPE_CHECKING:
    from gateway.offline.look.log_look import SignalReading

LEAST_CORRELATION: Final = 0.4  # chosen: of acceleration and change of speed
LEAST_MOVING_S: Final = 60  # chosen: of driving for that
MOVING_MPS: Final = 3.0  # chosen: above a receiver's noise
FASTEST_MPS: Final = 100.0  # chosen: a higher reading is not a road vehicle's speed
_NO_SPEED: Final = re.compile(r"accura|error|std|dev|limit|vert|max|min|set|_[xyz]$", re.IGNORECASE)
_SPEED: Final = re.compile(r"speed|vel|sog|spd", re.IGNORECASE)
_WORDS: Final = {"vertical": "z", "longitudinal": "x", "forward": "x", "lateral": "y", "transverse": "y"}
_AXES: Final = "xyz"
_CHECK: Final = {
    Signal.PITCH_RATE: "it must go up as braking begins, else sign = -1",
    Signal.ROLL_RATE: "it must go up as a bend to the left begins, else sign = -1",
}


@dataclass(frozen=True, slots=True)
class FoundRole:
    """A reading with its role and sign, and the evidence for it."""

    role: Signal
    reading: "SignalReading"
    sign: int
    why: str
    is_sure: bool = True


def roles_of(readings: "Sequence[SignalReading]") -> tuple[FoundRole, ...]:
    """The roles that could be determined, in the order of Signal."""
    speed = _speed(readings)
    up = upright(readings)
    found = [each for each in (up, speed) if each]
    if up is not None:
        forward = _forward(readings, up, speed)
        channel = up.reading.described.heard.channel
        rates = [r for r in readings if r.quantity == "angular_rate" and r.described.heard.channel == channel]
        rates.sort(key=lambda r: (r.described is not up.reading.described, -round(r.rate_hz)))
        upward = (axis_of(up.reading.signal.name), up.sign)
        # with z up and nothing else known, x is forward
        ahead = ("x", 1) if forward is None else (axis_of(forward.reading.signal.name), forward.sign)
        is_known = bool(upward[0] and ahead[0] and upward[0] != ahead[0])
        left, about = (_crossed(upward, ahead), ahead) if is_known else (("", 1), ("", 1))
        sure = forward is not None
        pitch = _rate(rates, Signal.PITCH_RATE, "pitch", left, sure, "the rate about left = up x forward")
        # "roll", but not "controller"
        roll = _rate(rates, Signal.ROLL_RATE, r"(?<!nt)roll", about, sure, "the rate about forward")
        found += [each for each in (forward, pitch, roll) if each]
    return tuple(sorted(found, key=lambda each: list(Signal).index(each.role)))


def upright(readings: "Iterable[SignalReading]") -> FoundRole | None:
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


def tilt_deg(readings: "Iterable[SignalReading]", up: FoundRole) -> float:
    """Tilt of the vertical axis in degrees, by the other axes of its message; 0 without them."""
    beside = [r.usual for r in readings if _is_beside(r, up.reading) and math.isfinite(r.usual)]
    return math.degrees(math.atan2(math.hypot(*beside), abs(up.reading.usual)))


def _is_beside(reading: "SignalReading", other: "SignalReading") -> bool:
    return reading is not other and reading.described is other.described and reading.quantity == other.quantity


def axis_of(name: str) -> str:
    """x, y or z by the last letter of a name or a word in it; empty if it has none."""
    bare = name.rstrip("_0123456789")
    if len(bare) > 1 and bare[-1] in "XYZ" and not bare[-2:].isupper():
        return bare[-1].lower()
    if re.search(r"(?:_|^)[xyzXYZ]$", bare) or re.search(r"(?i)(?:acc|gyro|rate|gyr|rot)[xyz]$", bare):
        return bare[-1].lower()
    return next((axis for word, axis in _WORDS.items() if word in name.lower()), "")


def _forward(readings: "Sequence[SignalReading]", up: FoundRole, speed: FoundRole | None) -> FoundRole | None:
    """The horizontal acceleration that correlates with the change of speed."""
    beside = [r for r in readings if _is_beside(r, up.reading)]
    if speed is None:
        return None
    found = [
        (correlation, r) for r in beside if abs(correlation := _with_braking(r, speed.reading)) > LEAST_CORRELATION
    ]
    if not found:
        return None
    correlation, best = max(found, key=lambda pair: abs(pair[0]))
    where = "forward" if correlation > 0.0 else "rearward"
    why = f"points {where}: goes with the change of speed (correlation {correlation:+.2f})"
    return FoundRole(Signal.LONGITUDINAL_ACCELERATION, best, 1 if correlation > 0.0 else -1, why)


def _with_braking(acceleration: "SignalReading", speed: "SignalReading") -> float:
    """Correlation with the slope of the speed, second by second while the vehicle moves; NaN if it hardly does."""
    if min(len(speed.t_s), len(acceleration.t_s)) < LEAST_MOVING_S:
        return math.nan
    begin_s, end_s = max(speed.t_s[0], acceleration.t_s[0]), min(speed.t_s[-1], acceleration.t_s[-1])
    second = np.floor(acceleration.t_s - begin_s)
    is_inside = (second >= 1.0) & (second < math.floor(end_s - begin_s) - 1.0)
    if not is_inside.any():
        return math.nan
    seconds, place = np.unique(second[is_inside], return_inverse=True)  # a log may be years long by its stamps
    mean = np.bincount(place, acceleration.x[is_inside]) / np.bincount(place)
    before, now, after = (np.interp(begin_s + 0.5 + seconds + k, speed.t_s, speed.x) for k in (-1.5, 0.0, 1.5))
    slope = (after - before) / 3.0
    counts = now > MOVING_MPS
    if np.count_nonzero(counts) < LEAST_MOVING_S or np.ptp(slope[counts]) == 0.0 or np.ptp(mean[counts]) == 0.0:
        return math.nan
    return float(np.corrcoef(mean[counts], slope[counts])[0, 1])


def _rate(
    rates: Sequence["SignalReading"], role: Signal, word: str, axis: tuple[str, int], is_sure: bool, why: str
) -> FoundRole | None:
    """The rate with the word in its name, which gives no sign, else the one about the axis."""
    named = [r for r in rates if re.search(word, r.signal.name, re.IGNORECASE) and "accel" not in r.signal.name.lower()]
    if named:
        return FoundRole(role, named[0], 1, f"its name says so; its sign is not: {_CHECK[role]}", is_sure=False)
    about = next((r for r in rates if axis[0] and axis_of(r.signal.name) == axis[0]), None)
    unsure = "" if is_sure else "; that x points forward is a guess: no braking shows it"
    return None if about is None else FoundRole(role, about, axis[1], why + unsure, is_sure)


def _crossed(one: tuple[str, int], other: tuple[str, int]) -> tuple[str, int]:
    """The axis along one x other and its sign; each is given by its name and sign."""
    turns = np.cross(*(sign * np.eye(3)[_AXES.index(axis)] for axis, sign in (one, other)))
    at = int(np.argmax(np.abs(turns)))
    return _AXES[at], int(np.sign(turns[at]))


def _speed(readings: "Iterable[SignalReading]") -> FoundRole | None:
    """Speed over ground if there is one, else of the wheels."""
    named = [
        r
        for r in readings
        if r.quantity == "speed" and _SPEED.search(r.name) and not _NO_SPEED.search(r.signal.name)
        and len(r.x) and np.min(r.x) > -1.0 and np.max(r.x) < FASTEST_MPS
    ]  # fmt: skip
    if not named:
        return None
    best = min(named, key=lambda r: ("wheel" in r.name.lower(), "navig" not in r.name.lower(), -r.rate_hz))
    role = Signal.WHEEL_SPEED if "wheel" in best.name.lower() else Signal.SPEED
    return FoundRole(role, best, 1, f"up to {np.max(best.x) * 3.6:.0f} km/h")
