"""How fast something drifts: a slope that single weeks cannot pull, how sure it is, and which of many to believe.

The slope is the median of the slopes between all pairs of points (Theil, 1950); its interval and its test are those of
Kendall's S (P. K. Sen, J. Am. Stat. Assoc. 63, 1968), whose variance is raised where what is left beside the slope
follows itself from point to point (K. H. Hamed and A. R. Rao, J. Hydrology 204, 1998). Whoever asks a thousand vehicles
finds some slopes by chance: how many of those that are flagged may be so is bounded, whatever the questions have in
common (Y. Benjamini and D. Yekutieli, Ann. Statist. 29, 2001).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import ndtr
from scipy.stats import rankdata

from gateway.calibration.trend import around_the_median, pair_slopes, variance_of_s
from gateway.estimate import Z95
from gateway.records import F64, Bool

LEAST_POINTS: Final = 8  # chosen: S of fewer is no normal number yet
MOST_ALIKE: Final = 0.95
FALSE_SHARE: Final = 0.05  # of the flagged, those that may be there by chance


@dataclass(frozen=True, slots=True)
class Trend:
    """A slope in units per unit of x, its 95 % interval and the chance of one as steep where there is none."""

    slope: float
    low: float
    high: float
    p: float
    n: int


def trend_of(x: F64, y: F64) -> Trend | None:
    """The trend of y over x (n,), both finite, x rising; None where there are too few points to tell."""
    n = len(x)
    if n < LEAST_POINTS:
        return None
    slopes = pair_slopes(x, y)
    slope = float(np.median(slopes))
    std = math.sqrt(variance_of_s(x, y) * _repeated(y - slope * x))
    low, high = around_the_median(slopes, Z95 * std)
    return Trend(slope, low, high, _chance(float(np.sign(slopes).sum()), std), n)


def believed(p: Sequence[float]) -> Bool:
    """Which of these chances (n,) are small enough, with at most FALSE_SHARE of them by chance."""
    chances = np.asarray(p, dtype=float)
    n = len(chances)
    if n == 0:
        return np.zeros(0, dtype=bool)
    order = np.argsort(chances)
    allowed = FALSE_SHARE * np.arange(1, n + 1) / (n * np.sum(1.0 / np.arange(1, n + 1)))
    below = np.flatnonzero(chances[order] <= allowed)
    chosen = np.zeros(n, dtype=bool)
    if below.size:
        chosen[order[: below[-1] + 1]] = True
    return chosen


def _repeated(left: F64) -> float:
    """By how much S varies more because a week is like the one before it; 1 where it is not. Never below.

    Ranks are taken to follow one another with one correlation r, with r squared over two weeks and so on. What is
    found of it in n points is too small by about (1 + 4 r) / n (F. H. C. Marriott and J. A. Pope, Biometrika 41, 1954)
    for the mean that was taken off, and by 1 / n more for the slope.
    """
    n = len(left)
    ranks = rankdata(left) - (n + 1) / 2.0
    power = float(ranks @ ranks)
    if power == 0.0:
        return 1.0
    found = float(ranks[:-1] @ ranks[1:]) / power
    alike = min(MOST_ALIKE, max(0.0, (n * found + 2.0) / (n - 4.0)))
    lags = np.arange(1, n - 2)
    counts = (n - lags) * (n - lags - 1.0) * (n - lags - 2.0) * alike**lags
    return 1.0 + 2.0 / (n * (n - 1.0) * (n - 2.0)) * float(np.sum(counts))


def _chance(s: float, std: float) -> float:
    """Two-sided, by the normal distribution with its correction for whole steps."""
    return 1.0 if std == 0.0 else min(1.0, 2.0 * float(ndtr(-max(0.0, abs(s) - 1.0) / std)))
