"""When an alarm is reported, confirmed and ended: probabilities with a hysteresis between them, and times.

Verdicts on overload and imbalance follow from all batches of a load (``verdicts_of``), verdicts on refused batches and
missing estimates from the batches since the last counted one (``DriveTally``).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from gateway.core.alarms.alarm import (
    AXLES,
    NO_ESTIMATE,
    NOTHING_FOUND,
    OVERLOADS,
    REFUSED,
    SIDES,
    AlarmCause,
    AlarmFigure,
    AlarmState,
)
from gateway.core.vehicle import Vehicle, left_share_pct
from gateway.core.weights.limits import over_limit_probability
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung, weighed
from gateway.estimate import UNKNOWN, Estimate, Quantity
from gateway.reasons import EXPLANATIONS, Cause
from gateway.records import Why
from gateway.units import NS_PER_S


class AlarmVerdict(StrEnum):
    """What the newest evidence says about an alarm, whatever its state."""

    EARLY = "early"
    FINAL = "final"
    CLEAR = "clear"
    HOLD = "hold"  # no change: no evidence, or not enough

    def state_after(self, before: AlarmState | None) -> AlarmState | None:
        """The state after this verdict. States only move forward; None means no alarm yet, and a cleared alarm may be
        followed by a new one.
        """
        stands = before in {AlarmState.EARLY, AlarmState.FINAL}
        if self is AlarmVerdict.FINAL:
            return AlarmState.FINAL
        if self is AlarmVerdict.EARLY:
            return before if stands else AlarmState.EARLY
        if self is AlarmVerdict.CLEAR and stands:
            return AlarmState.CLEARED
        return before


@dataclass(frozen=True, slots=True)
class Says:
    """A verdict on one cause, and the number it rests on."""

    cause: AlarmCause
    verdict: AlarmVerdict
    figure: AlarmFigure = NOTHING_FOUND


@dataclass(frozen=True, slots=True)
class AlarmRules:
    """The settings of ``[alarms]``; probabilities are 0 to 1.

    ``off`` holds names of causes, or of kinds, which switch off every cause of the kind.
    """

    early_probability: float = 0.9
    final_probability: float = 0.95
    final_batches: int = 2
    clear_probability: float = 0.25
    side_share_max_pct: float = 55.0
    axle_share_max_pct: float = 75.0
    sensor_silent_s: float = 60.0
    sensor_silent_final_s: float = 600.0
    no_estimate_s: float = 7200.0
    off: tuple[str, ...] = ()

    def is_on(self, cause: AlarmCause) -> bool:
        return not cause.is_named_in(self.off)

    def of_probability(self, probability: float, n_batches: int) -> AlarmVerdict:
        """The verdict for ``probability``, computed from all ``n_batches`` of a load together; NaN: unknown.

        Final: enough batches, and their joint probability is high. Early: the probability is nearly as high, or it
        rests on a single batch. Clear: the probability is low. The gap between the early and the clear probability
        keeps an alarm from switching on and off at a weight near its limit.
        """
        if math.isnan(probability):
            return AlarmVerdict.HOLD
        if n_batches >= self.final_batches and probability >= self.final_probability:
            return AlarmVerdict.FINAL
        if probability <= self.clear_probability:
            return AlarmVerdict.CLEAR
        return AlarmVerdict.EARLY if probability >= self.early_probability else AlarmVerdict.HOLD


SENSORS: Final = frozenset(why for why, told in EXPLANATIONS.items() if told.cause is Cause.SENSORS)
TO_BE_SURE: Final = 2  # batches, or times the time


@dataclass(frozen=True, slots=True)
class DriveTally:
    """``driven_s`` is the time driven without an estimate, ``n_refused`` the number of consecutive batches that a
    sensor caused to be refused.
    """

    driven_s: float = 0.0
    n_refused: int = 0
    last: tuple[Why, ...] = ()

    def after(self, estimate: Estimate) -> "DriveTally":
        """The state after one more whole batch. A batch without a calibration changes nothing, as it cannot count."""
        if estimate.counted:
            return NO_DRIVES
        if Why.NO_CALIBRATION in estimate.rejected:
            return self
        driven_s = self.driven_s + (estimate.t_end_ns - estimate.t_start_ns) / NS_PER_S
        of_sensors = tuple(why for why in estimate.rejected if why in SENSORS)
        n_refused = self.n_refused + 1 if of_sensors else 0
        return DriveTally(driven_s, n_refused, of_sensors or estimate.rejected)

    def verdicts(self, rules: AlarmRules) -> tuple[Says, Says]:
        """Verdicts on refused batches and on the time without an estimate.

        Refusals because of a sensor: early at the first, final at the second in a row. A long time: final at twice the
        limit. The first batch that counts clears both. A refusal for another reason leaves the sensor's alarm as it is.
        """
        why = ", ".join(self.last)
        refused, long = AlarmVerdict.CLEAR, AlarmVerdict.CLEAR
        if self.driven_s > 0.0:
            refused = _grown(self.n_refused, 1, TO_BE_SURE)
            long = _grown(self.driven_s, rules.no_estimate_s, TO_BE_SURE * rules.no_estimate_s)
        minutes = AlarmFigure(self.driven_s / 60.0, limit=rules.no_estimate_s / 60.0, unit="min", detail=why or None)
        return Says(REFUSED, refused, AlarmFigure(detail=why or None)), Says(NO_ESTIMATE, long, minutes)


NO_DRIVES: Final = DriveTally()


def _grown(now: float, early: float, final: float) -> AlarmVerdict:
    if now >= final:
        return AlarmVerdict.FINAL
    return AlarmVerdict.EARLY if now >= early else AlarmVerdict.HOLD


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
