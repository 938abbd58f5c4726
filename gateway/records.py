"""All that crosses rooms: frames, motion, batches, estimates and the reasons why not.

Plain immutable values. Arrays are numpy, SI throughout, unknown is NaN. Time is the frame's own,
integer nanoseconds since 1970-01-01 UTC.
"""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gateway.units import NS_PER_S

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
U32 = NDArray[np.uint32]
U8 = NDArray[np.uint8]
Bool = NDArray[np.bool_]
C128 = NDArray[np.complex128]

EXTENDED_ID: Final = 0x8000_0000  # CAN_EFF_FLAG of SocketCAN: a 29-bit identifier


class Signal(StrEnum):
    """What we can read from a bus. The first three are needed, the others are welcome."""

    VERTICAL_ACCELERATION = "vertical_acceleration"
    PITCH_RATE = "pitch_rate"
    SPEED = "speed"
    LONGITUDINAL_ACCELERATION = "longitudinal_acceleration"
    WHEEL_SPEED = "wheel_speed"
    IGNITION = "ignition"
    AMBIENT_TEMPERATURE = "ambient_temperature"
    AXLE_WEIGHT = "axle_weight"


class Why(StrEnum):
    """Why a batch gave no estimate. gateway.reasons tells what each asks of a person."""

    NO_ESTIMATE_YET = "no_estimate_yet"
    NO_CALIBRATION = "no_calibration"
    TOO_SHORT = "too_short"
    GAP = "gap"
    CLOCK_STEP = "clock_step"
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
    OUT_OF_RANGE = "out_of_range"
    NOT_ENOUGH_EXCITATION = "not_enough_excitation"
    TOO_UNCERTAIN = "too_uncertain"
    MODEL_MISFIT = "model_misfit"
    SENSOR_DISAGREEMENT = "sensor_disagreement"
    WRONG_SIGN = "wrong_sign"


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
    """Decoded samples in order of arrival: one row a frame, one column a signal, NaN where it says nothing.

    t_ns (n,); columns (n, len(signals)) in SI and vehicle axes (ISO 8855), gravity still in.
    """

    signals: tuple[Signal, ...]
    t_ns: I64
    columns: F64

    def __len__(self) -> int:
        return len(self.t_ns)

    def of(self, signal: Signal) -> tuple[I64, F64]:
        """Times (m,) and finite samples (m,) of one signal; both empty where it is not mapped."""
        if signal not in self.signals:
            return self.t_ns[:0], np.empty(0)
        column = self.columns[:, self.signals.index(signal)]
        known = np.isfinite(column)
        return self.t_ns[known], column[known]

    def part(self, begin: int, end: int) -> "Motion":
        """Rows begin to end (exclusive)."""
        return Motion(self.signals, self.t_ns[begin:end], self.columns[begin:end])


@dataclass(frozen=True, slots=True)
class SensorTraits:
    """What the signal map and its DBC tell of one signal. SI; NaN where the DBC does not say."""

    latency_s: float = 0.0
    minimum: float = math.nan
    maximum: float = math.nan
    resolution: float = math.nan


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

    Arrays are (n,) at ``rate_hz`` from ``t_start_ns``; NaN where unknown. ``usable`` marks the
    samples that every gate lets through; no spectrum segment may cross a sample outside it.
    vertical_acceleration_mps2 has its mean over the usable samples removed (that mean is
    ``gravity_mps2``); pitch_rate_radps keeps its bias (segments are detrended).
    ``shares`` tells which part of the window each cause masked. ``rejected`` holds the reasons
    that no estimator can mend.
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
    longitudinal_acceleration_mps2: F64 | None = None

    @property
    def duration_s(self) -> float:
        return (self.t_end_ns - self.t_start_ns) / NS_PER_S

    @property
    def usable_share(self) -> float:
        return float(np.mean(self.usable)) if self.usable.size else 0.0

    @property
    def mean_speed_mps(self) -> float:
        """Mean over the usable samples; where there are none, over what is known; NaN if nothing is."""
        speed = self.speed_mps[self.usable] if self.usable.any() else self.speed_mps[np.isfinite(self.speed_mps)]
        return float(np.mean(speed)) if speed.size else math.nan


@dataclass(frozen=True, slots=True)
class Estimate:
    """What a batch taught: payload and front share, or why nothing. Unknown is NaN (null in JSON).

    payload_kg and its standard deviation; front_share_pct is the share of the sprung mass on the
    front axle, standard deviation in percentage points; intervals are 95 %.
    """

    t_start_ns: int
    t_end_ns: int
    estimator: str
    calibration_id: str | None = None
    payload_kg: float = math.nan
    payload_std_kg: float = math.nan
    payload_interval95_kg: tuple[float, float] = (math.nan, math.nan)
    front_share_pct: float = math.nan
    front_share_std_pct: float = math.nan
    front_share_interval95_pct: tuple[float, float] = (math.nan, math.nan)
    ratio_index_acceleration: float = math.nan
    ratio_index_pitch_rate: float = math.nan
    mean_speed_mps: float = math.nan
    gap_share: float = math.nan
    usable_share: float = math.nan
    roughness_mps2: float = math.nan  # of the road (core.spectrum)
    shares: Mapping[str, float] = field(default_factory=dict)
    rejected: tuple[Why, ...] = ()
    is_provisional: bool = False
    spectra: Spectra | None = None
    diagnostics: Mapping[str, float] = field(default_factory=dict)
    epoch: Mapping[str, float] = field(default_factory=dict)
    tare: Mapping[str, float | str] = field(default_factory=dict)  # the zero taken off, and what was raw (core.tare)
    vehicle_id: str | None = None
    vin: str | None = None

    @property
    def counted(self) -> bool:
        """True where the batch gave an answer."""
        return not self.rejected

    @property
    def id(self) -> str:
        """The same batch, vehicle, estimator, calibration and tare have the same id, whenever it is computed."""
        parts: tuple[object, ...] = (self.vehicle_id, self.t_start_ns, self.t_end_ns, self.estimator)
        parts += (self.calibration_id, *((self.tare["tare_id"],) if self.tare else ()))
        digest = hashlib.sha256("|".join(map(str, parts)).encode()).hexdigest()
        return f"{self.t_end_ns}-{digest[:12]}"


def iso_utc(t_ns: int) -> str:
    """2026-11-21T04:00:00.000000Z: microseconds, always UTC."""
    whole_us = t_ns // 1000
    stamp = datetime.fromtimestamp(whole_us // 1_000_000, UTC)
    return f"{stamp:%Y-%m-%dT%H:%M:%S}.{whole_us % 1_000_000:06d}Z"


def _number(x: float, digits: int) -> float | None:
    return float(f"{x:.{digits}g}") if math.isfinite(x) else None


def _numbers(x: F64, digits: int) -> list[float | None]:
    return [_number(float(v), digits) for v in x]


def estimate_to_json(estimate: Estimate) -> dict[str, Any]:
    """The one JSON object of an estimate: command line, store and HTTP all show this."""
    e = estimate
    record: dict[str, Any] = {
        "id": e.id,
        "vehicle_id": e.vehicle_id,
        "t_start": iso_utc(e.t_start_ns),
        "t_end": iso_utc(e.t_end_ns),
        "t_end_ns": e.t_end_ns,
        "estimator": e.estimator,
        "calibration_id": e.calibration_id,
        "payload_kg": _number(e.payload_kg, 9),
        "payload_std_kg": _number(e.payload_std_kg, 9),
        "payload_interval95_kg": _interval(e.payload_interval95_kg),
        "front_share_pct": _number(e.front_share_pct, 9),
        "front_share_std_pct": _number(e.front_share_std_pct, 9),
        "front_share_interval95_pct": _interval(e.front_share_interval95_pct),
        "ratio_index_acceleration": _number(e.ratio_index_acceleration, 9),
        "ratio_index_pitch_rate": _number(e.ratio_index_pitch_rate, 9),
        "mean_speed_mps": _number(e.mean_speed_mps, 9),
        "gap_share": _number(e.gap_share, 9),
        "usable_share": _number(e.usable_share, 9),
        "roughness_mps2": _number(e.roughness_mps2, 6),
        "shares": {str(why): _number(share, 6) for why, share in e.shares.items()},
        "rejected": [str(why) for why in e.rejected],
        "diagnostics": {name: _number(x, 6) for name, x in e.diagnostics.items()},
    }
    record.update({f"epoch_{name}": _number(x, 9) for name, x in e.epoch.items()})
    record.update({name: x if isinstance(x, str) else _number(x, 9) for name, x in e.tare.items()})
    if e.vin is not None:
        record["vin"] = e.vin
    if e.is_provisional:
        record["provisional"] = True
    if e.spectra is not None:
        record["spectra"] = spectra_to_json(e.spectra)
    return record


def spectra_to_json(spectra: Spectra) -> dict[str, list[float | None]]:
    """The JSON object of spectra: names with units, unknown is None."""
    return {
        "freq_hz": _numbers(spectra.freq_hz, 6),
        "vertical_acceleration_mps2_rthz": _numbers(spectra.vertical_acceleration, 5),
        "pitch_rate_radps_rthz": _numbers(spectra.pitch_rate, 5),
        "coherence": _numbers(spectra.coherence, 5),
        "phase_rad": _numbers(spectra.phase_rad, 5),
    }


def spectra_from_json(told: Mapping[str, Sequence[float | None]]) -> Spectra:
    """The inverse of :func:`spectra_to_json`, as exact as that rounds."""
    names = spectra_to_json(Spectra(*[np.empty(0)] * 5))
    return Spectra(*(np.array([math.nan if x is None else x for x in told[name]]) for name in names))


def json_line(record: Mapping[str, Any]) -> str:
    """The record as compact JSON on one line: the text that is printed, stored and sent."""
    return json.dumps(record, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def _interval(bounds: tuple[float, float]) -> list[float] | None:
    low, high = (_number(b, 9) for b in bounds)
    return None if low is None or high is None else [low, high]
