"""The probability that the load changed between two groups of batches, and the size of the change.

Errors that batches of one load share do not hide a change (gateway.estimates.posterior). So without a change the
difference x of two groups, in payload, front share and lateral place, is N(0, V0), V0 being the covariance of their own
errors. With a change of d kg, d ~ N(0, s^2), the payload differs by d, and the moved goods shift the centre of gravity
by g_f d and g_y d, at an unknown place. So x ~ N((d, 0, 0), V1 + diag(0, (g_f d)^2, (g_y d)^2)), V1 being the
covariance of the difference of two loads. The Bayes factor is the ratio of the densities,

    B = int N(d; 0, s^2) N(x; (d, 0, 0), V(d)) dd / N(x; 0, V0),

and the probability of a change is p B / (1 - p + p B) with the prior probability p (Kass & Raftery, Bayes factors, J.
Am. Stat. Assoc. 90 (1995) 773-795, equations 1 and 2).
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.vehicle import Vehicle
from gateway.estimates.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD, Posterior, difference
from gateway.estimates.quantity import Quantity
from gateway.records import F64

SPREAD_SHARE: Final = 0.25  # chosen: of the payload range, standard deviation of the change at a stop
PLACE_ALONG_SHARE: Final = 0.3  # chosen: of the wheelbase, standard deviation of the moved goods' place
PLACE_ACROSS_M: Final = 0.3  # chosen: likewise across, within the body's width
LEAST_RANGE_KG: Final = 100.0  # chosen: a narrower payload range is not what the vehicle can carry
ROLLING: Final = 0.001  # chosen: prior probability of a change between two batches without a stop
EVEN: Final = 0.5  # more likely than not
_NODES: Final = np.linspace(-6.0, 6.0, 241)  # standard deviations about the difference found
_STEP: Final = float(_NODES[1] - _NODES[0])


@dataclass(frozen=True, slots=True)
class Rules:
    """The scale of load changes and the vehicle's mass, from its size."""

    range_kg: float = 1000.0
    mass_kg: float = 2000.0

    @classmethod
    def of(cls, vehicle: Vehicle) -> "Rules":
        """The scale of load changes that a vehicle's payload range and mass give."""
        low, high = vehicle.payload_range_kg
        return cls(max(high - low, LEAST_RANGE_KG), vehicle.empty_mass_kg + 0.5 * (low + high))

    @property
    def spread_kg(self) -> float:
        return SPREAD_SHARE * self.range_kg


def probability(before: Posterior, after: Posterior, prior: float, rules: Rules) -> float:
    """The probability, 0 to 1, that the load changed between two groups; ``prior`` is the probability before weighing.

    It adds logarithms of odds: after several short stops the prior rounds to 1, and its odds are infinite.
    """
    with np.errstate(divide="ignore"):
        log_odds = np.log(prior) - np.log1p(-prior) + _log_bayes_factor(before, after, rules)
    return float(np.exp(-np.logaddexp(0.0, -log_odds)))


def change_of(before: Posterior, after: Posterior) -> Quantity:
    """The change of payload in kg, given that the two are different loads."""
    mean, covariance = difference(before, after, is_one_load=False)
    return Quantity.normal(float(mean[PAYLOAD]), math.sqrt(float(covariance[PAYLOAD, PAYLOAD])))


def _log_bayes_factor(before: Posterior, after: Posterior, rules: Rules) -> float:
    x, unchanged = difference(before, after, is_one_load=True)
    _, changed = difference(before, after, is_one_load=False)
    d = x[PAYLOAD] + math.sqrt(changed[PAYLOAD, PAYLOAD]) * _NODES
    covariances = np.repeat(changed[None], len(d), axis=0)
    for i, by_kg in ((FRONT_SHARE, 100.0 * PLACE_ALONG_SHARE), (CG_LEFT, PLACE_ACROSS_M)):
        if i < len(x):
            covariances[:, i, i] += (by_kg / rules.mass_kg * d) ** 2
    off = np.repeat(x[None], len(d), axis=0)
    off[:, PAYLOAD] -= d
    of_change = _log_normal(d[:, None], np.full((len(d), 1, 1), rules.spread_kg**2))
    log_step = math.log(_STEP) + 0.5 * math.log(changed[PAYLOAD, PAYLOAD])
    with_change = np.logaddexp.reduce(of_change + _log_normal(off, covariances) + log_step)
    return float(with_change - _log_normal(x[None], unchanged[None])[0])


def _log_normal(x: F64, covariance: F64) -> F64:
    """(m,) log densities of N(0, covariance (m, d, d)) at x (m, d)."""
    _, log_determinant = np.linalg.slogdet(2.0 * math.pi * covariance)
    scaled = np.linalg.solve(covariance, x[..., None])[..., 0]
    logs: F64 = -0.5 * (np.sum(x * scaled, axis=-1) + log_determinant)
    return logs
