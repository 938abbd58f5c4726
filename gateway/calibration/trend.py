"""Changes of a vehicle and its gyro since calibration, from batches, week by week.

Each batch estimates its dampers and the scale of its delay beside the load (core.cross_spectrum.drift), and bends give
the gyro's gain (core.bends). A trend is a robust slope over months. A level is the mean of the newest batches, which
shows sudden changes. The search's prior holds the delay near its calibration: the true change is larger than the
estimated one. Springs are not estimated per batch; their change moves the zero, which each "it is empty now" shows.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from statistics import NormalDist
from types import MappingProxyType
from typing import Final, Literal

import numpy as np
from pydantic import Field

from gateway.estimate import Estimate
from gateway.records import F64, Why
from gateway.stated.facts import Part
from gateway.units import NS_PER_S

FILE_NAME: Final = "trend.json"
MOST_WEEKS: Final = 520  # chosen: of all calibrations together, ten years; the newest are kept
LEAST_POINTS: Final = {"week": 8, "zero": 5}  # chosen: weeks, and readings of the empty vehicle, for a robust slope
CONFIDENCE: Final = 0.99  # chosen: of a change's interval
LEAST_BATCHES: Final = 24  # chosen: for a level; two hours, seldom with a single load or road
ALIKE_BATCHES: Final = 6  # chosen: batches of one load and road with correlated errors
ZERO_CHANGE_SHARE: Final = 0.01  # chosen: of the empty mass


@dataclass(frozen=True, slots=True)
class WatchedParameter:
    """A parameter whose trend is kept, and the diagnostic that reports it: a ratio to the calibrated, or a deviation.

    A trend below ``least_change_pct`` or a level below ``least_level_pct`` is no finding; without the latter no level
    is reported. ``lower`` and ``higher`` put a level into words. All limits are chosen.
    """

    diagnostic: str
    least_change_pct: float
    is_ratio: bool = True
    least_level_pct: float | None = None
    lower: str = ""
    higher: str = ""

    def off_pct(self, found: float) -> float | None:
        """Deviation of a batch's diagnostic from the calibration, in percent; None without a value."""
        if not self.is_ratio:
            return 100.0 * found
        return 100.0 * math.log(found) if found > 0.0 else None


def _dampers(which: str) -> WatchedParameter:
    return WatchedParameter(
        f"damper_{which}_freed_ratio",
        least_change_pct=5.0,  # the search's prior allows a damper 3 % (core.cross_spectrum.drift)
        least_level_pct=20.0,  # on rough roads friction hides this much of them in single batches
        lower=f"the {which} dampers are {{:.0f}} % weaker",
        higher=f"the {which} dampers are {{:.0f}} % stiffer",
    )


WATCHED: Final[Mapping[str, WatchedParameter]] = MappingProxyType(
    {
        "damper_front": _dampers("front"),
        "damper_rear": _dampers("rear"),
        "delay": WatchedParameter(
            "delay_scale", least_change_pct=1.0, is_ratio=False
        ),  # the search's prior allows 0.3 %
        "gyro_gain": WatchedParameter(
            "gyro_gain_ratio",
            least_change_pct=2.0,  # temperature alone moves it by 0.4 %
            least_level_pct=2.0,
            lower="the gyro's gain is {:.1f} % smaller",
            higher="the gyro's gain is {:.1f} % larger",
        ),
    }
)


class Sums(Part):
    """Sums over n batches of one parameter's deviation from the calibration, in percent."""

    n: int = Field(ge=1)
    sum_pct: float
    square_pct2: float

    def plus(self, other: "Sums") -> "Sums":
        """The sums of both."""
        return Sums(
            n=self.n + other.n,
            sum_pct=self.sum_pct + other.sum_pct,
            square_pct2=self.square_pct2 + other.square_pct2,
        )


class Week(Part):
    """The parameters found in the batches of one week."""

    monday: str
    calibration_id: str
    found: dict[str, Sums]


class TrendHistory(Part):
    """All weeks up to ``cursor`` in the store's history, oldest first."""

    format: Literal["springscale-trend"] = "springscale-trend"
    version: Literal[2] = 2
    cursor: str | None = None
    weeks: tuple[Week, ...] = Field((), max_length=MOST_WEEKS)

    def with_batches(self, estimates: Iterable[Estimate], cursor: str | None) -> "TrendHistory":
        """The history with more batches, in any order; those without parameters are ignored."""
        weeks = {(week.monday, week.calibration_id): week for week in self.weeks}
        for estimate in estimates:
            if (found := found_pct(estimate)) is None or estimate.calibration_id is None:
                continue
            key = (monday_of(estimate.t_end_ns), estimate.calibration_id)
            before = weeks.get(key, Week(monday=key[0], calibration_id=key[1], found={})).found
            now = {name: Sums(n=1, sum_pct=pct, square_pct2=pct**2) for name, pct in found.items()}
            summed = {name: one.plus(before[name]) if name in before else one for name, one in now.items()}
            weeks[key] = Week(monday=key[0], calibration_id=key[1], found={**before, **summed})
        kept = tuple(weeks[key] for key in sorted(weeks))[-MOST_WEEKS:]
        return self.model_copy(update={"cursor": cursor, "weeks": kept})


@dataclass(frozen=True, slots=True)
class TrendPoint:
    """One mean: its time, its value and the number of batches."""

    t: str
    number: float
    n: int


@dataclass(frozen=True, slots=True)
class Trend:
    """A parameter's course and its change from the first point to the last; None with too few points.

    ``interval99`` is that of the change; it drifts if this excludes 0 and the change is not small. ``level`` is the
    newest batches' deviation from the calibration, ``level99`` its interval; it is off if this excludes 0 and the level
    is not small.
    """

    name: str
    unit: str
    points: tuple[TrendPoint, ...]
    change: float | None = None
    interval99: tuple[float, float] | None = None
    is_drifting: bool = False
    level: float | None = None
    level99: tuple[float, float] | None = None
    is_off: bool = False

    def sentence(self) -> str | None:
        """The warning if it is off or drifts."""
        if self.is_off and self.level is not None and self.level99 is not None:
            low, high = sorted(abs(end) for end in self.level99)
            watched = WATCHED[self.name]
            said = (watched.higher if self.level > 0.0 else watched.lower).format(abs(self.level))
            return f"{said} than at calibration ({low:.1f} to {high:.1f} %, 99 %): look at them, and calibrate again"
        if not self.is_drifting or self.change is None or self.interval99 is None:
            return None
        low, high = self.interval99
        return (
            f"{self.name.replace('_', ' ')} has drifted by {self.change:+.1f} {self.unit} ({low:+.1f} to {high:+.1f}, "
            f"99 %) since {self.points[0].t[:10]}: verify with a known load, and look at the vehicle"
        )


def found_pct(estimate: Estimate) -> dict[str, float] | None:
    """A batch's parameters of vehicle and gyro, in percent off the calibration; None without any.

    A vehicle that drifts far is refused as a misfit, a changed gain of the gyro as a changed sensor. Such batches count
    too, for the gyro alone if the sensor changed.
    """
    if estimate.rejected == (Why.SENSOR_CHANGED,):
        believed = {"gyro_gain"}
    elif estimate.counted or estimate.rejected == (Why.MODEL_MISFIT,):
        believed = set(WATCHED)
    else:
        return None
    found = {}
    for name, watched in WATCHED.items():
        number = estimate.diagnostics.get(watched.diagnostic, math.nan)
        if name in believed and math.isfinite(number) and (off_pct := watched.off_pct(number)) is not None:
            found[name] = off_pct
    return found or None


def monday_of(t_ns: int) -> str:
    """The week of a stamp, as the date of its Monday."""
    day = datetime.fromtimestamp(t_ns // NS_PER_S, UTC).date()
    return (day - timedelta(days=day.weekday())).isoformat()


def trends_of(
    weeks: Sequence[Week], zeros: Sequence[tuple[str, float]], calibration_id: str | None, empty_mass_kg: float
) -> tuple[Trend, ...]:
    """Trends for the calibration in use; ``zeros`` are times when the vehicle was empty with the payload (kg) read
    then.
    """
    own = [week for week in weeks if week.calibration_id == calibration_id]
    found = []
    for name, watched in WATCHED.items():
        sums = [(week.monday, week.found[name]) for week in own if name in week.found]
        points = tuple(TrendPoint(monday, one.sum_pct / one.n, one.n) for monday, one in sums)
        trend = trend_of(name, "%", points, LEAST_POINTS["week"], watched.least_change_pct)
        found.append(_with_level(trend, [one for _, one in sums]))
    empty = tuple(TrendPoint(at, payload_kg, 1) for at, payload_kg in zeros)
    return (*found, trend_of("zero", "kg", empty, LEAST_POINTS["zero"], ZERO_CHANGE_SHARE * empty_mass_kg))


def _with_level(trend: Trend, weeks: Sequence[Sums]) -> Trend:
    """The mean of the newest batches, relative to the calibrated value; ``weeks`` are the trend's, oldest first."""
    newest: Sums | None = None
    for week in reversed(weeks):
        newest = week if newest is None else newest.plus(week)
        if newest.n >= LEAST_BATCHES:
            break
    least_pct = WATCHED[trend.name].least_level_pct
    if newest is None or newest.n < LEAST_BATCHES or least_pct is None:
        return trend
    mean = newest.sum_pct / newest.n
    variance = max(newest.square_pct2 / newest.n - mean**2, 0.0)
    reach = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2.0) * math.sqrt(variance * ALIKE_BATCHES / newest.n)
    level, low, high = (100.0 * math.expm1(pct / 100.0) for pct in (mean, mean - reach, mean + reach))
    is_clear = low > 0.0 or high < 0.0
    return replace(trend, level=level, level99=(low, high), is_off=is_clear and abs(level) >= least_pct)


def trend_of(name: str, unit: str, points: tuple[TrendPoint, ...], least_points: int, least_change: float) -> Trend:
    """The median of the slopes between any two points, with its interval by Kendall's tau.

    P. K. Sen, J. Am. Stat. Assoc. 63, 1968: robust against a few outliers. The change is the slope times the span from
    the first point to the last.
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
    scipy.stats has the same, but its import costs the service a second and tens of megabytes.
    """
    slopes, variance = pair_slopes(x, y), variance_of_s(x, y)
    if variance < 0.0:  # too many ties for an interval
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
    """Variance of Kendall's S without a trend, with its correction for ties; below 0 with hardly anything but ties."""
    return (_pairs(len(x)) - sum(map(_pairs, _ties(x))) - sum(map(_pairs, _ties(y)))) / 18.0


def around_the_median(slopes: F64, reach: float) -> tuple[float, float]:
    """The slopes ``reach`` ranks of S on either side of the median, or the outermost ones."""
    low = max(round((len(slopes) - reach) / 2.0) - 1, 0)
    high = min(round((len(slopes) + reach) / 2.0), len(slopes) - 1)
    return float(slopes[low]), float(slopes[high])


def _pairs(n: int) -> int:
    return n * (n - 1) * (2 * n + 5)


def _ties(values: Sequence[float] | F64) -> list[int]:
    """How often each value occurs."""
    return [int(n) for n in np.unique(np.asarray(values), return_counts=True)[1]]
