"""How likely it is that the load changed between two groups of batches, and by how much.

What the batches share hides no change (core.fusion), so two groups are compared by what is their own alone. Without a
change their differences x in payload, f in front share, y in the sideways place are noise, N(0, v). With one of d kg,
d ~ N(0, s^2), the payload differs by d and what is moved moves the centre of gravity, by g_f d and g_y d for a place
nobody knows, so that f ~ N(0, v_f + (g_f d)^2) and y likewise. The Bayes factor is the ratio of the densities,

    B = int N(d; 0, s^2) N(x; d, v_x) prod_q N(q; 0, v_q + (g_q d)^2) dd / (N(x; 0, v_x) prod_q N(q; 0, v_q)),

and the probability of a change p B / (1 - p + p B) with p what it was before (Kass & Raftery, Bayes factors,
J. Am. Stat. Assoc. 90 (1995) 773-795, equations 1 and 2).
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import expit, logit

from gateway.core.events.load import Load
from gateway.core.fusion import Fused
from gateway.core.vehicle import Vehicle
from gateway.estimate import Quantity
from gateway.records import F64

SPREAD_SHARE: Final = 0.25  # of the payload range: what is loaded or unloaded at a stop, one standard deviation
PLACE_ALONG_SHARE: Final = 0.3  # of the wheelbase: where it lies, about the centre of gravity
PLACE_ACROSS_M: Final = 0.3
LEAST_RANGE_KG: Final = 100.0
_NODES: Final = np.linspace(-6.0, 6.0, 241)  # standard deviations about the difference found
_STEP: Final = float(_NODES[1] - _NODES[0])


@dataclass(frozen=True, slots=True)
class Rules:
    """What a vehicle's size says of loads: how much they change at a stop, and what an empty one is."""

    range_kg: float = 1000.0
    mass_kg: float = 2000.0

    @classmethod
    def of(cls, vehicle: Vehicle) -> "Rules":
        """By the campaign's vehicle."""
        low, high = vehicle.payload_range_kg
        return cls(max(high - low, LEAST_RANGE_KG), vehicle.empty_mass_kg + 0.5 * (low + high))

    @property
    def spread_kg(self) -> float:
        return SPREAD_SHARE * self.range_kg


def probability(before: Load, after: Load, prior: float, rules: Rules) -> float:
    """That the load changed between them, 0 to 1; ``prior`` is what it was before anything was weighed.

    By logarithms of odds: after a round of short hops the prior is 1 to the last digit, and its odds are no number.
    """
    return float(expit(logit(prior) + _log_bayes_factor(before, after, rules)))


def change_of(before: Load, after: Load, rules: Rules) -> Quantity:
    """By how many kg the load changed.

    Both groups' own errors are in it, and of what they share the part that cannot be the same: a shared error depends
    on the load, smoothly, so loads that are d apart have 2 (2 d / range)^2 of its variance between them, all of it (2)
    from half the payload range on.
    """
    difference = after.payload_kg.mean - before.payload_kg.mean
    shared_var = 0.5 * (before.payload_kg.shared_var + after.payload_kg.shared_var)
    apart = min(abs(difference) / (0.5 * rules.range_kg), 1.0)
    var = _own_var(before.payload_kg, after.payload_kg) + 2.0 * shared_var * apart**2
    return Quantity.normal(difference, math.sqrt(var))


def _log_bayes_factor(before: Load, after: Load, rules: Rules) -> float:
    x, var = after.payload_kg.mean - before.payload_kg.mean, _own_var(before.payload_kg, after.payload_kg)
    per_kg = 100.0 * PLACE_ALONG_SHARE / rules.mass_kg  # percentage points of front share
    moved = [(before.front_share_pct, after.front_share_pct, per_kg)]
    if before.cg_left_m is not None and after.cg_left_m is not None:
        moved.append((before.cg_left_m, after.cg_left_m, PLACE_ACROSS_M / rules.mass_kg))
    d = x + math.sqrt(var) * _NODES
    log_with = _log_normal(d, rules.spread_kg**2) + _log_normal(d - x, var) + 0.5 * math.log(var) + math.log(_STEP)
    log_without = float(_log_normal(np.array(x), var))
    for one, other, by_kg in moved:
        q, q_var = np.array(other.mean - one.mean), _own_var(one, other)
        log_with = log_with + _log_normal(q, q_var + (by_kg * d) ** 2)
        log_without += float(_log_normal(q, q_var))
    return float(np.logaddexp.reduce(log_with)) - log_without


def _own_var(one: Fused, other: Fused) -> float:
    return 1.0 / one.precision + 1.0 / other.precision


def _log_normal(x: F64, var: F64 | float) -> F64:
    logs: F64 = -0.5 * (x**2 / var + np.log(2.0 * math.pi * var))
    return logs
