"""Coverage of 95 % intervals: the share that contains the truth, with its own interval for correlated batches.

Batches of one run share load, road and speed, so they are not independent trials. The interval is that of as many
independent trials as would scatter like the runs' own shares (E. L. Korn and B. I. Graubard, "Confidence intervals for
proportions with small expected number of positive counts estimated from survey data", Survey Methodology 24, 1998),
with C. Clopper's and E. S. Pearson's limits (Biometrika 26, 1934).
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import betaincinv, stdtrit

from gateway.records import F64

CONFIDENCE: Final = 0.95  # of the interval of a coverage
PROMISED: Final = (0.90, 0.99)  # chosen: accepted coverage of 95 % intervals
MISS_COSTS: Final = 40.0  # 2 / alpha for 95 % intervals (Gneiting and Raftery 2007, section 6.2)
IDEAL_SCORE: Final = 5.86
"""Mean interval score over mean absolute error, for normal errors with correct intervals."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """Share (0..1) of n intervals that contain the truth, with the 95 % limits of that share.

    n_effective is the number of independent trials that the n are worth.
    """

    n: int
    n_clusters: int
    n_effective: float
    share: float
    low: float
    high: float


def interval_scores(true: F64, low: F64, high: F64) -> F64:
    """(n,) scores of 95 % intervals, in the unit of the quantity: their width, and 40 times the distance of the truth
    outside.

    Its mean is least for the correct interval (R. L. Winkler, J. Am. Stat. Assoc. 67 (1972) 187-191;
    T. Gneiting and A. E. Raftery, J. Am. Stat. Assoc. 102 (2007) 359-378, section 6.2): coverage alone favours wide
    intervals, this score penalises both too narrow and too wide ones.
    """
    outside = np.maximum(low - true, 0.0) + np.maximum(true - high, 0.0)
    scores: F64 = (high - low) + MISS_COSTS * outside
    return scores


def coverage_of(covered: Sequence[bool], cluster: Sequence[Hashable]) -> Coverage:
    """Pooled over all; ``cluster`` (n,) says which trials belong together.

    Raises ValueError for fewer than two clusters: their scatter is unknown.
    """
    labels, member = np.unique([str(label) for label in cluster], return_inverse=True)
    n, n_clusters = len(covered), len(labels)
    if n_clusters < 2:
        raise ValueError(f"coverage needs batches of at least two runs, there are {n_clusters}")
    hits: F64 = np.asarray(covered, dtype=float)
    share = float(hits.mean())
    n_effective = _effective(hits - share, member, n_clusters, share)
    low, high = _clopper_pearson(share * n_effective, n_effective)
    return Coverage(n, n_clusters, n_effective, share, low, high)


def _effective(residual: F64, member: np.ndarray, n_clusters: int, share: float) -> float:
    """p (1 - p) over the variance of p between clusters, less Student's t correction for their number.

    Never more than n. If all trials agree no scatter is visible: each cluster then counts as one.
    """
    n = len(residual)
    if share in (0.0, 1.0):
        return float(n_clusters)
    by_cluster = np.bincount(member, residual, n_clusters)
    variance = n_clusters / (n_clusters - 1.0) * float(np.sum(by_cluster**2)) / n**2
    effective = min(share * (1.0 - share) / variance, float(n)) if variance > 0.0 else float(n)
    tail = 0.5 * (1.0 + CONFIDENCE)
    return effective * float(stdtrit(n - 1, tail) / stdtrit(n_clusters - 1, tail)) ** 2


def _clopper_pearson(hits: float, n: float) -> tuple[float, float]:
    alpha = 0.5 * (1.0 - CONFIDENCE)
    low = float(betaincinv(hits, n - hits + 1.0, alpha)) if hits > 0.0 else 0.0
    high = float(betaincinv(hits + 1.0, n - hits, 1.0 - alpha)) if hits < n else 1.0
    return low, high
