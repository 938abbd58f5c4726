"""The parts of a calibration that other vehicles of the line inherit: its ranges, its limits, its usual movement."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from statistics import fmean
from typing import Any, Final, Self

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration, NonNegative, Positive
from gateway.core.vehicle import Load
from gateway.schema import STRICT, described

_POSITIVE: Final = {"gt": 0.0}


@dataclass(frozen=True, slots=True)
class Seen:
    """Loads, speeds and roads of the fit; fields as in CrossSpectrumCalibration."""

    __pydantic_config__ = STRICT

    payload_seen_kg: tuple[float, float]
    front_share_seen_pct: tuple[float, float]
    speed_seen_mps: tuple[float, float]
    acceleration_rms_mps2: float = field(metadata=_POSITIVE)
    pitch_rate_rms_radps: float = field(metadata=_POSITIVE)
    known_loads: tuple[Load, ...]

    @classmethod
    def of(cls, calibration: CrossSpectrumCalibration) -> Self:
        """The ranges that one vehicle's drives covered."""
        return cls(**{one.name: getattr(calibration, one.name) for one in fields(cls)})

    @classmethod
    def together(cls, seen: Sequence["Seen"]) -> Self:
        """The union of several ranges; their movement is the mean of theirs."""
        loads = {(load.payload_kg, load.front_share_pct) for each in seen for load in each.known_loads}
        return cls(
            payload_seen_kg=_hull([each.payload_seen_kg for each in seen]),
            front_share_seen_pct=_hull([each.front_share_seen_pct for each in seen]),
            speed_seen_mps=_hull([each.speed_seen_mps for each in seen]),
            acceleration_rms_mps2=fmean(each.acceleration_rms_mps2 for each in seen),
            pitch_rate_rms_radps=fmean(each.pitch_rate_rms_radps for each in seen),
            known_loads=tuple(Load(*load) for load in sorted(loads)),
        )

    def on(self, calibration: CrossSpectrumCalibration) -> CrossSpectrumCalibration:
        """``calibration``, valid over these too; the usual movement is theirs."""
        both = Seen.together([self, Seen.of(calibration)])
        usual = {"acceleration_rms_mps2": self.acceleration_rms_mps2, "pitch_rate_rms_radps": self.pitch_rate_rms_radps}
        wider = {one.name: getattr(both, one.name) for one in fields(Seen)} | usual
        return replace(calibration, **wider)


def _hull(spans: Sequence[tuple[float, float]]) -> tuple[float, float]:
    return min(low for low, _ in spans), max(high for _, high in spans)


@dataclass(frozen=True, slots=True)
class ModelLimits:
    """Results of runs, or siblings, left out; fields as in CrossSpectrumCalibration."""

    __pydantic_config__ = STRICT

    model_std: tuple[NonNegative, NonNegative, NonNegative]
    model_per_reach: tuple[NonNegative, NonNegative]
    misfit_limit: float = field(metadata=_POSITIVE)
    most_position_score: float = field(metadata=_POSITIVE)
    most_noise_score: float = field(metadata=_POSITIVE)

    @classmethod
    def of(cls, calibration: CrossSpectrumCalibration) -> Self:
        """Those of one vehicle."""
        return cls(**{one.name: getattr(calibration, one.name) for one in fields(cls)})

    @classmethod
    def widest(cls, limits: Sequence["ModelLimits"]) -> Self:
        """Of several, each as wide as the widest."""
        return cls(**{one.name: _widest([getattr(each, one.name) for each in limits]) for one in fields(cls)})

    def on(self, calibration: CrossSpectrumCalibration, *, is_tested: bool) -> CrossSpectrumCalibration:
        """``calibration`` with these in place of untested limits; of tested ones, the wider.

        Its misfit on its own runs is always known.
        """
        own = ModelLimits.of(calibration)
        widest = ModelLimits.widest([self, own])
        limits = widest if is_tested else replace(self, misfit_limit=widest.misfit_limit)
        return replace(calibration, **{one.name: getattr(limits, one.name) for one in fields(limits)})


def _widest(several: Sequence[Any]) -> Any:
    """The largest number, or the largest of each place of tuples."""
    if isinstance(several[0], tuple):
        return tuple(max(place) for place in zip(*several, strict=True))
    return max(several)


@dataclass(frozen=True, slots=True)
class Usual:
    """The usual movement of a vehicle or a line (core.cross_spectrum.model.reading): friction shares refer to it."""

    __pydantic_config__ = STRICT

    log_amplitude: float
    stroke_mps: tuple[Positive, Positive] | None = field(
        default=None,
        metadata=described("usual stroke speed of the springs of front and rear axle; null: no roll rate was read"),
    )

    @classmethod
    def mean(cls, several: Sequence["Usual"]) -> Self:
        """The mean of their logarithms; for stroke speeds, of those that have them."""
        log_strokes = [np.log(one.stroke_mps) for one in several if one.stroke_mps is not None]
        stroke_mps = None
        if log_strokes:
            front_mps, rear_mps = np.exp(np.mean(log_strokes, axis=0)).tolist()
            stroke_mps = (front_mps, rear_mps)
        return cls(fmean(one.log_amplitude for one in several), stroke_mps)

    def log_over(self, other: "Usual") -> tuple[float, float]:
        """Movement of front and rear axle relative to ``other``; that of the body for both, if either has no more."""
        if self.stroke_mps is None or other.stroke_mps is None:
            both = self.log_amplitude - other.log_amplitude
            return both, both
        front, rear = np.log(self.stroke_mps) - np.log(other.stroke_mps)
        return float(front), float(rear)
