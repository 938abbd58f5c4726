"""How a vehicle's own parameters drift over months: what its batches found of them, week by week, and a robust slope.

Each batch finds its dampers and the scale of its delay beside the load (core.cross_spectrum.drift), held near the
calibration by what the search believes: a real change is larger than what is found of it. Springs are not found
batch by batch; what they change moves the zero, which each
"it is empty now" shows.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from statistics import NormalDist
from typing import Final, Literal

import numpy as np
from pydantic import Field

from gateway.calibration.file.parts import Part
from gateway.estimate import Estimate
from gateway.records import F64, Why
from gateway.units import NS_PER_S

FILE_NAME: Final = "trend.json"
MOST_WEEKS: Final = 520  # of all calibrations together, the newest
LEAST_POINTS: Final = {"week": 8, "zero": 5}
CONFIDENCE: Final = 0.99  # of a change's interval
DAMPER_CHANGE_PCT: Final = 5.0  # chosen: the search's own belief lets a damper go 3 % (core.cross_spectrum.drift)
DELAY_CHANGE_PCT: Final = 1.0  # likewise; it believes in 0.3 %
ZERO_CHANGE_SHARE: Final = 0.01  # of the empty mass; likewise

_RATIOS: Final = {"damper_front_ratio": "damper_front", "damper_rear_ratio": "damper_rear"}  # of the calibrated: 1
_SHARES: Final = {"delay_scale": "delay"}  # by which it is off: 0


class Week(Part):
    """The sums of what the batches of one week found, in percent off the calibration."""

    monday: str
    calibration_id: str
    n: int
    sums_pct: dict[str, float]


class TrendHistory(Part):
    """Everything up to ``cursor`` in the store's history, oldest week first."""

    format: Literal["springscale-trend"] = "springscale-trend"
    version: Literal[1] = 1
    cursor: str | None = None
    weeks: tuple[Week, ...] = Field((), max_length=MOST_WEEKS)

    def with_batches(self, estimates: Iterable[Estimate], cursor: str | None) -> "TrendHistory":
        """With more batches, in any order; those that found no parameters are passed over."""
        weeks = {(week.monday, week.calibration_id): week for week in self.weeks}
        for estimate in estimates:
            if (found := found_pct(estimate)) is None or estimate.calibration_id is None:
                continue
            key = (monday_of(estimate.t_end_ns), estimate.calibration_id)
            before = weeks.get(key, Week(monday=key[0], calibration_id=key[1], n=0, sums_pct={}))
            sums = {name: before.sums_pct.get(name, 0.0) + pct for name, pct in found.items()}
            weeks[key] = before.model_copy(update={"n": before.n + 1, "sums_pct": sums})
        kept = tuple(weeks[key] for key in sorted(weeks))[-MOST_WEEKS:]
        return self.model_copy(update={"cursor": cursor, "weeks": kept})


@dataclass(frozen=True, slots=True)
class Point:
    """One mean: when, what, and of how many."""

    t: str
    number: float
    n: int


@dataclass(frozen=True, slots=True)
class Trend:
    """A parameter's course and its change from the first point to the last; None where there are too few points.

    ``interval99`` is of the change; it drifts where this excludes 0 and the change is not small.
    """

    name: str
    unit: str
    points: tuple[Point, ...]
    change: float | None = None
    interval99: tuple[float, float] | None = None
    is_drifting: bool = False

    def sentence(self) -> str | None:
        """The warning of one that drifts."""
        if not self.is_drifting or self.change is None or self.interval99 is None:
            return None
        low, high = self.interval99
        return (
            f"{self.name.replace('_', ' ')} has drifted by {self.change:+.1f} {self.unit} ({low:+.1f} to {high:+.1f}, "
            f"99 %) since {self.points[0].t[:10]}: verify with a known load, and look at the vehicle"
        )


def found_pct(estimate: Estimate) -> dict[str, float] | None:
    """What a batch found of the vehicle, in percent off its calibration; None where it found nothing.

    A vehicle that drifts far is refused as a misfit: what such a batch found counts too.
    """
    is_heard = estimate.counted or estimate.rejected == (Why.MODEL_MISFIT,)
    ratios = {name: estimate.diagnostics.get(key, math.nan) for key, name in _RATIOS.items()}
    shares = {name: estimate.diagnostics.get(key, math.nan) for key, name in _SHARES.items()}
    is_known = all(map(math.isfinite, (*ratios.values(), *shares.values())))
    if not is_heard or not is_known or not all(ratio > 0.0 for ratio in ratios.values()):
        return None
    return {name: 100.0 * math.log(ratio) for name, ratio in ratios.items()} | {
        name: 100.0 * share for name, share in shares.items()
    }


def monday_of(t_ns: int) -> str:
    """The week of a stamp, as the date of its Monday."""
    day = datetime.fromtimestamp(t_ns // NS_PER_S, UTC).date()
    return (day - timedelta(days=day.weekday())).isoformat()


def trends_of(
    weeks: Sequence[Week], zeros: Sequence[tuple[str, float]], calibration_id: str | None, empty_mass_kg: float
) -> tuple[Trend, ...]:
    """Of the calibration in use; ``zeros`` say when the vehicle was empty and what the calibration alone read (kg)."""
    own = [week for week in weeks if week.calibration_id == calibration_id and week.n]
    least = {"damper_front": DAMPER_CHANGE_PCT, "damper_rear": DAMPER_CHANGE_PCT, "delay": DELAY_CHANGE_PCT}
    found = [
        trend_of(
            name,
            "%",
            tuple(Point(week.monday, week.sums_pct[name] / week.n, week.n) for week in own if name in week.sums_pct),
            LEAST_POINTS["week"],
            least_change,
        )
        for name, least_change in least.items()
    ]
    empty = tuple(Point(at, payload_kg, 1) for at, payload_kg in zeros)
    return (*found, trend_of("zero", "kg", empty, LEAST_POINTS["zero"], ZERO_CHANGE_SHARE * empty_mass_kg))


def trend_of(name: str, unit: str, points: tuple[Point, ...], least_points: int, least_change: float) -> Trend:
    """The median of the slopes between any two points, with its interval by Kendall's tau.

    P. K. Sen, J. Am. Stat. Assoc. 63, 1968: a few odd points move it little. Over the span from the first point to the
    last it is a change.
    """
    days = [datetime.fromisoformat(point.t).replace(tzinfo=UTC).timestamp() / 86_400.0 for point in points]
    if len(points) < least_points or days[-1] <= days[0]:
        return Trend(name, unit, points)
    slope, low, high = theil_sen(days, [point.number for point in points])
    span = days[-1] - days[0]
    change, interval = float(slope) * span, (float(low) * span, float(high) * span)
    is_clear = interval[0] > 0.0 or interval[1] < 0.0
    return Trend(name, unit, points, change, interval, is_clear and abs(change) >= least_change)


def theil_sen(x: Sequence[float], y: Sequence[float], confidence: float = CONFIDENCE) -> tuple[float, float, float]:
    """The median of the slopes between any two points (n,), and the ends of its interval.

    P. K. Sen, Estimates of the regression coefficient based on Kendall's tau (1968), with his correction for ties.
    scipy.stats has the same, and costs a vehicle's service a second and tens of megabytes to import.
    """
    slopes, variance = pair_slopes(x, y), variance_of_s(x, y)
    if variance < 0.0:  # so many ties that they say nothing of it
        return float(np.median(slopes)), math.nan, math.nan
    reach = NormalDist().inv_cdf(0.5 + confidence / 2.0) * math.sqrt(variance)
    return float(np.median(slopes)), *around_the_median(slopes, reach)


def pair_slopes(x: Sequence[float] | F64, y: Sequence[float] | F64) -> F64:
    """Slopes between any two points (n,) that differ in x, rising."""
    first, second = np.triu_indices(len(x), 1)
    apart, rise = np.asarray(x)[second] - np.asarray(x)[first], np.asarray(y)[second] - np.asarray(y)[first]
    slopes: F64 = np.sort(rise[apart != 0.0] / apart[apart != 0.0])
    return slopes


def variance_of_s(x: Sequence[float] | F64, y: Sequence[float] | F64) -> float:
    """Of Kendall's S where there is no trend, with its correction for ties; below 0 where there is little but ties."""
    return (_pairs(len(x)) - sum(map(_pairs, _ties(x))) - sum(map(_pairs, _ties(y)))) / 18.0


def around_the_median(slopes: F64, reach: float) -> tuple[float, float]:
    """The slopes that lie ``reach`` ranks of S to either side; the outermost where that is beyond them."""
    low = max(round((len(slopes) - reach) / 2.0) - 1, 0)
    high = min(round((len(slopes) + reach) / 2.0), len(slopes) - 1)
    return float(slopes[low]), float(slopes[high])


def _pairs(n: int) -> int:
    return n * (n - 1) * (2 * n + 5)


def _ties(values: Sequence[float] | F64) -> list[int]:
    """How often each value occurs."""
    return [int(n) for n in np.unique(np.asarray(values), return_counts=True)[1]]
