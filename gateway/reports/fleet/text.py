"""Text formatting of the fleet report: numbers, weeks and findings."""

import hashlib
import re
from datetime import date
from typing import Final

import polars as pl

from gateway.archive.fleet.batches import OF_SENSOR, OF_VEHICLE
from gateway.archive.fleet.drift import Drift, DriftTrend
from gateway.archive.fleet.faulty_sensors import Share, Trouble
from gateway.archive.fleet.weeks import monday_of
from gateway.estimates.reasons import EXPLANATIONS
from gateway.reports.charts import Axis
from gateway.words import NONE

MOST_TICKS: Final = 8  # chosen: more labels overlap
LEAST_WEEKS_APART: Final = 3  # names that would else lie on one another
_PLAIN: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}")
NAMES: Final = {**OF_VEHICLE, **OF_SENSOR}


def page_of(vehicle: str) -> str:
    """The file name of a vehicle's page: its id if that is a valid file name on every system, else a hash."""
    plain = vehicle if _PLAIN.fullmatch(vehicle) else hashlib.sha256(vehicle.encode()).hexdigest()[:16]
    return f"{plain}.html"


def whole(n: int) -> str:
    """An integer with its thousands separated."""
    return f"{n:,}".replace(",", "\u202f")


def percent(part: float, of: float) -> str:
    """``part`` of ``of`` in percent; a dash if ``of`` is 0."""
    return NONE if of == 0 else f"{100.0 * part / of:.{0 if 10 * part >= of else 1}f} %"


def kg(mean: float | None, low: float | None, high: float | None) -> str:
    """A load [kg] with its 95 % interval; a dash if unknown."""
    if mean is None:
        return NONE
    return f"{mean:.0f} kg" + ("" if low is None or high is None else f" ({low:.0f} to {high:.0f})")


def slope(trend: DriftTrend) -> str:
    """A slope per year with its 95 % interval."""
    return f"{trend.slope:+.2g} a year ({trend.low:+.2g} to {trend.high:+.2g})"


def day(told: date) -> str:
    """A date with non-breaking hyphens."""
    return f"{told}".replace("-", "\u2011")


def over_limit(n_over: int, n_answered: int) -> str:
    """The share of overloaded batches; a dash for none, since possibly no limit is known."""
    return percent(n_over, n_answered) if n_over else NONE


def share(told: Share) -> str:
    """A number of days out of all days, with the interval of the share."""
    low, high = told.interval95
    return f"{told.n_bad} of {told.n} days ({100 * low:.0f} to {100 * high:.0f} %)"


def trouble_told(trouble: Trouble) -> str:
    """A sentence about a sensor's recent rejections for one reason."""
    since = f", since {trouble.since}" if trouble.since else ""
    return f"refused most of the driving on {share(trouble.recent)} of the last days driven{since}"


def drift_told(drift: Drift) -> str:
    """A sentence about a significant drift and its reference."""
    against = "beyond what the fleet does" if drift.beyond else "the season not taken off: the fleet is small"
    return f"{slope(drift.judged)}, {against}; {drift.judged.n} weeks"


def every_week(weeks: pl.DataFrame) -> pl.DataFrame:
    """The weeks with a row for those in between too, unknown, so that no band or line spans a gap."""
    first, last = min(weeks["week"]), max(weeks["week"])
    return pl.select(week=pl.int_range(first, last + 1)).join(weeks, on="week", how="left")


def time_axis(weeks: pl.Series) -> Axis:
    """An axis of week numbers, labelled with the months."""
    months = [(number, f"{monday_of(number):%Y-%m}") for number in range(min(weeks), max(weeks) + 1)]
    begun = [one for k, one in enumerate(months) if k == 0 or one[1] != months[k - 1][1]]
    if len(begun) > 1 and begun[1][0] - begun[0][0] < LEAST_WEEKS_APART:
        del begun[0]
    every = -(-len(begun) // MOST_TICKS)
    return Axis("week", ticks=tuple((float(number), name) for number, name in begun[::every]))


def reason_told(reason: str) -> tuple[str, str]:
    """The cause and the remedy in words; dashes for a reason unknown to this version."""
    told = next((told for why, told in EXPLANATIONS.items() if why == reason), None)
    if told is None:
        return NONE, NONE
    return told.happened.replace("`", ""), told.advice.replace("`", "")
