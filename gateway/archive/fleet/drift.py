"""Drift of vehicles beyond the seasonal movement that the fleet has in common, and beyond chance among many vehicles.

A slope is the median of the slopes between all pairs of points (Theil, 1950). Its interval and its test are those of
Kendall's S (P. K. Sen, J. Am. Stat. Assoc. 63, 1968), with its variance increased if the residuals are autocorrelated
(K. H. Hamed and A. R. Rao, J. Hydrology 204, 1998). Among a thousand vehicles some slopes arise by chance: the share of
those among the flagged ones is bounded under any dependence (Y. Benjamini and D. Yekutieli, Ann. Statist. 29, 2001).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import polars as pl
from scipy.special import ndtr, ndtri
from scipy.stats import false_discovery_control, kendalltau, rankdata, theilslopes

from gateway.archive.fleet.batches import DRIFTING
from gateway.estimates.batch_estimate import Z95
from gateway.records import F64, Bool

LEAST_POINTS: Final = 8  # chosen: with fewer points S is not approximately normal
MOST_ALIKE: Final = 0.95  # chosen: bound of the autocorrelation, for a finite variance
FALSE_SHARE: Final = 0.05  # chosen: of the flagged, those that may be there by chance
LEAST_IN_WEEK: Final = 5  # chosen: batches with a number for the median of a week
LEAST_VEHICLES: Final = 20  # chosen: with fewer, common movement cannot be separated from a single vehicle's
WEEKS_PER_YEAR: Final = 365.25 / 7.0  # Julian year


@dataclass(frozen=True, slots=True)
class DriftTrend:
    """A slope in units per unit of x, its 95 % interval and its p-value."""

    slope: float
    low: float
    high: float
    p: float
    n: int


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


def medians_of(batches: pl.DataFrame) -> pl.DataFrame:
    """The ``median`` of each parameter by ``name`` and ``week``, of the weeks with enough batches that know it."""
    return (
        batches.unpivot(DRIFTING, index="week", variable_name="name", value_name="number")
        .drop_nulls()
        .group_by("name", "week")
        .agg(pl.len().alias("n"), pl.median("number").alias("median"))
        .filter(pl.col("n") >= LEAST_IN_WEEK)
        .sort("week")
    )


def drifts_of(medians: pl.DataFrame) -> dict[tuple[str, str], Drift]:
    """The drifts with enough data by vehicle and parameter, judged together.

    ``medians`` has a row for each ``vehicle``, ``name`` and ``week`` (``medians_of``). The movement of the fleet in a
    week is the median, over at least LEAST_VEHICLES, of how far each vehicle is from its own median then.
    """
    away = pl.col("median") - pl.col("median").median().over("vehicle", "name")
    moved = medians.with_columns(away=away).with_columns(
        common=pl.when(pl.len().over("name", "week") >= LEAST_VEHICLES).then(pl.median("away").over("name", "week"))
    )
    found: dict[tuple[str, str], tuple[DriftTrend, DriftTrend | None]] = {}
    for (vehicle, name), weeks in moved.partition_by("vehicle", "name", as_dict=True).items():
        shared = weeks.drop_nulls("common")
        if (trend := _per_year(weeks, weeks["median"])) is not None:
            found[vehicle, name] = trend, _per_year(shared, shared["median"] - shared["common"])
    flags = believed([(beyond or trend).p for trend, beyond in found.values()]).tolist()
    return {key: Drift(*trends, is_believed) for (key, trends), is_believed in zip(found.items(), flags, strict=True)}


def _per_year(weeks: pl.DataFrame, numbers: pl.Series) -> DriftTrend | None:
    return trend_of(weeks["week"].to_numpy() / WEEKS_PER_YEAR, numbers.to_numpy())


def trend_of(x: F64, y: F64) -> DriftTrend | None:
    """The trend of y over x (n,), both finite, x rising; None with too few points."""
    if len(x) < LEAST_POINTS:
        return None
    slope = float(theilslopes(y, x).slope)
    wider = math.sqrt(_repeated(y - slope * x))  # than if neighbouring weeks did not follow each other
    _, _, low, high = theilslopes(y, x, alpha=float(2.0 * ndtr(-Z95 * wider)))
    chance = kendalltau(x, y, method="asymptotic").pvalue
    p = 1.0 if math.isnan(chance) else 2.0 * float(ndtr(ndtri(chance / 2.0) / wider))
    return DriftTrend(slope, float(low), float(high), p, len(x))


def believed(p: Sequence[float]) -> Bool:
    """Which of these p-values (n,) are significant, with at most FALSE_SHARE of them by chance."""
    chosen: Bool = np.asarray(false_discovery_control(p, method="by") if p else []) <= FALSE_SHARE
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
