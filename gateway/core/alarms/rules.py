"""When an alarm is told, confirmed and ended: probabilities with a gap between them, and times."""

import math
from dataclasses import dataclass
from enum import StrEnum

from gateway.core.alarms.alarm import NOTHING_FOUND, AlarmState, Cause, Figure


class Verdict(StrEnum):
    """What was just found says of an alarm, whatever state it is in."""

    EARLY = "early"
    FINAL = "final"
    CLEAR = "clear"
    HOLD = "hold"  # nothing new, or nothing certain

    def state_after(self, before: AlarmState | None) -> AlarmState | None:
        """Forward only; None before there was an alarm, and after one that has ended there may be another."""
        stands = before in {AlarmState.EARLY, AlarmState.FINAL}
        if self is Verdict.FINAL:
            return AlarmState.FINAL
        if self is Verdict.EARLY:
            return before if stands else AlarmState.EARLY
        if self is Verdict.CLEAR and stands:
            return AlarmState.CLEARED
        return before


@dataclass(frozen=True, slots=True)
class Says:
    """A verdict on one cause, and on what it rests."""

    cause: Cause
    verdict: Verdict
    figure: Figure = NOTHING_FOUND


@dataclass(frozen=True, slots=True)
class AlarmRules:
    """The settings of ``[alarms]``; probabilities are 0 to 1.

    ``off`` names causes, or kinds for all of one kind.
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

    def is_on(self, cause: Cause) -> bool:
        return not cause.is_named_in(self.off)

    def of_probability(self, probability: float, n_batches: int) -> Verdict:
        """``probability`` is what all ``n_batches`` of a load together give; NaN where nothing is known.

        Final: enough batches are sure together. Early: they are nearly so, or a single one is. Ended: they say rather
        no than yes, by as much as is between the two probabilities, so that a weight about its limit does not make
        the alarm come and go.
        """
        if math.isnan(probability):
            return Verdict.HOLD
        if n_batches >= self.final_batches and probability >= self.final_probability:
            return Verdict.FINAL
        if probability <= self.clear_probability:
            return Verdict.CLEAR
        return Verdict.EARLY if probability >= self.early_probability else Verdict.HOLD
