"""What the batches since the last one that counted say together: refused for a sensor's sake, or for long."""

from dataclasses import dataclass
from typing import Final

from gateway.core.alarms.alarm import NO_ESTIMATE, REFUSED, Figure
from gateway.core.alarms.rules import AlarmRules, Says, Verdict
from gateway.estimate import Estimate
from gateway.reasons import EXPLANATIONS, Cause
from gateway.records import Why
from gateway.units import NS_PER_S

SENSORS: Final = frozenset(why for why, told in EXPLANATIONS.items() if told.cause is Cause.SENSORS)
TO_BE_SURE: Final = 2  # batches, or times the time


@dataclass(frozen=True, slots=True)
class Drives:
    """``driven_s`` without an estimate, ``n_refused`` batches in a row refused for a sensor's sake."""

    driven_s: float = 0.0
    n_refused: int = 0
    last: tuple[Why, ...] = ()

    def after(self, estimate: Estimate) -> "Drives":
        """With one more whole batch. One without a calibration says nothing: none can count."""
        if estimate.counted:
            return NO_DRIVES
        if Why.NO_CALIBRATION in estimate.rejected:
            return self
        driven_s = self.driven_s + (estimate.t_end_ns - estimate.t_start_ns) / NS_PER_S
        of_sensors = tuple(why for why in estimate.rejected if why in SENSORS)
        n_refused = self.n_refused + 1 if of_sensors else 0
        return Drives(driven_s, n_refused, of_sensors or estimate.rejected)

    def verdicts(self, rules: AlarmRules) -> tuple[Says, Says]:
        """A sensor's refusals: early with the first, final with the second in a row; a long time: final after twice it.

        Both are over with the first batch that counts. A refusal for another reason leaves a sensor's alarm as it is.
        """
        why = ", ".join(self.last)
        refused, long = Verdict.CLEAR, Verdict.CLEAR
        if self.driven_s > 0.0:
            refused = _grown(self.n_refused, 1, TO_BE_SURE)
            long = _grown(self.driven_s, rules.no_estimate_s, TO_BE_SURE * rules.no_estimate_s)
        minutes = Figure(self.driven_s / 60.0, limit=rules.no_estimate_s / 60.0, unit="min", detail=why or None)
        return Says(REFUSED, refused, Figure(detail=why or None)), Says(NO_ESTIMATE, long, minutes)


NO_DRIVES: Final = Drives()


def _grown(now: float, early: float, final: float) -> Verdict:
    if now >= final:
        return Verdict.FINAL
    return Verdict.EARLY if now >= early else Verdict.HOLD
