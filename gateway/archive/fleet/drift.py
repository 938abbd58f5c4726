"""Drift of vehicles in excess of the fleet's common seasonal movement, and of chance among many vehicles."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np

from gateway.archive.fleet.batches import DRIFTING
from gateway.archive.fleet.trend import DriftTrend, believed, trend_of
from gateway.archive.fleet.weeks import Weeks
from gateway.records import F64, I64

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
