"""What a calibration file found out, as figures with a standard deviation, in the units their names end in."""

import math
from dataclasses import dataclass

import numpy as np

from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.file.parts import CrossSpectrumPart, RegressionPart
from gateway.core.cross_spectrum.model.parameters import is_positive


@dataclass(frozen=True, slots=True)
class Figure:
    """One parameter with its posterior standard deviation.

    A positive quantity was fitted by its logarithm, and is compared on that scale.
    """

    name: str
    centre: float
    std: float
    is_positive: bool = False

    def distance(self, other: "Figure") -> float:
        """How far apart two such figures are, in standard deviations of their difference; inf where both are exact."""
        if self.is_positive and other.is_positive:
            apart = math.log(self.centre / other.centre)
            combined = math.hypot(self.std / self.centre, other.std / other.centre)
        else:
            apart, combined = self.centre - other.centre, math.hypot(self.std, other.std)
        if apart == 0.0:
            return 0.0
        return abs(apart) / combined if combined > 0.0 else math.inf


def figures_of(file: CalibrationFile) -> dict[str, tuple[Figure, ...]]:
    """By part of the file: half-car parameters of cross_spectrum, regressions of ratio_index (constant first)."""
    figures = {}
    if file.cross_spectrum is not None:
        figures["cross_spectrum"] = _half_car(file.cross_spectrum)
    if file.ratio_index is not None:
        for target in ("payload", "front_share"):
            model = getattr(file.ratio_index, target)
            if model is not None:
                figures[f"ratio_index.{target}"] = _regression(model)
    return figures


def _half_car(part: CrossSpectrumPart) -> tuple[Figure, ...]:
    """A parameter held as a logarithm comes with its standard deviation of first order."""
    stds = np.sqrt(np.diag(part.covariance))
    figures = []
    for name, entry, std in zip(part.names, part.parameters.tolist(), stds.tolist(), strict=True):
        scale = math.exp(entry) if is_positive(name) else 1.0
        figures.append(Figure(name, scale if is_positive(name) else entry, scale * std, is_positive(name)))
    return tuple(figures)


def _regression(part: RegressionPart) -> tuple[Figure, ...]:
    """Constant and coefficients of the terms as they are, in the target's unit: comparable whatever the scaling.

    The file has them of columns scaled to [-1, 1] by lows l and highs h:
    b_0 + sum b_i (2 x_i - h_i - l_i) / (h_i - l_i). With T for the step from these b to those of x,
    Var = s^2 T (X'X)^-1 T'.
    """
    span = part.highs - part.lows
    to_raw = np.diag(np.r_[1.0, 2.0 / span])
    to_raw[0, 1:] = -(part.highs + part.lows) / span
    centres = to_raw @ part.coefficients
    stds = part.residual_std * np.sqrt(np.diag(to_raw @ part.gram_inverse @ to_raw.T))
    rows = zip(("constant", *part.terms), centres.tolist(), stds.tolist(), strict=True)
    return tuple(Figure(name, centre, std) for name, centre, std in rows)
