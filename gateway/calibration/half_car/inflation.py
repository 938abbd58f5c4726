"""How far intervals must be widened to be true of loads that calibration has not seen: what left-out runs show."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.records import F64

LEAST: Final = 1.25  # roads and kinds of driving that no run holds cannot be left out
UNTESTED: Final = 1.5  # where no run can be left out, or none that lies among the others
LEAST_BATCHES_WITHIN: Final = 3
GAUSS_90: Final = 1.645


@dataclass(frozen=True, slots=True)
class Inflation:
    """Factor on a standard deviation: ``within`` the known loads, and 1 + ``per_reach`` x reach times that beyond.

    Reach is core.reach.beyond, in parts of the empty sprung mass.
    """

    within: float
    per_reach: float


def inflation_of(z: F64, reach: F64) -> Inflation:
    """From errors of left-out batches ``z`` (n,) in their own standard deviations, and how far out each lay (n,).

    A left-out run among the others shows how well known loads interpolate, one at the edge how fast the
    model errs beyond them; taken together, the second would widen the intervals of the first many times.
    Either is read at the 90 % point, held against a Gaussian's, so that a single batch does not decide.
    """
    is_within = reach <= 0.0
    within = UNTESTED
    if np.count_nonzero(is_within) >= LEAST_BATCHES_WITHIN:
        within = max(LEAST, _at_90(np.abs(z[is_within])) / GAUSS_90)
    if np.all(is_within):
        return Inflation(within, 0.0)
    growth = (np.abs(z[~is_within]) / (GAUSS_90 * within) - 1.0) / reach[~is_within]
    return Inflation(within, max(0.0, _at_90(growth)))


def of_places(z: F64) -> float:
    """Factor on the standard deviation of where loads lie sideways, from errors ``z`` (n,) of left-out batches."""
    if len(z) < LEAST_BATCHES_WITHIN:
        return LEAST
    return max(LEAST, _at_90(np.abs(z)) / GAUSS_90)


def _at_90(x: F64) -> float:
    return float(np.quantile(x, 0.9))
