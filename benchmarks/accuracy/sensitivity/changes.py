"""Which change of load two batches that follow each other would show, and how often they show one that was none.

Fusion (core.fusion) takes a batch for another load where payload and share lie too far from the epoch's, by the
errors that batches do not share. Between two batches it notices, were the share to stay, a change of

    sqrt(threshold (own_1 + own_2)),    own: the variance of a batch's payload that is its own,

every other time. Drives of one van with different loads show what is noticed in fact.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from gateway.calibration.judgement import Judged
from gateway.core.fusion import CHANGE_THRESHOLD, CHANGE_THRESHOLD_SIDEWAYS, fused


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


def pairs_of(drives: Sequence[Sequence[Judged]]) -> list[Pair]:
    """Batches that follow each other within a drive, then the last and the first of drives that do."""
    answered = [[one for one in drive if one.estimate.counted] for drive in drives]
    within = [pair for drive in answered for pair in pairwise(drive)]
    with_answers = [drive for drive in answered if drive]
    across = [(one[-1], other[0]) for one, other in pairwise(with_answers)]
    return [_pair(*pair) for pair in (*within, *across)]


def _pair(before: Judged, after: Judged) -> Pair:
    one, other = fused(None, before.estimate), fused(None, after.estimate)
    both = fused(one, after.estimate)
    if one is None or other is None or both is None:
        raise ValueError("an answered batch opens an epoch")
    own_var = 1.0 / one.payload_kg.precision + 1.0 / other.payload_kg.precision
    changes = after.payload_kg - before.payload_kg, after.front_share_pct - before.front_share_pct
    is_sideways_told = one.cg_left_m is not None and other.cg_left_m is not None
    threshold = CHANGE_THRESHOLD_SIDEWAYS if is_sideways_told else CHANGE_THRESHOLD
    return Pair(*changes, math.sqrt(threshold * own_var), both.is_change)
