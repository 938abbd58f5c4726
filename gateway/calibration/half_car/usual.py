"""How much a vehicle usually moves: friction shares are told at that amplitude."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Self

import numpy as np


@dataclass(frozen=True, slots=True)
class Usual:
    """Of one vehicle or of a line, as core.cross_spectrum.model.reading.Reading has it; None: nobody worked it out."""

    log_amplitude: float
    stroke_mps: tuple[float, float] | None = None

    @classmethod
    def mean(cls, several: Sequence["Usual"]) -> Self:
        """The mean of their logarithms; of how fast axles stroke, that of those that say so."""
        log_strokes = [np.log(one.stroke_mps) for one in several if one.stroke_mps is not None]
        stroke_mps = None
        if log_strokes:
            front_mps, rear_mps = np.exp(np.mean(log_strokes, axis=0)).tolist()
            stroke_mps = (front_mps, rear_mps)
        return cls(fmean(one.log_amplitude for one in several), stroke_mps)

    def log_over(self, other: "Usual") -> tuple[float, float]:
        """How much more than ``other`` front and rear axle move; both as the body, where either says no more."""
        if self.stroke_mps is None or other.stroke_mps is None:
            both = self.log_amplitude - other.log_amplitude
            return both, both
        front, rear = np.log(self.stroke_mps) - np.log(other.stroke_mps)
        return float(front), float(rear)
