"""Verdicts on overload and imbalance from all batches of a load."""

import math
from collections.abc import Iterator

from gateway.core.alarms.alarm import AXLES, OVERLOADS, SIDES, AlarmFigure
from gateway.core.alarms.rules import AlarmRules, AlarmVerdict, Says
from gateway.core.vehicle import Vehicle, left_share_pct
from gateway.core.weights import NOT_CALIBRATED, Unsprung, over_limit_probability, weighed
from gateway.estimate import UNKNOWN, Estimate, Quantity


def verdicts_of(
    rules: AlarmRules, estimate: Estimate, vehicle: Vehicle | None, unsprung: Unsprung = NOT_CALIBRATED
) -> Iterator[Says]:
    """Verdicts of a whole batch that counted, and of its load epoch (core.fusion).

    The load's weights follow from the posterior of all its batches, just as the batch's weights follow from its own.
    """
    load, n_batches = as_of_load(estimate), 1 if estimate.epoch is None else estimate.epoch.n_batches
    weights = weighed(load, vehicle, unsprung).weights if vehicle else estimate.weights
    for cause, (_, weight) in zip(OVERLOADS, weights.items(), strict=True):
        if weight.limit_kg is None:
            yield Says(cause, AlarmVerdict.CLEAR, AlarmFigure(detail="no limit is given"))
            continue
        probability = over_limit_probability(weight.kg, weight.std_kg, weight.limit_kg)
        figure = AlarmFigure(weight.kg, weight.std_kg, weight.limit_kg, "kg", probability)
        yield Says(cause, rules.of_probability(probability, n_batches), figure)
    shares = (
        (SIDES, _left_share(load, vehicle), rules.side_share_max_pct),
        (AXLES, load.front_share, rules.axle_share_max_pct),
    )
    for cause, share, most_pct in shares:
        probability = beyond_probability(share, most_pct)
        figure = AlarmFigure(_larger(share.number), share.std, most_pct, "%", probability)
        yield Says(cause, rules.of_probability(probability, n_batches), figure)


def as_of_load(estimate: Estimate) -> Estimate:
    """The estimate with the posterior of all batches of its load, where that is known."""
    epoch = estimate.epoch
    if epoch is None or epoch.posterior is None:
        return estimate
    return estimate.answered(epoch.posterior)


def beyond_probability(share: Quantity, most_pct: float) -> float:
    """P(one of two sides carries more than ``most_pct``), 0 to 1, for a share with a normal error; NaN where unknown.

    With X the share of one side it is P(X > m) + P(100 - X > m); both events exclude each other for m >= 50.
    """
    one = over_limit_probability(share.number, share.std, most_pct)
    return one + over_limit_probability(100.0 - share.number, share.std, most_pct)


def _left_share(estimate: Estimate, vehicle: Vehicle | None) -> Quantity:
    cg_left = estimate.cg_left
    if vehicle is None or vehicle.track_width_m is None or math.isnan(cg_left.number):
        return UNKNOWN
    track_m = vehicle.track_width_m
    return Quantity(left_share_pct(cg_left.number, track_m), 100.0 * cg_left.std / track_m)


def _larger(share_pct: float) -> float:
    return max(share_pct, 100.0 - share_pct)
