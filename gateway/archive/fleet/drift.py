"""Drift of vehicles beyond the seasonal movement that the fleet has in common, and beyond chance among many vehicles.

A slope is the median of the slopes between all pairs of points (Theil, 1950). Its interval and its test are those of
Kendall's S (P. K. Sen, J. Am. Stat. Assoc. 63, 1968), with its variance increased if the residuals are autocorrelated
(K. H. Hamed and A. R. Rao, J. Hydrology 204, 1998). Among a thousand vehicles some slopes arise by chance: the share of
those among the flagged ones is bounded under any dependence (Y. Benjamini and D. Yekutieli, Ann. Statist. 29, 2001).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from scipy.special import ndtr
from scipy.stats import rankdata

from gateway.archive.fleet.batches import DRIFTING
from gateway.archive.fleet.weeks import Weeks
from gateway.estimates.batch_estimate import Z95
from gateway.records import F64, I64, Bool

LEAST_POINTS: Final = 8  # chosen: with fewer points S is not approximately normal
MOST_ALIKE: Final = 0.95  # chosen: bound of the autocorrelation, for a finite variance
FALSE_SHARE: Final = 0.05  # chosen: of the flagged, those that may be there by chance


@dataclass(frozen=True, slots=True)
class DriftTrend:
    """A slope in units per unit of x, its 95 % interval and its p-value."""

    slope: float
    low: float
    high: float
    p: float
    n: int


def pair_slopes(x: F64, y: F64) -> F64:
    """Slopes between any two points (n,) that differ in x, rising."""
    first, second = np.triu_indices(len(x), 1)
    apart, rise = x[second] - x[first], y[second] - y[first]
    slopes: F64 = np.sort(rise[apart != 0.0] / apart[apart != 0.0])
    return slopes


def variance_of_s(x: F64, y: F64) -> float:
    """Variance of Kendall's S without a trend, with its correction for ties; below 0 with hardly anything but ties."""
    ties = [int(n) for values in (x, y) for n in np.unique(values, return_counts=True)[1]]
    free, *tied = (n * (n - 1) * (2 * n + 5) for n in (len(x), *ties))
    return (free - sum(tied)) / 18.0


def around_the_median(slopes: F64, reach: float) -> tuple[float, float]:
    """The slopes ``reach`` ranks of S on either side of the median, or the outermost ones."""
    low = max(round((len(slopes) - reach) / 2.0) - 1, 0)
    high = min(round((len(slopes) + reach) / 2.0), len(slopes) - 1)
    return float(slopes[low]), float(slopes[high])


def trend_of(x: F64, y: F64) -> DriftTrend | None:
    """The trend of y over x (n,), both finite, x rising; None with too few points."""
    n = len(x)
    if n < LEAST_POINTS:
        return None
    slopes = pair_slopes(x, y)
    slope = float(np.median(slopes))
    std = math.sqrt(variance_of_s(x, y) * _repeated(y - slope * x))
    low, high = around_the_median(slopes, Z95 * std)
    excess = max(0.0, abs(float(np.sign(slopes).sum())) - 1.0)  # of S, with continuity correction
    p = 1.0 if std == 0.0 else min(1.0, 2.0 * float(ndtr(-excess / std)))
    return DriftTrend(slope, low, high, p, n)


def believed(p: Sequence[float]) -> Bool:
    """Which of these p-values (n,) are significant, with at most FALSE_SHARE of them by chance."""
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
    """Factor of the variance of S due to autocorrelation of neighbouring weeks; at least 1.

    Ranks are taken to have an autocorrelation r, r squared over two weeks and so on. Its estimate from n points is too
    small by about (1 + 4 r) / n (F. H. C. Marriott and J. A. Pope, Biometrika 41, 1954) for the removed mean, and by 1
    / n more for the slope.
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


LEAST_IN_WEEK: Final = 5  # chosen: batches with a number for the median of a week
LEAST_VEHICLES: Final = 20  # chosen: with fewer, common movement cannot be separated from a single vehicle's
WEEKS_PER_YEAR: Final = 365.25 / 7.0  # Julian year


@dataclass(frozen=True, slots=True)
class Drift:
    """The drift of one vehicle's parameter, in its unit per year, since its last calibration.

    ``found`` is the raw trend; ``beyond`` is the trend without the median movement of the fleet, None if the fleet is
    too small. ``is_believed`` refers to ``beyond``, or to ``found`` without it.
    """

    found: DriftTrend
    beyond: DriftTrend | None
    is_believed: bool

    @property
    def judged(self) -> DriftTrend:
        return self.beyond or self.found


Series = Mapping[str, tuple[I64, F64]]  # by parameter: numbers of weeks and their medians, both (m,)


def series_of(weeks: Weeks) -> Series:
    """The weeks with a sufficiently known median of each parameter."""
    known = {name: weeks.n_medians[name] >= LEAST_IN_WEEK for name in DRIFTING}
    return {name: (weeks.number[rows], weeks.medians[name][rows]) for name, rows in known.items()}


def drifts_of(fleet: Mapping[str, Series]) -> dict[str, dict[str, Drift]]:
    """By vehicle and parameter, the drifts with enough data, judged together."""
    found: dict[tuple[str, str], tuple[DriftTrend, DriftTrend | None]] = {}
    common = {name: common_movement([series[name] for series in fleet.values()]) for name in DRIFTING}
    for vehicle, name in product(fleet, DRIFTING):
        number, medians = fleet[vehicle][name]
        trend = trend_of(number / WEEKS_PER_YEAR, medians)
        if trend is not None:
            found[vehicle, name] = (trend, _beyond(number, medians, common[name]))
    chances = [(beyond or trend).p for trend, beyond in found.values()]
    drifts: dict[str, dict[str, Drift]] = {vehicle: {} for vehicle in fleet}
    for ((vehicle, name), (trend, beyond)), is_believed in zip(found.items(), believed(chances), strict=True):
        drifts[vehicle][name] = Drift(trend, beyond, bool(is_believed))
    return drifts


def common_movement(series: Sequence[tuple[I64, F64]]) -> dict[int, float]:
    """By week: the median over vehicles of the difference between each one's week and its own median.

    Only weeks with LEAST_VEHICLES.
    """
    moved: dict[int, list[float]] = {}
    for number, medians in series:
        if medians.size:
            for week, away in zip(number.tolist(), (medians - np.median(medians)).tolist(), strict=True):
                moved.setdefault(week, []).append(away)
    return {week: float(np.median(away)) for week, away in moved.items() if len(away) >= LEAST_VEHICLES}


def _beyond(number: I64, medians: F64, common: Mapping[int, float]) -> DriftTrend | None:
    """The trend without the fleet's common movement; None if too few weeks have that."""
    rows = np.array([week in common for week in number.tolist()], dtype=bool)
    shared = np.array([common[week] for week in number[rows].tolist()])
    return trend_of(number[rows] / WEEKS_PER_YEAR, medians[rows] - shared)
