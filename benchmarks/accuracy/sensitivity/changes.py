"""Which change of load two batches that follow each other would show, and how often they show one that was none.

The detector (core.change) compares the whole posterior, with what is common to both batches cancelled. Here it is asked
of every pair of neighbours; the smallest change is the one of the payload alone that it would take for a change without
a stop. Drives of one van with different loads show what is noticed in fact.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from gateway.calibration.judgement import Judged
from gateway.core import change
from gateway.core.change import EVEN, Rules, probability
from gateway.posterior import PAYLOAD, Posterior

STEPS: Final = 20  # halvings of the payload range: to a millionth of it


@dataclass(frozen=True, slots=True)
class Pair:
    """Two batches weighed one after the other: the true change, the smallest to notice, whether one was noticed."""

    change_kg: float
    change_pct: float
    smallest_kg: float
    is_noticed: bool

    @property
    def is_one_load(self) -> bool:
        """Whether nothing has changed in truth."""
        return self.change_kg == self.change_pct == 0.0


def pairs_of(drives: Sequence[Sequence[Judged]], rules: Rules) -> list[Pair]:
    """Batches that follow each other within a drive, then the last and the first of drives that do."""
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
    return probability(before, after, change.ROLLING, rules) > EVEN  # asked of its module: a study changes it


def _smallest_kg(before: Posterior, after: Posterior, rules: Rules) -> float:
    """By bisection, of a load that is ``before`` but for its payload, with the errors of both."""
    low, high = 0.0, rules.range_kg
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        mean = before.first(after.size).mean + middle * (np.arange(min(before.size, after.size)) == PAYLOAD)
        moved = replace(after.first(before.size), mean=mean)
        low, high = (low, middle) if _is_noticed(before, moved, rules) else (middle, high)
    return high
