"""A vehicle week by week: its loads with their uncertainty, its refusals, and its parameters."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, timedelta
from typing import Final

import numpy as np

from gateway.archive.fleet.batches import DRIFTING, Batches
from gateway.estimates.batch_estimate import Z95
from gateway.estimates.reasons import EXPLANATIONS, Cause
from gateway.records import F64, I64, Bool, Why
from gateway.units import NS_PER_S

DAY_NS: Final = 86_400 * NS_PER_S  # nanoseconds
_MONDAY: Final = date(1969, 12, 29)  # of the week that holds the first of January 1970
_DAYS_BEFORE: Final = 3  # from _MONDAY to 1970-01-01
CAUSES: Final[Mapping[str, Cause]] = {str(why): told.cause for why, told in EXPLANATIONS.items()}


@dataclass(frozen=True, slots=True, eq=False)
class Weeks:
    """Arrays (m,), one week with batches each, UTC, from Monday; NaN where unknown, never 0.

    ``payload_mean_kg`` is over the batches with a payload; its 95 % interval includes the errors common to batches in
    full, and reduces their own errors by their number. The quartiles are those of the payload. ``medians`` include
    refused batches, because otherwise a refusal would hide the drift that caused it.
    """

    number: I64
    n: I64
    n_answered: I64
    n_over_limit: I64
    n_refused_by: Mapping[Cause, I64]
    payload_mean_kg: F64
    payload_low_kg: F64
    payload_high_kg: F64
    payload_lower_quartile_kg: F64
    payload_upper_quartile_kg: F64
    medians: Mapping[str, F64]
    n_medians: Mapping[str, I64]

    @property
    def mondays(self) -> tuple[date, ...]:
        return tuple(monday_of(int(number)) for number in self.number)


def date_of(day: int) -> date:
    """The date so many days after 1970-01-01."""
    return date(1970, 1, 1) + timedelta(days=int(day))


def monday_of(number: int) -> date:
    return _MONDAY + timedelta(weeks=number)


def weeks_of(batches: Batches) -> Weeks:
    week_of = (batches.t_end_ns // DAY_NS + _DAYS_BEFORE) // 7
    number, first, n = np.unique(week_of, return_index=True, return_counts=True)
    answered = batches.is_answered
    in_week = [slice(begin, begin + count) for begin, count in zip(first, n, strict=True)]
    mean, low, high, lower, upper = np.array([_payload(batches, one, answered[one]) for one in in_week]).T
    medians = {name: batches.numbers[name] for name in DRIFTING}
    return Weeks(
        number,
        n,
        _sums(answered, first),
        _sums(batches.is_over_limit & answered, first),
        {cause: _sums(_refused_by(batches, cause), first) for cause in Cause},
        mean,
        low,
        high,
        lower,
        upper,
        {name: np.array([_median(numbers[one]) for one in in_week]) for name, numbers in medians.items()},
        {name: _sums(np.isfinite(numbers), first) for name, numbers in medians.items()},
    )


def _refused_by(batches: Batches, cause: Cause) -> Bool:
    """Batches (n,) refused by one of the cause's reasons, possibly with others."""
    of_cause = [rows for reason, rows in batches.rejected.items() if CAUSES.get(reason) is cause]
    found: Bool = np.any([np.zeros(len(batches), dtype=bool), *of_cause], axis=0)
    return found


def known_reason(reason: str) -> Why | None:
    """The reason of this name; None if a newer version wrote it."""
    return Why(reason) if reason in CAUSES else None


def _payload(batches: Batches, of_week: slice, answered: Bool) -> tuple[float, float, float, float, float]:
    """Mean, its interval, and the quartiles; NaN without a payload."""
    payload, std, own = (
        batches.numbers[name][of_week][answered] for name in ("payload_kg", "payload_std_kg", "payload_own_std_kg")
    )
    told = np.isfinite(payload)  # a calibration may tell the front share alone
    payload, std, own = payload[told], std[told], own[told]
    if payload.size == 0:
        return (np.nan,) * 5
    mean = float(np.mean(payload))
    reach = Z95 * _std_of_mean(std, own)
    lower, upper = np.quantile(payload, [0.25, 0.75])
    return mean, mean - reach, mean + reach, float(lower), float(upper)


def _std_of_mean(std: F64, own: F64) -> float:
    """Standard deviation of a mean of numbers with errors ``std``, of which ``own`` are independent.

    An unknown own part counts as common to all, which is never too narrow.
    """
    own = np.minimum(np.where(np.isfinite(own), own, 0.0), std)
    common = np.sqrt(std**2 - own**2)
    return float(np.hypot(np.mean(common), np.sqrt(np.sum(own**2)) / len(std)))


def _median(numbers: F64) -> float:
    known = numbers[np.isfinite(numbers)]
    return float(np.median(known)) if known.size else np.nan


def _sums(rows: Bool, first: I64) -> I64:
    counts: I64 = np.add.reduceat(rows.astype(np.int64), first)
    return counts
