"""When an alarm is raised and when it ends: probabilities with a hysteresis between them, and times.

Verdicts on overload follow from all batches of a load (``overload_says``), verdicts on refused batches from the batches
since the last counted one (``Refusals``).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from gateway.core.alarms.alarm import OVERLOADS, REFUSED, AlarmCause, AlarmFigure
from gateway.core.vehicle import Vehicle
from gateway.core.weights.limits import over_limit_probability
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung, weighed
from gateway.estimate import Estimate
from gateway.reasons import EXPLANATIONS, Cause
from gateway.records import Why

NOTHING_FOUND: Final = AlarmFigure()


class AlarmVerdict(StrEnum):
    """The newest evidence's verdict on an alarm, whether it is active or not."""

    RAISE = "raise"
    CLEAR = "clear"
    HOLD = "hold"  # no change: no evidence, or not enough


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

    raise_probability: float = 0.95
    raise_batches: int = 2
    clear_probability: float = 0.25
    sensor_silent_s: float = 600.0
    off: tuple[str, ...] = ()

    def is_on(self, cause: AlarmCause) -> bool:
        return not cause.is_named_in(self.off)

    def of_probability(self, probability: float, n_batches: int) -> AlarmVerdict:
        """The verdict for ``probability``, computed from all ``n_batches`` of a load together; NaN: unknown.

        The gap between both probabilities keeps an alarm from switching on and off at a weight near its limit.
        """
        if n_batches >= self.raise_batches and probability >= self.raise_probability:
            return AlarmVerdict.RAISE
        return AlarmVerdict.CLEAR if probability <= self.clear_probability else AlarmVerdict.HOLD


SENSORS: Final = frozenset(why for why, told in EXPLANATIONS.items() if told.cause is Cause.SENSORS)
REFUSED_BATCHES: Final = 2  # in a row, for the sensor's sake, raise an alarm


@dataclass(frozen=True, slots=True)
class Refusals:
    """The number of consecutive batches that a sensor caused to be refused; None after a batch that counted."""

    n: int | None = None
    last: tuple[Why, ...] = ()

    def after(self, estimate: Estimate) -> "Refusals":
        """The state after one more whole batch. A batch without a calibration changes nothing, as it cannot count."""
        if estimate.counted:
            return Refusals()
        if Why.NO_CALIBRATION in estimate.rejected:
            return self
        of_sensors = tuple(why for why in estimate.rejected if why in SENSORS)
        return Refusals((self.n or 0) + 1 if of_sensors else 0, of_sensors)

    def says(self) -> Says:
        """The first batch that counts ends the alarm. A refusal for another reason leaves it as it is."""
        if self.n is None:
            return Says(REFUSED, AlarmVerdict.CLEAR)
        verdict = AlarmVerdict.RAISE if self.n >= REFUSED_BATCHES else AlarmVerdict.HOLD
        return Says(REFUSED, verdict, AlarmFigure(detail=", ".join(self.last) or None))


def overload_says(
    rules: AlarmRules, estimate: Estimate, vehicle: Vehicle | None, unsprung: Unsprung = NOT_CALIBRATED
) -> Iterator[Says]:
    """Verdicts of a whole batch that counted, and of its load epoch (core.fusion).

    The load's weights follow from the posterior of all its batches, just as the batch's weights follow from its own.
    """
    load, n_batches = as_of_load(estimate), 1 if estimate.epoch is None else estimate.epoch.n_batches
    weights = weighed(load, vehicle, unsprung).weights if vehicle else estimate.weights
    for cause, (_, weight) in zip(OVERLOADS, weights.items(), strict=True):
        if weight.limit_kg is None:
            yield Says(cause, AlarmVerdict.CLEAR)
            continue
        probability = over_limit_probability(weight.kg, weight.std_kg, weight.limit_kg)
        figure = AlarmFigure(weight.kg, weight.std_kg, weight.limit_kg, probability)
        yield Says(cause, rules.of_probability(probability, n_batches), figure)


def as_of_load(estimate: Estimate) -> Estimate:
    """The estimate with the posterior of all batches of its load, where that is known."""
    epoch = estimate.epoch
    if epoch is None or epoch.posterior is None:
        return estimate
    return estimate.answered(epoch.posterior)
