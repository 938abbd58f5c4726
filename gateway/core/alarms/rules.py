"""When an alarm is reported, confirmed and ended: probabilities with a hysteresis between them, and times."""

import math
from dataclasses import dataclass
from enum import StrEnum

from gateway.core.alarms.alarm import NOTHING_FOUND, AlarmCause, AlarmFigure, AlarmState


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
