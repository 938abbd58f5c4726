"""When an alarm is raised and when it ends: probabilities with a hysteresis between them, and times.

Verdicts on overload follow from all batches of a load (``overload_says``), verdicts on refused batches from the batches
since the last counted one (``AlarmWatch``).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from gateway.core.alarms.alarm import OVERLOADS, AlarmCause, AlarmFigure
from gateway.core.vehicle import Vehicle
from gateway.core.weights.limits import over_limit_probability
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung, weighed
from gateway.estimates.batch_estimate import Estimate
from gateway.estimates.reasons import EXPLANATIONS, Cause

NOTHING_FOUND: Final = AlarmFigure()


@dataclass(frozen=True, slots=True)
class Says:
    """The newest evidence on one cause: True raises its alarm, False ends it, None (no or not enough evidence) leaves
    it; and the number that this rests on.
    """

    cause: AlarmCause
    is_raised: bool | None
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
        return not {cause.name, cause.kind.value}.intersection(self.off)

    def of_probability(self, probability: float, n_batches: int) -> bool | None:
        """The evidence of ``probability``, computed from all ``n_batches`` of a load together; NaN: unknown.

        The gap between both probabilities keeps an alarm from switching on and off at a weight near its limit.
        """
        if n_batches >= self.raise_batches and probability >= self.raise_probability:
            return True
        return False if probability <= self.clear_probability else None


SENSORS: Final = frozenset(why for why, told in EXPLANATIONS.items() if told.cause is Cause.SENSORS)
REFUSED_BATCHES: Final = 2  # in a row, for the sensor's sake, raise an alarm


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
            yield Says(cause, False)
            continue
        probability = over_limit_probability(weight.kg, weight.std_kg, weight.limit_kg)
        figure = AlarmFigure(weight.kg, weight.std_kg, weight.limit_kg, probability, weight.interval95_kg)
        yield Says(cause, rules.of_probability(probability, n_batches), figure)


def as_of_load(estimate: Estimate) -> Estimate:
    """The estimate with the posterior of all batches of its load, where that is known."""
    epoch = estimate.epoch
    if epoch is None or epoch.posterior is None:
        return estimate
    return estimate.answered(epoch.posterior)
