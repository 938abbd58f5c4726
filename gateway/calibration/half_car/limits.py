"""How large the model's own error is, and what misfit is still believed: what was left out of a fit shows it."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration


@dataclass(frozen=True, slots=True)
class Limits:
    """What runs, or siblings, left out showed; fields as in CrossSpectrumCalibration."""

    model_std: tuple[float, float, float]
    model_per_reach: tuple[float, float]
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
        return cls(**{one.name: _widest([getattr(each, one.name) for each in limits]) for one in fields(cls)})

    def on(self, calibration: CrossSpectrumCalibration, *, is_tested: bool) -> CrossSpectrumCalibration:
        """``calibration`` with these in place of what nobody tested; of what was, the wider.

        How badly it fits its own runs is always seen.
        """
        own = Limits.of(calibration)
        widest = Limits.widest([self, own])
        limits = widest if is_tested else replace(self, misfit_limit=widest.misfit_limit)
        return replace(calibration, **{one.name: getattr(limits, one.name) for one in fields(limits)})


def _widest(several: Sequence[Any]) -> Any:
    """The largest number, or the largest of each place of tuples."""
    if isinstance(several[0], tuple):
        return tuple(max(place) for place in zip(*several, strict=True))
    return max(several)
