"""Errors to expect of loads that calibration has not seen: every run judged by what the other runs teach."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from gateway.calibration.evaluation import Judged
from gateway.core.known_run import KnownRun
from gateway.core.ratio_index import RatioIndexCalibration, indexes_of
from gateway.core.regression import RegressionModel, scaled_columns
from gateway.offline.calibrate import Outcome, judge
from gateway.records import F64, I64, Bool

LEAST_RUNS: Final = 3


@dataclass(frozen=True, slots=True)
class IndexRows:
    """Run number, payload, front share, R_a and R_g (n,) of every batch that has the indexes its vehicle wants."""

    run: I64
    payload_kg: F64
    front_share_pct: F64
    ra: F64
    rg: F64


def index_rows(runs: Sequence[KnownRun], calibration: RatioIndexCalibration) -> IndexRows:
    """The ratio indexes of all sound batches of ``runs``; an index whose bands are not calibrated is NaN."""
    wanted = [calibration.acceleration_bands is not None, calibration.pitch_rate_bands is not None]
    rows = [
        (run.number, run.payload_kg, run.front_share_pct, *indexes_of(batch, calibration))
        for run in runs
        for batch in run.batches
        if not batch.rejected
    ]
    kept = np.array([row for row in rows if np.all(np.isfinite(row[3:])[wanted])], dtype=float).reshape(-1, 5)
    return IndexRows(kept[:, 0].astype(np.int64), *kept[:, 1:].T)


def judged_left_out(outcome: Outcome, estimator: str) -> list[Judged]:
    """Every identification batch with its estimate by a calibration from the other runs.

    Empty where fewer than three runs leave nothing to learn from. What is chosen from all runs stays:
    of the ratio index the bands, the terms and the residual spread, of the cross-spectral estimator by
    how much intervals are widened. Errors are therefore a little kinder than those of a new load.
    """
    runs = [one.identification for one in outcome.split]
    whole = outcome.file.for_core()
    without: Mapping[int, Any] = outcome.cross_spectrum_without
    if estimator == "ratio_index":
        without = _ratio_index_without(whole.ratio_index, runs) if whole.ratio_index else {}
    return [
        one
        for run in runs
        if run.number in without
        for one in judge(run, replace(whole, **{estimator: without[run.number]}), estimator)
    ]


def _ratio_index_without(
    calibration: RatioIndexCalibration, runs: Sequence[KnownRun]
) -> dict[int, RatioIndexCalibration]:
    """By run number: the same bands and terms, fitted to the other runs."""
    rows = index_rows(runs, calibration)
    numbers = np.unique(rows.run).tolist()
    return {
        number: replace(
            calibration,
            payload=_refitted(calibration.payload, rows, rows.payload_kg, rows.run != number),
            front_share=_refitted(calibration.front_share, rows, rows.front_share_pct, rows.run != number),
        )
        for number in numbers
        if len(numbers) >= LEAST_RUNS
    }


def _refitted(model: RegressionModel | None, rows: IndexRows, target: F64, kept: Bool) -> RegressionModel | None:
    """The same terms by least squares over the rows kept."""
    if model is None:
        return None
    columns = scaled_columns(model.terms, rows.ra[kept], rows.rg[kept], model.lows, model.highs)
    gram_inverse: F64 = np.linalg.pinv(columns.T @ columns).astype(float)
    return replace(model, coefficients=gram_inverse @ columns.T @ target[kept], gram_inverse=gram_inverse)
