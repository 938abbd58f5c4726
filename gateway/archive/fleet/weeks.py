"""A vehicle week by week: its loads with their uncertainty, its refusals, and its parameters."""

from datetime import date, timedelta
from typing import Final

import polars as pl

from gateway.archive.fleet.batches import DAYS_BEFORE, DRIFTING
from gateway.estimates.batch_estimate import Z95
from gateway.estimates.reasons import Cause

_MONDAY: Final = date(1969, 12, 29)  # of week 0, which holds the first of January 1970


def monday_of(week: int) -> date:
    """The first day of a week by its number."""
    return _MONDAY + timedelta(weeks=week)


def weeks_of(batches: pl.DataFrame) -> pl.DataFrame:
    """A row for each week with batches (``read_batches``); unknown is null, never 0.

    ``payload_mean_kg`` is over the answered batches with a payload (a calibration may tell the front share alone). Its
    95 % interval includes the errors common to batches in full, and reduces their own errors by their number; an
    unknown own part counts as common to all, which is never too narrow. Each parameter's median is over refused batches
    too, because otherwise a refusal would hide the drift that caused it.
    """
    is_told = pl.col("is_answered") & pl.col("payload_kg").is_not_null()
    payload, std = (pl.col(name).filter(is_told) for name in ("payload_kg", "payload_std_kg"))
    own = pl.min_horizontal(pl.col("payload_own_std_kg").fill_null(0.0), "payload_std_kg").filter(is_told)
    common = (std**2 - own**2).sqrt()
    std_of_mean = (common.mean() ** 2 + (own**2).sum() / own.len() ** 2).sqrt()
    weeks = batches.group_by("week", maintain_order=True).agg(
        pl.len().alias("n"),
        pl.col("is_answered").sum().alias("n_answered"),
        (pl.col("is_answered") & (pl.col("over_limit").list.len() > 0)).sum().alias("n_over_limit"),
        *(pl.col(str(cause)).sum() for cause in Cause),
        payload.mean().alias("payload_mean_kg"),
        (payload.mean() - Z95 * std_of_mean).alias("payload_low_kg"),
        (payload.mean() + Z95 * std_of_mean).alias("payload_high_kg"),
        payload.quantile(0.25, "linear").alias("payload_lower_quartile_kg"),
        payload.quantile(0.75, "linear").alias("payload_upper_quartile_kg"),
        *(pl.col(name).median() for name in DRIFTING),
    )
    monday = (7 * pl.col("week") - DAYS_BEFORE).cast(pl.Int32).cast(pl.Date)
    return weeks.with_columns(monday=monday)
