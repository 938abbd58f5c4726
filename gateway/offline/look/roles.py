"""Assigns roles to signals: the axis with gravity, the one that shows braking, and the remaining one.

Gravity shows the vertical axis; the horizontal acceleration that correlates with the change of speed is longitudinal.
Left is up x forward (ISO 8855). The rate about left is the pitch rate and the one about forward the roll rate, by the
right-hand rule of gyroscopes. A name with "pitch" or "roll" takes precedence.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.batch import GRAVITY_TOLERANCE_MPS2
from gateway.core.batch_settings import BatchSettings
from gateway.offline.look.heard import SignalReading
from gateway.records import Signal
from gateway.units import STANDARD_GRAVITY_MPS2

LEAST_CORRELATION: Final = 0.4  # chosen: of acceleration and change of speed
LEAST_MOVING_S: Final = 60  # chosen: of driving for that
SLOW_MPS, FAST_MPS = BatchSettings().speed_min_mps, BatchSettings().speed_max_mps
MOVING_MPS: Final = 3.0  # chosen: above a receiver's noise
_NO_SPEED: Final = re.compile(r"accura|error|std|dev|limit|vert|max|min|set|_[xyz]$", re.IGNORECASE)
_SPEED: Final = re.compile(r"speed|vel|sog|spd", re.IGNORECASE)
_WORDS: Final = {"vertical": "z", "longitudinal": "x", "forward": "x", "lateral": "y", "transverse": "y"}
_AXES: Final = "xyz"
_TURNS: Final = {  # the word in its name ("roll", but not "controller"), and when it goes up
    Signal.PITCH_RATE: ("pitch", "as braking begins"),
    Signal.ROLL_RATE: ("(?<!nt)roll", "as a bend to the left begins"),
}


@dataclass(frozen=True, slots=True)
class FoundRole:
    """A reading with its role and sign, and the evidence for it."""

    role: Signal
    reading: SignalReading
    sign: int
    why: str
    is_sure: bool = True

    @property
    def name(self) -> str:
        return self.reading.name

    @property
    def axis(self) -> tuple[str, int]:
        """The axis of the sensor, empty if its name has none, and its sign."""
        return axis_of(self.reading.signal.name), self.sign


def roles_of(readings: Sequence[SignalReading]) -> list[FoundRole]:
    """The roles that could be determined, in the order of Signal."""
    up, speed = _upright(readings), _speed(readings)
    found = [up, speed]
    if up is not None:
        forward = _forward(beside(readings, up), speed) if speed else None
        channel = up.reading.heard.channel
        rates = [each for each in readings if each.quantity == "angular_rate" and each.heard.channel == channel]
        rates.sort(key=lambda r: (r.heard is not up.reading.heard, -round(r.heard.rate_hz)))
        ahead = forward.axis if forward else ("x", 1)  # with z up and nothing else known, x is forward
        left = _crossed(up.axis, ahead)
        found += [forward, _rate(rates, Signal.PITCH_RATE, left, "the rate about left = up x forward", forward)]
        found += [_rate(rates, Signal.ROLL_RATE, ahead if left[0] else left, "the rate about forward", forward)]
    return sorted(filter(None, found), key=lambda each: list(Signal).index(each.role))


def beside(readings: Sequence[SignalReading], up: FoundRole) -> list[SignalReading]:
    """The other accelerations of the message in which the vertical one comes."""
    same = [r for r in readings if r.heard is up.reading.heard and r.quantity == "acceleration"]
    return [r for r in same if r is not up.reading]


def _upright(readings: Sequence[SignalReading]) -> FoundRole | None:
    """The fastest acceleration that reads gravity."""
    off_mps2 = {id(r): abs(abs(r.usual) - STANDARD_GRAVITY_MPS2) for r in readings if r.quantity == "acceleration"}
    candidates = [r for r in readings if off_mps2.get(id(r), math.inf) < GRAVITY_TOLERANCE_MPS2]
    if not candidates:
        return None
    best = max(candidates, key=lambda r: (round(r.heard.rate_hz), -off_mps2[id(r)]))
    why = f"reads {best.usual:+.2f} m/s2: this axis is vertical"
    return FoundRole(Signal.VERTICAL_ACCELERATION, best, 1 if best.usual > 0.0 else -1, why)


def _speed(readings: Sequence[SignalReading]) -> FoundRole | None:
    """Speed over ground if there is one, else of the wheels."""
    speeds = [r for r in readings if r.quantity == "speed" and len(r.x)]
    named = [r for r in speeds if _SPEED.search(r.name) and not _NO_SPEED.search(r.signal.name)]
    able = [(SLOW_MPS <= np.max(r.x) <= FAST_MPS, r) for r in named if np.min(r.x) > -1.0]
    if not able:
        return None
    is_sure, best = min(
        able,
        key=lambda told: (
            not told[0], "wheel" in told[1].name.lower(), "navig" not in told[1].name.lower(), -told[1].heard.rate_hz
        ),
    )  # fmt: skip
    role = Signal.WHEEL_SPEED if "wheel" in best.name.lower() else Signal.SPEED
    doubt = "" if is_sure else ": if it drove otherwise, correct unit or factor of the speed in the database"
    return FoundRole(role, best, 1, f"up to {np.max(best.x) * 3.6:.0f} km/h{doubt}", bool(is_sure))


def _forward(horizontal: Sequence[SignalReading], speed: FoundRole) -> FoundRole | None:
    """The horizontal acceleration that correlates with the change of speed."""
    found = [(_with_braking(each, speed.reading), each) for each in horizontal]
    told = [(correlation, each) for correlation, each in found if abs(correlation) > LEAST_CORRELATION]
    if not told:
        return None
    correlation, best = max(told, key=lambda pair: abs(pair[0]))
    where, sign = ("forward", 1) if correlation > 0.0 else ("rearward", -1)
    why = f"points {where}: goes with the change of speed (correlation {correlation:+.2f})"
    return FoundRole(Signal.LONGITUDINAL_ACCELERATION, best, sign, why)


def _with_braking(acceleration: SignalReading, speed: SignalReading) -> float:
    """Correlation with the slope of the speed, second by second while the vehicle moves; NaN if it hardly does."""
    begin_s, end_s = max(speed.t_s[0], acceleration.t_s[0]), min(speed.t_s[-1], acceleration.t_s[-1])
    second = np.floor(acceleration.t_s - begin_s)
    is_inside = (second >= 1.0) & (second < math.floor(end_s - begin_s) - 1.0)
    seconds, place = np.unique(second[is_inside], return_inverse=True)  # a log may be years long by its stamps
    mean = np.bincount(place, acceleration.x[is_inside]) / np.bincount(place)
    before, now, after = (np.interp(begin_s + 0.5 + seconds + k, speed.t_s, speed.x) for k in (-1.5, 0.0, 1.5))
    slope, counts = (after - before) / 3.0, now > MOVING_MPS
    if np.count_nonzero(counts) < LEAST_MOVING_S or np.ptp(slope[counts]) == 0.0 or np.ptp(mean[counts]) == 0.0:
        return math.nan
    return float(np.corrcoef(mean[counts], slope[counts])[0, 1])


def _rate(
    rates: Sequence[SignalReading], role: Signal, axis: tuple[str, int], why: str, forward: FoundRole | None
) -> FoundRole | None:
    """The rate with the word in its name, which gives no sign, else the one about the axis."""
    word, when = _TURNS[role]
    for each in rates:
        if re.search(word, each.signal.name, re.IGNORECASE) and "accel" not in each.signal.name.lower():
            told = f"its name says so; its sign is not: it must go up {when}, else sign = -1"
            return FoundRole(role, each, 1, told, is_sure=False)
    about = next((each for each in rates if axis[0] and axis_of(each.signal.name) == axis[0]), None)
    told = why if forward else f"{why}; that x points forward is a guess: no braking shows it"
    return FoundRole(role, about, axis[1], told, forward is not None) if about else None


def axis_of(name: str) -> str:
    """x, y or z by the last letter of a name or a word in it; empty if it has none."""
    bare = name.rstrip("_0123456789")
    if len(bare) > 1 and bare[-1] in "XYZ" and not bare[-2:].isupper():
        return bare[-1].lower()
    if re.search(r"(?:_|^)[xyzXYZ]$", bare) or re.search(r"(?i)(?:acc|gyro|rate|gyr|rot)[xyz]$", bare):
        return bare[-1].lower()
    return next((axis for word, axis in _WORDS.items() if word in name.lower()), "")


def _crossed(one: tuple[str, int], other: tuple[str, int]) -> tuple[str, int]:
    """The axis along one x other and its sign; without a name if one of them has none, or both are the same."""
    if not (one[0] and other[0] and one[0] != other[0]):
        return "", 1
    turns = np.cross(*(sign * np.eye(3)[_AXES.index(axis)] for axis, sign in (one, other)))
    at = int(np.argmax(np.abs(turns)))
    return _AXES[at], int(np.sign(turns[at]))
