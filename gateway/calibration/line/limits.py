"""What a vehicle inherits from its line beside a prior: where it is believed, and how far its intervals are widened."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from statistics import fmean
from typing import Self

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.vehicle import Load


@dataclass(frozen=True, slots=True)
class Limits:
    """What runs, or siblings, left out showed; fields as in CrossSpectrumCalibration."""

    payload_inflation: float
    payload_inflation_per_reach: float
    front_share_inflation: float
    front_share_inflation_per_reach: float
    cg_left_inflation: float
    misfit_limit: float
    most_position_score: float
    most_noise_score: float

    @classmethod
    def of(cls, calibration: CrossSpectrumCalibration) -> Self:
        """Those of one vehicle."""
        return cls(**{one.name: getattr(calibration, one.name) for one in fields(cls)})

    @classmethod
    def widest(cls, limits: Sequence["Limits"]) -> Self:
        """Of several, each as wide as the widest."""
        return cls(**{one.name: max(getattr(each, one.name) for each in limits) for one in fields(cls)})

    def on(self, calibration: CrossSpectrumCalibration, *, is_tested: bool) -> CrossSpectrumCalibration:
        """``calibration`` with these in place of what nobody tested; of what was, the wider.

        How badly it fits its own runs is always seen.
        """
        own = Limits.of(calibration)
        widest = Limits.widest([self, own])
        limits = widest if is_tested else replace(self, misfit_limit=widest.misfit_limit)
        return replace(calibration, **asdict(limits))


@dataclass(frozen=True, slots=True)
class Seen:
    """Over which loads, speeds and roads a half-car was fitted; fields as in CrossSpectrumCalibration."""

    payload_seen_kg: tuple[float, float]
    front_share_seen_pct: tuple[float, float]
    speed_seen_mps: tuple[float, float]
    acceleration_rms_mps2: float
    pitch_rate_rms_radps: float
    known_loads: tuple[Load, ...]

    @classmethod
    def of(cls, calibration: CrossSpectrumCalibration) -> Self:
        """What one vehicle saw."""
        return cls(**{one.name: getattr(calibration, one.name) for one in fields(cls)})

    @classmethod
    def together(cls, seen: Sequence["Seen"]) -> Self:
        """What several saw; their movement is the mean of theirs."""
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
        """``calibration`` believed over these too; what is usual is what these say."""
        both = Seen.together([self, Seen.of(calibration)])
        usual = {"acceleration_rms_mps2": self.acceleration_rms_mps2, "pitch_rate_rms_radps": self.pitch_rate_rms_radps}
        wider = {one.name: getattr(both, one.name) for one in fields(Seen)} | usual
        return replace(calibration, **wider)


def _hull(spans: Sequence[tuple[float, float]]) -> tuple[float, float]:
    return min(low for low, _ in spans), max(high for _, high in spans)
