"""The types that the rooms exchange: frames, motion, batches and reasons; gateway.estimates has what is estimated.

Plain immutable values. Arrays are numpy, SI throughout, unknown is NaN. Time is the frame's own,
integer nanoseconds since 1970-01-01 UTC.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from gateway.metadata import AsLists
from gateway.units import NS_PER_S

_START: Final = datetime(1970, 1, 1, tzinfo=UTC)
FIRST_DATED_NS: Final = 504_921_600 * NS_PER_S  # 1986, the year of CAN: earlier stamps count from something else

F64 = Annotated[NDArray[np.float64], AsLists]
F32 = NDArray[np.float32]
I64 = NDArray[np.int64]
U32 = NDArray[np.uint32]
U8 = NDArray[np.uint8]
Bool = NDArray[np.bool_]
C128 = NDArray[np.complex128]

EXTENDED_ID: Final = 0x8000_0000  # CAN_EFF_FLAG of SocketCAN: a 29-bit identifier


class Signal(StrEnum):
    """The signals that the gateway reads from a bus. The first three are needed, the others are welcome."""

    VERTICAL_ACCELERATION = "vertical_acceleration"
    PITCH_RATE = "pitch_rate"
    SPEED = "speed"
    ROLL_RATE = "roll_rate"
    LONGITUDINAL_ACCELERATION = "longitudinal_acceleration"
    LATERAL_ACCELERATION = "lateral_acceleration"
    YAW_RATE = "yaw_rate"
    WHEEL_SPEED = "wheel_speed"
    IGNITION = "ignition"
    AMBIENT_TEMPERATURE = "ambient_temperature"
    AXLE_WEIGHT = "axle_weight"
    LATITUDE = "latitude"
    LONGITUDE = "longitude"
    ODOMETER = "odometer"
    DOOR = "door"
    AIR_SPRING_PRESSURE = "air_spring_pressure"
    RIDE_HEIGHT = "ride_height"
    TRAILER = "trailer"


JOURNEY: Final = frozenset({Signal.IGNITION, Signal.LATITUDE, Signal.LONGITUDE, Signal.ODOMETER, Signal.DOOR})
"""Signals of position and use: no estimate depends on them, and no batch waits for them."""

STATIC: Final = frozenset({Signal.AXLE_WEIGHT, Signal.AIR_SPRING_PRESSURE, Signal.RIDE_HEIGHT})
"""Signals of the vehicle's own load sensors, which also report at a standstill: shown beside the estimates, and never
part of them.
"""

ASIDE: Final = JOURNEY | STATIC | {Signal.TRAILER}
"""Signals that neither begin nor extend a drive or a window: vehicles also send them at a standstill."""


class Why(StrEnum):
    """Why a batch gave no estimate. gateway.estimates.reasons says what to do about each."""

    NO_ESTIMATE_YET = "no_estimate_yet"
    NO_CALIBRATION = "no_calibration"
    TOO_SHORT = "too_short"
    GAP = "gap"
    CLOCK_STEP = "clock_step"
    TRAILER = "trailer"
    TOO_SLOW = "too_slow"
    TOO_FAST = "too_fast"
    SPEED_MISSING = "speed_missing"
    SPEED_FROZEN = "speed_frozen"
    SPEED_SPREAD = "speed_spread"
    SPEED_UNCALIBRATED = "speed_uncalibrated"
    ACCELERATION_MISSING = "acceleration_missing"
    ACCELERATION_STUCK = "acceleration_stuck"
    ACCELERATION_SATURATED = "acceleration_saturated"
    PITCH_RATE_MISSING = "pitch_rate_missing"
    PITCH_RATE_STUCK = "pitch_rate_stuck"
    PITCH_RATE_SATURATED = "pitch_rate_saturated"
    GRAVITY_MISSING = "gravity_missing"
    SENSOR_RATE_LOW = "sensor_rate_low"
    SAMPLE_RATE = "sample_rate"
    TIME_STAMPS = "time_stamps"
    OUT_OF_RANGE = "out_of_range"
    NOT_ENOUGH_EXCITATION = "not_enough_excitation"
    TOO_UNCERTAIN = "too_uncertain"
    AMBIGUOUS = "ambiguous"
    MODEL_MISFIT = "model_misfit"
    NO_SOLUTION = "no_solution"
    SENSOR_DISAGREEMENT = "sensor_disagreement"
    SENSOR_CHANGED = "sensor_changed"
    SENSOR_NOISY = "sensor_noisy"
    WRONG_SIGN = "wrong_sign"
    LOAD_CHANGED = "load_changed"


@dataclass(frozen=True, slots=True)
class Frames:
    """CAN data frames in order of arrival, as columns.

    t_ns (n,); can_id (n,) with EXTENDED_ID set for 29-bit identifiers; length (n,) in bytes;
    payload (n, width), width 8 or 64, bytes past ``length`` are zero.
    """

    t_ns: I64
    can_id: U32
    length: U8
    payload: U8

    def __len__(self) -> int:
        return len(self.t_ns)


@dataclass(frozen=True, slots=True)
class Motion:
    """Decoded samples in order of arrival: one row a frame, one column a signal, NaN if the frame does not contain it.

    t_ns (n,); columns (n, len(signals)) in SI and vehicle axes (ISO 8855), gravity included. counters: the message
    counter (n,) of the frames that carry a signal, if the signal map names one. aside (n,): rows of messages that carry
    only signals of ASIDE; None if there is no such message.
    """

    signals: tuple[Signal, ...]
    t_ns: I64
    columns: F64
    counters: Mapping[Signal, F64] = field(default_factory=dict)
    aside: Bool | None = None

    def __len__(self) -> int:
        return len(self.t_ns)

    def of(self, signal: Signal) -> tuple[I64, F64]:
        """Times (m,) and finite samples (m,) of one signal; both empty if it is not mapped."""
        if signal not in self.signals:
            return self.t_ns[:0], np.empty(0)
        column = self.columns[:, self.signals.index(signal)]
        known = np.isfinite(column)
        return self.t_ns[known], column[known]

    def counter_of(self, signal: Signal) -> I64 | None:
        """Message counters (m,) of the samples that ``of`` gives; None unless every sample has its own."""
        if signal not in self.signals or signal not in self.counters:
            return None
        known = np.isfinite(self.columns[:, self.signals.index(signal)])
        counter = self.counters[signal][known]
        return counter.astype(np.int64) if np.isfinite(counter).all() else None

    def rows(self, chosen: Bool | slice) -> "Motion":
        """The chosen rows, in their order."""
        counters = {signal: counter[chosen] for signal, counter in self.counters.items()}
        aside = None if self.aside is None else self.aside[chosen]
        return Motion(self.signals, self.t_ns[chosen], self.columns[chosen], counters, aside)

    @property
    def weighing(self) -> "Motion":
        """The rows without those of ASIDE, except those of a trailer: its signal weighs nothing but decides whether the
        vehicle can be weighed.
        """
        if self.aside is None:
            return self
        kept = ~self.aside
        if Signal.TRAILER in self.signals:
            kept |= np.isfinite(self.columns[:, self.signals.index(Signal.TRAILER)])
        return self.rows(kept)

    def part(self, begin: int, end: int) -> "Motion":
        """The rows ``begin`` to ``end`` (exclusive)."""
        return self.rows(slice(begin, end))


def joined(parts: Sequence[Motion]) -> Motion:
    """Concatenate motions of one signal map; at least one part."""
    first = parts[0]
    return Motion(
        first.signals,
        np.concatenate([part.t_ns for part in parts]),
        np.concatenate([part.columns for part in parts]),
        {signal: np.concatenate([part.counters[signal] for part in parts]) for signal in first.counters},
        None if first.aside is None else np.concatenate([part.aside for part in parts if part.aside is not None]),
    )


@dataclass(frozen=True, slots=True)
class SensorTraits:
    """The facts that the signal map and its DBC give about one signal. SI; NaN if the DBC does not say.

    If the map names a message counter, it counts modulo ``counter_modulus``.
    """

    latency_s: float = 0.0
    minimum: float = math.nan
    maximum: float = math.nan
    resolution: float = math.nan
    counter_modulus: int = 0


@dataclass(frozen=True, slots=True)
class Spectra:
    """Auto- and cross-spectra of one batch, for people to look at.

    freq_hz (m,); vertical_acceleration (m,) in m/s2/sqrt(Hz) and pitch_rate (m,) in rad/s/sqrt(Hz),
    both amplitude densities; coherence (m,) 0..1; phase_rad (m,) of pitch rate against acceleration.
    """

    freq_hz: F64
    vertical_acceleration: F64
    pitch_rate: F64
    coherence: F64
    phase_rad: F64


@dataclass(frozen=True, slots=True)
class Batch:
    """One window of a drive on a uniform grid, ready for any estimator.

    Arrays are (n,) at ``rate_hz`` from ``t_start_ns``; NaN if unknown. ``usable`` marks the samples that every gate
    accepts; no spectrum segment may cross a sample outside it. vertical_acceleration_mps2 has its mean over the usable
    samples removed (that mean is ``gravity_mps2``); pitch_rate_radps keeps its bias (segments are detrended).
    roll_rate_radps (positive left side up) keeps its bias too; it is None if the signal map has none, and neither masks
    nor rejects. ``shares`` says which part of the window each cause masked. ``rejected`` contains the reasons that
    apply to every estimator. ``sensor_rate_hz`` is the lower sending rate of accelerometer and gyro.
    ``gyro_gain`` is the gyro's gain over the accelerometer's as bends show it, and its standard deviation; None if
    nothing shows it.
    """

    t_start_ns: int
    t_end_ns: int
    drive_start_ns: int
    rate_hz: float
    vertical_acceleration_mps2: F64
    pitch_rate_radps: F64
    speed_mps: F64
    usable: Bool
    gravity_mps2: float
    gap_share: float
    shares: Mapping[Why, float]
    longest_stop_s: float = 0.0
    rejected: tuple[Why, ...] = ()
    is_provisional: bool = False
    roll_rate_radps: F64 | None = None
    sensor_rate_hz: float = math.nan
    gyro_gain: tuple[float, float] | None = None

    @property
    def duration_s(self) -> float:
        return (self.t_end_ns - self.t_start_ns) / NS_PER_S

    @property
    def usable_share(self) -> float:
        return float(np.mean(self.usable)) if self.usable.size else 0.0

    @property
    def usable_s(self) -> float:
        """Duration (s) of the usable samples together."""
        return float(np.count_nonzero(self.usable)) / self.rate_hz

    @property
    def roll_usable_share(self) -> float | None:
        """Share of the usable samples whose roll rate is known: 0 if the sensor failed, None if there is none."""
        if self.roll_rate_radps is None:
            return None
        known = np.isfinite(self.roll_rate_radps[self.usable])
        return float(np.mean(known)) if known.size else 0.0

    @property
    def mean_speed_mps(self) -> float:
        """Mean over the usable samples; if there are none, over the known samples; NaN if there are none either."""
        speed = self.speed_mps[self.usable] if self.usable.any() else self.speed_mps[np.isfinite(self.speed_mps)]
        return float(np.mean(speed)) if speed.size else math.nan


def iso_utc(t_ns: int) -> str:
    """2026-11-21T04:00:00.000000Z: microseconds, always UTC."""
    whole_us = t_ns // 1000
    stamp = datetime.fromtimestamp(whole_us // 1_000_000, UTC)
    return f"{stamp:%Y-%m-%dT%H:%M:%S}.{whole_us % 1_000_000:06d}Z"


def date_of(t_ns: int) -> str | None:
    """As :func:`iso_utc`; None before 1986, for such a stamp counts from something else."""
    return iso_utc(t_ns) if t_ns >= FIRST_DATED_NS else None


def ns_of(text: str) -> int:
    """The inverse of :func:`iso_utc`, to the microsecond."""
    return (datetime.fromisoformat(text) - _START) // timedelta(microseconds=1) * 1000


def rounded(x: float | None, digits: int) -> float | None:
    """A number for JSON: None if it is unknown (None, NaN or infinite)."""
    return None if x is None or not math.isfinite(x) else round(x, digits) + 0.0


def json_line(record: Mapping[str, Any]) -> str:
    """The record as compact JSON on one line: the text that is printed, stored and sent."""
    return json.dumps(record, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
