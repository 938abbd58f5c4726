"""Over which loads, speeds and roads the vehicles of a line were driven: a vehicle is believed where its line was."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from statistics import fmean
from typing import Self

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.vehicle import Load


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
