"""Whether intervals are narrow enough to be useful, the main cause of their width, and its remedy.

Coverage shows whether intervals are valid; an interval over all possible loads is valid too, but useless.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.budget import BudgetLine, typical_budget
from gateway.calibration.judgement.evaluation import Judged, Target, TargetErrors
from gateway.estimate import Z95
from gateway.reasons import REMEDIES, SOURCES

FIT_HALF_WIDTH_PCT: Final = (
    25.0  # chosen, of the range: half the 95 % interval for a mean normal error of FIT_ERROR_PCT
)
MOST_HALF_WIDTH_PCT: Final = 50.0  # chosen, likewise for MOST_ERROR_PCT: the interval is as wide as the range


@dataclass(frozen=True, slots=True)
class Width:
    """Mean half-width of 95 % intervals over batches, in ``unit`` and percent of the range; ``cause`` is the largest
    source of the error, None if the estimates have no budget.
    """

    target: Target
    half: float
    unit: str
    percent: float
    cause: BudgetLine | None

    @property
    def is_fit(self) -> bool:
        """Whether intervals are narrow enough to plan with."""
        return self.percent <= FIT_HALF_WIDTH_PCT

    @property
    def is_of_use(self) -> bool:
        """Whether intervals are narrower than the range itself."""
        return self.percent <= MOST_HALF_WIDTH_PCT

    @property
    def judged(self) -> str:
        """The judgement in a word or two."""
        return "fit" if self.is_fit else "wide" if self.is_of_use else "too wide to be of use"

    @property
    def sentence(self) -> str:
        """The judgement with the main cause and its remedy."""
        said = (
            f"95 % intervals of {self.target.replace('_', ' ')} are ± {self.half:.3g} {self.unit} on average, "
            f"{self.percent:.0f} % of the range: {self.judged} (fit to {FIT_HALF_WIDTH_PCT:g} %, no use beyond "
            f"{MOST_HALF_WIDTH_PCT:g} %)."
        )
        if self.cause is None:
            return said
        source = SOURCES.get(self.cause.source, self.cause.source)
        return f"{said} Mostly due to {source}{self._remedy(self.cause)}."

    def _remedy(self, cause: BudgetLine) -> str:
        """What narrows it; how far is known for the payload only."""
        if cause.remedy is None:
            return ""
        after = f" (then ± {Z95 * cause.payload_with_remedy_kg:.0f} kg)" if self.target == "payload" else ""
        return f": {REMEDIES[cause.remedy]}{after}"


def width_of(judged: Sequence[Judged], errors: TargetErrors, target: Target) -> Width | None:
    """None if no batch was answered with an interval."""
    halves = [
        0.5 * (compared.high - compared.low)
        for compared in (one.compared(target) for one in judged)
        if compared.low <= compared.high
    ]
    if not halves or errors.half_width_pct is None:
        return None
    budgets = [one.estimate.error_budget for one in judged if one.estimate.error_budget]
    lines = typical_budget(budgets) if budgets else ()
    cause = max(lines, key=lambda line: line.payload_kg if target == "payload" else line.front_share_pct, default=None)
    return Width(target, float(np.mean(halves)), errors.unit, errors.half_width_pct, cause)
