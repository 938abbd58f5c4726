"""Faulty sensors: the days on which a sensor's reason refused most of the driving, and the start of the fault."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from enum import StrEnum
from typing import Final

import numpy as np

from gateway.archive.fleet.batches import Batches
from gateway.archive.fleet.weeks import CAUSES, DAY_NS, date_of
from gateway.estimates.batch_estimate import Z95
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

    @property
    def interval95(self) -> tuple[float, float]:
        """(0, 1) without data."""
        if self.n == 0:
            return 0.0, 1.0
        share, z2 = self.n_bad / self.n, Z95**2
        middle = (share + z2 / (2 * self.n)) / (1 + z2 / self.n)
        reach = Z95 / (1 + z2 / self.n) * math.sqrt(share * (1 - share) / self.n + z2 / (4 * self.n**2))
        return max(0.0, middle - reach), min(1.0, middle + reach)

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


def troubles_of(batches: Batches) -> tuple[Trouble, ...]:
    """Every reason of the sensors that refused a batch, the worst first."""
    return tuple(sorted(_troubles(batches), key=lambda one: (list(Health).index(one.health), -one.n_batches)))


def _troubles(batches: Batches) -> Iterator[Trouble]:
    day_of = batches.t_end_ns // DAY_NS
    days, first, n = np.unique(day_of, return_index=True, return_counts=True)
    for reason, refused in batches.rejected.items():
        if CAUSES.get(reason) is Cause.SENSORS and refused.any():
            is_bad = np.add.reduceat(refused.astype(np.int64), first) >= BAD_DAY_SHARE * n
            met = day_of[refused]
            yield _trouble(reason, int(refused.sum()), days, is_bad, (date_of(met[0]), date_of(met[-1])))


def _trouble(reason: str, n_batches: int, days: I64, is_bad: Bool, met: tuple[date, date]) -> Trouble:
    recent = Share(int(is_bad[-RECENT_DAYS:].sum()), len(is_bad[-RECENT_DAYS:]))
    n_bad = np.convolve(is_bad, np.ones(RECENT_DAYS, dtype=np.int64))[RECENT_DAYS - 1 :]  # from each day on
    was_bad = len(is_bad) >= RECENT_DAYS and Share(int(n_bad.max()), RECENT_DAYS).is_surely_bad
    health = Health.BAD if recent.is_surely_bad else Health.WAS_BAD if was_bad else Health.SOME
    since = date_of(days[_first_of_the_bad(is_bad)]) if health is Health.BAD else None
    return Trouble(reason, n_batches, Share(int(is_bad.sum()), len(is_bad)), recent, health, *met, since)


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
    share = n_bad / n
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.where(n_bad > 0, n_bad * np.log(share), 0.0) + np.where(
            n_bad < n, (n - n_bad) * np.log1p(-share), 0.0
        )
    likelihood: F64 = parts
    return likelihood
