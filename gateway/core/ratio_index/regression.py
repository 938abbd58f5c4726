"""Static regression of a target on the two ratio indexes: the terms, and prediction with its spread."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from gateway.core.late import special
from gateway.metadata import STRICT, check_shapes
from gateway.records import F64

Term = Callable[[F64, F64], F64]

# The arguments are raw R > 0; columns are scaled to [-1, 1] afterwards. Calibration files use these names:
# terms may be added, but none may change its meaning.
TERMS: Mapping[str, Term] = MappingProxyType(
    {
        "cbrt_ra": lambda ra, rg: np.cbrt(ra),
        "sqrt_ra": lambda ra, rg: np.sqrt(ra),
        "ra": lambda ra, rg: ra,
        "ra2": lambda ra, rg: ra**2,
        "log_ra": lambda ra, rg: np.log(ra),
        "cbrt_rg": lambda ra, rg: np.cbrt(rg),
        "sqrt_rg": lambda ra, rg: np.sqrt(rg),
        "rg": lambda ra, rg: rg,
        "log_rg": lambda ra, rg: np.log(rg),
        "ra_rg": lambda ra, rg: ra * rg,
    }
)

# the paper's structures, each with a constant term in addition
MODEL_9_PAYLOAD = ("cbrt_ra",)
MODEL_10_FRONT_SHARE = ("cbrt_rg", "sqrt_rg")
MODEL_11_PAYLOAD = ("cbrt_ra", "cbrt_rg", "sqrt_ra", "ra_rg")
MODEL_11_FRONT_SHARE = ("cbrt_rg", "rg", "ra2")


@dataclass(frozen=True, slots=True)
class RegressionModel:
    """target = coefficients . [1, scaled terms], with all that prediction and its standard deviation need.

    lows and highs (p,) scale each term to [-1, 1]; coefficients (p + 1,), constant first; gram_inverse (p + 1, p + 1)
    is (X'X)^-1 of the scaled columns; residual_std is in the target's unit; dof are its degrees of freedom.
    """

    __pydantic_config__ = STRICT

    terms: tuple[str, ...]
    lows: F64
    highs: F64
    coefficients: F64
    gram_inverse: F64
    residual_std: float = field(metadata={"gt": 0.0})
    dof: float = field(metadata={"gt": 0.0})

    def __post_init__(self) -> None:
        n = len(self.terms)
        check_shapes(
            lows=(self.lows, (n,)),
            highs=(self.highs, (n,)),
            coefficients=(self.coefficients, (n + 1,)),
            gram_inverse=(self.gram_inverse, (n + 1, n + 1)),
        )

    def predict(self, ra: float, rg: float) -> tuple[float, float, tuple[float, float]]:
        """Value, standard deviation of a new observation, and its 95 % interval (Student's t)."""
        row = scaled_columns(self.terms, np.array([ra]), np.array([rg]), self.lows, self.highs)[0]
        centre = float(row @ self.coefficients)
        std = self.residual_std * float(np.sqrt(1.0 + row @ self.gram_inverse @ row))
        half = float(special.stdtrit(self.dof, 0.975)) * std
        return centre, std, (centre - half, centre + half)

    def extrapolates(self, ra: float, rg: float, margin: float) -> bool:
        """True if a term is outside its calibrated range by more than ``margin``, a share of its span."""
        scaled = scaled_columns(self.terms, np.array([ra]), np.array([rg]), self.lows, self.highs)[0, 1:]
        return not bool(np.all(np.abs(scaled) <= 1.0 + 2.0 * margin))


def term_columns(terms: tuple[str, ...], ra: F64, rg: F64) -> F64:
    """Raw columns (..., n, p) of the named terms for indexes (..., n)."""
    return np.stack([TERMS[name](ra, rg) for name in terms], axis=-1)


def scaled_columns(terms: tuple[str, ...], ra: F64, rg: F64, lows: F64, highs: F64) -> F64:
    """Design matrix (..., n, p + 1): a column of ones, then each term scaled so that lows..highs is -1..1."""
    scaled = 2.0 * (term_columns(terms, ra, rg) - lows) / (highs - lows) - 1.0
    return np.concatenate([np.ones((*scaled.shape[:-1], 1)), scaled], axis=-1)
