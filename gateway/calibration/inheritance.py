"""The parts of a calibration that a sister inherits besides its parameters: ranges, limits, usual movement."""

from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple, Self

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.vehicle import Load


@dataclass(frozen=True, slots=True)
class Seen:
    """Loads, speeds and roads of the fit; fields as in CrossSpectrumCalibration."""

    payload_seen_kg: tuple[float, float]
    front_share_seen_pct: tuple[float, float]
    speed_seen_mps: tuple[float, float]
    acceleration_rms_mps2: float
    pitch_rate_rms_radps: float
    known_loads: tuple[Load, ...]

    @classmethod
    def of(cls, calibration: CrossSpectrumCalibration) -> Self:
        """The ranges that one vehicle's drives covered."""
        return cls(**{one.name: getattr(calibration, one.name) for one in fields(cls)})

    def on(self, calibration: CrossSpectrumCalibration) -> CrossSpectrumCalibration:
        """``calibration``, valid over these ranges too; the usual movement is theirs."""
        loads = {(one.payload_kg, one.front_share_pct) for one in (*self.known_loads, *calibration.known_loads)}
        return replace(
            calibration,
            payload_seen_kg=_hull(self.payload_seen_kg, calibration.payload_seen_kg),
            front_share_seen_pct=_hull(self.front_share_seen_pct, calibration.front_share_seen_pct),
            speed_seen_mps=_hull(self.speed_seen_mps, calibration.speed_seen_mps),
            acceleration_rms_mps2=self.acceleration_rms_mps2,
            pitch_rate_rms_radps=self.pitch_rate_rms_radps,
            known_loads=tuple(Load(*load) for load in sorted(loads)),
        )


def _hull(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    return min(one[0], other[0]), max(one[1], other[1])


@dataclass(frozen=True, slots=True)
class ModelLimits:
    """Results of runs left out; fields as in CrossSpectrumCalibration."""

    model_std: tuple[float, float, float]
    model_per_reach: tuple[float, float]
    misfit_limit: float
    most_position_score: float
    most_noise_score: float

    @classmethod
    def of(cls, calibration: CrossSpectrumCalibration) -> Self:
        """Those of one vehicle."""
        return cls(**{one.name: getattr(calibration, one.name) for one in fields(cls)})

    def on(self, calibration: CrossSpectrumCalibration, *, is_tested: bool) -> CrossSpectrumCalibration:
        """``calibration`` with these in place of untested limits; of tested ones, the wider.

        Its misfit on its own runs is always known.
        """
        own = ModelLimits.of(calibration)
        pairs = {one.name: (getattr(self, one.name), getattr(own, one.name)) for one in fields(self)}
        widest = ModelLimits(**{name: _widest(*pair) for name, pair in pairs.items()})
        limits = widest if is_tested else replace(self, misfit_limit=widest.misfit_limit)
        return replace(calibration, **{one.name: getattr(limits, one.name) for one in fields(limits)})


def _widest(one: Any, other: Any) -> Any:
    """The larger number, or the larger of each place of tuples."""
    if isinstance(one, tuple):
        return tuple(map(max, one, other))
    return max(one, other)


class Usual(NamedTuple):
    """The usual movement of a vehicle (core.cross_spectrum.model.reading): friction shares refer to it.

    The usual stroke speed of the springs of front and rear axle is None if no roll rate was read.
    """

    log_amplitude: float
    stroke_mps: tuple[float, float] | None = None
