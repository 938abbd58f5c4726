"""Batches since the last counted one: how many a sensor caused to be refused, and how long the vehicle drove."""

from dataclasses import dataclass
from typing import Final

from gateway.core.alarms.alarm import NO_ESTIMATE, REFUSED, AlarmFigure
from gateway.core.alarms.rules import AlarmRules, AlarmVerdict, Says
from gateway.estimate import Estimate
from gateway.reasons import EXPLANATIONS, Cause
from gateway.records import Why
from gateway.units import NS_PER_S

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
