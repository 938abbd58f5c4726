"""How far intervals are widened, and what misfit is still believed: what was left out of a fit shows it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Self

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration


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
