"""Faulty sensors: the days on which a sensor's reason refused most of the driving, and the start of the fault."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date, timedelta
from enum import StrEnum
from typing import Final

import numpy as np
import polars as pl
from scipy.special import xlogy
from scipy.stats import binomtest

from gateway.archive.fleet.batches import REASONS_OF
from gateway.estimates.reasons import Cause
from gateway.records import F64, I64, Bool

BAD_DAY_SHARE: Final = 0.5  # chosen: of a day's batches that the reason refused; batches of a day are correlated
RECENT_DAYS: Final = 14  # chosen: the last days on which the vehicle drove
LEAST_DAYS: Final = 5  # chosen: fewer are an incident, not a fault
BAD_SHARE: Final = 0.2  # chosen: with certainly more bad days the sensor is bad
LEAST_LIKELIHOOD_RATIO: Final = 12.0  # chosen: twice the logarithm, for a day that separates good from bad


class Health(StrEnum):
    """How often a sensor has caused refusals for one reason."""

    BAD = "bad"  # now: surely more than BAD_SHARE of the recent days
    WAS_BAD = "was bad"  # had as many bad days in a row as make a sensor bad, but not now
    SOME = "now and then"


@dataclass(frozen=True, slots=True)
class Share:
    """``n_bad`` of ``n`` and the 95 % interval of the share behind it (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927)."""

    n_bad: int
    n: int
    interval95: tuple[float, float]

    @classmethod
    def of(cls, n_bad: int, n: int) -> "Share":
        interval = binomtest(n_bad, n).proportion_ci(method="wilson")
        return cls(n_bad, n, (float(interval.low), float(interval.high)))

    @property
    def is_surely_bad(self) -> bool:
        return self.n >= LEAST_DAYS and self.interval95[0] > BAD_SHARE


@dataclass(frozen=True, slots=True)
class Trouble:
    """One reason of the sensors in one vehicle: batches, days, its state, and its start if it is bad."""

    reason: str
    n_batches: int
    days: Share
    recent: Share
    health: Health
    first: date
    last: date
    since: date | None = None


def date_of(day: int) -> date:
    """The date so many days after 1970-01-01."""
    return date(1970, 1, 1) + timedelta(days=day)


def troubles_of(batches: pl.DataFrame) -> tuple[Trouble, ...]:
    """Every reason of the sensors that refused a batch (``read_batches``), the worst first."""
    return tuple(sorted(_troubles(batches), key=lambda one: (list(Health).index(one.health), -one.n_batches)))


def _troubles(batches: pl.DataFrame) -> Iterator[Trouble]:
    for reason in REASONS_OF[Cause.SENSORS]:
        refused = pl.col("rejected").list.contains(reason)
        days = batches.group_by("day", maintain_order=True).agg(refused.sum().alias("n"), refused.mean().alias("share"))
        met = days.filter(pl.col("n") > 0)
        if len(met):
            is_bad = days["share"].to_numpy() >= BAD_DAY_SHARE
            ends = date_of(met["day"][0]), date_of(met["day"][-1])
            yield _trouble(reason, int(met["n"].sum()), days["day"].to_numpy(), is_bad, ends)


def _trouble(reason: str, n_batches: int, days: I64, is_bad: Bool, met: tuple[date, date]) -> Trouble:
    recent = Share.of(int(is_bad[-RECENT_DAYS:].sum()), len(is_bad[-RECENT_DAYS:]))
    n_bad = np.convolve(is_bad, np.ones(RECENT_DAYS, dtype=np.int64))[RECENT_DAYS - 1 :]  # from each day on
    was_bad = len(is_bad) >= RECENT_DAYS and Share.of(int(n_bad.max()), RECENT_DAYS).is_surely_bad
    health = Health.BAD if recent.is_surely_bad else Health.WAS_BAD if was_bad else Health.SOME
    since = date_of(int(days[_first_of_the_bad(is_bad)])) if health is Health.BAD else None
    return Trouble(reason, n_batches, Share.of(int(is_bad.sum()), len(is_bad)), recent, health, *met, since)


def _first_of_the_bad(is_bad: Bool) -> int:
    """The day that best divides the days into two with a share of bad ones each, by the binomial likelihood.

    The first bad day if no division is much likelier than none, or if there were more bad days before it.
    """
    n, total = len(is_bad), int(is_bad.sum())
    before = np.arange(1, n, dtype=np.int64)
    bad_before = np.cumsum(is_bad, dtype=np.int64)[:-1]
    divided = _log_likelihood(bad_before, before) + _log_likelihood(total - bad_before, n - before)
    ratio = 2.0 * (divided - _log_likelihood(np.array([total]), np.array([n])))
    rising = (total - bad_before) / (n - before) > bad_before / before
    if n > 1 and np.any(chosen := rising & (ratio > LEAST_LIKELIHOOD_RATIO)):
        return int(np.argmax(np.where(chosen, ratio, -np.inf))) + 1
    return int(np.argmax(is_bad))


def _log_likelihood(n_bad: I64, n: I64) -> F64:
    """Log likelihood of n_bad among n with its most likely share."""
    return np.asarray(xlogy(n_bad, n_bad / n) + xlogy(n - n_bad, 1.0 - n_bad / n), float)
