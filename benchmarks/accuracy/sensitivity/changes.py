"""The smallest change of load that two consecutive batches show, and how often they show one without a change.

The detector (core.change) compares the whole posteriors, in which errors common to both batches cancel. It is applied
to every pair of neighbours; the smallest change is that of the payload alone, without a stop. Drives of one van with
different loads give the true detection rate.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from gateway.calibration.judgement.evaluation import Judged
from gateway.core import change
from gateway.core.change import EVEN, Rules, probability
from gateway.posterior import PAYLOAD, Posterior

STEPS: Final = 20  # chosen: halvings of the payload range, to a millionth of it


@dataclass(frozen=True, slots=True)
class Pair:
    """Two consecutive batches: the true change, the smallest detectable one, and whether one was detected."""

    change_kg: float
    change_pct: float
    smallest_kg: float
    is_noticed: bool

    @property
    def is_one_load(self) -> bool:
        """Whether the load is the same in truth."""
        return self.change_kg == self.change_pct == 0.0


def pairs_of(drives: Sequence[Sequence[Judged]], rules: Rules) -> list[Pair]:
    """Consecutive batches within a drive, then the last and the first of consecutive drives."""
    answered = [[one for one in drive if one.estimate.counted] for drive in drives]
    within = [pair for drive in answered for pair in pairwise(drive)]
    with_answers = [drive for drive in answered if drive]
    across = [(one[-1], other[0]) for one, other in pairwise(with_answers)]
    return [_pair(*pair, rules) for pair in (*within, *across)]


def _pair(before: Judged, after: Judged, rules: Rules) -> Pair:
    one, other = before.estimate.posterior, after.estimate.posterior
    if one is None or other is None:
        raise ValueError("an answered batch has a posterior")
    changes = after.payload_kg - before.payload_kg, after.front_share_pct - before.front_share_pct
    return Pair(*changes, _smallest_kg(one, other, rules), _is_noticed(one, other, rules))


def _is_noticed(before: Posterior, after: Posterior, rules: Rules) -> bool:
    return probability(before, after, change.ROLLING, rules) > EVEN  # looked up in its module, as a study changes it


def _smallest_kg(before: Posterior, after: Posterior, rules: Rules) -> float:
    """By bisection, for a load equal to ``before`` except for its payload, with the errors of both."""
    low, high = 0.0, rules.range_kg
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        mean = before.first(after.size).mean + middle * (np.arange(min(before.size, after.size)) == PAYLOAD)
        moved = replace(after.first(before.size), mean=mean)
        low, high = (low, middle) if _is_noticed(before, moved, rules) else (middle, high)
    return high
