"""Errors to expect of loads that calibration has not seen: every run judged by what the other runs teach."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from scipy.special import stdtrit

from gateway.calibration.calibrate import Outcome
from gateway.calibration.judgement.evaluation import Judged, judge
from gateway.calibration.known_run import KnownRun
from gateway.calibration.ratio_index.fit import RatioIndexFit
from gateway.core.ratio_index.index import RatioIndexCalibration, indexes_of
from gateway.core.ratio_index.regression import RegressionModel, scaled_columns
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

    Empty where fewer than three runs leave nothing to learn from. The ratio index chooses its bands and
    terms anew without each run, where enough runs are left for that. By how much intervals are widened
    stays as found on all runs: the errors are those of a new load, the coverage is a little kinder.
    """
    runs = [one.identification for one in outcome.split]
    whole = outcome.file.for_core()
    if estimator == "ratio_index" and outcome.ratio_index is not None:
        if _is_nested(outcome.ratio_index):
            return [_nested(one, outcome.ratio_index) for run in runs for one in judge(run, whole, estimator)]
        without: Mapping[int, Any] = _ratio_index_without(outcome.ratio_index.calibration, runs)
    else:
        without = outcome.cross_spectrum_without
    return [
        one
        for run in runs
        if run.number in without
        for one in judge(run, replace(whole, **{estimator: without[run.number]}), estimator)
    ]


def _models(fit: RatioIndexFit) -> tuple[RegressionModel | None, RegressionModel | None]:
    return fit.calibration.payload, fit.calibration.front_share


def _is_nested(fit: RatioIndexFit) -> bool:
    """Whether every target told was also told by choices that did not see the run."""
    told = [row for row, model in enumerate(_models(fit)) if model is not None]
    return bool(np.isfinite(fit.chosen.nested.error[told]).all())


def _nested(one: Judged, fit: RatioIndexFit) -> Judged:
    """The same batch with what a choice of bands and terms answers that did not see its run."""
    is_here = (fit.table.number == one.run) & (fit.table.t_start_ns == one.estimate.t_start_ns)
    if not is_here.any():
        return one
    row = int(np.flatnonzero(is_here)[0])
    (payload_kg, payload_std_kg, payload95_kg), (share_pct, share_std_pct, share95_pct) = (
        _answer(fit, target, row, truth) for target, truth in enumerate((one.payload_kg, one.front_share_pct))
    )
    answered = replace(
        one.estimate,
        rejected=(),
        payload_kg=payload_kg,
        payload_std_kg=payload_std_kg,
        payload_interval95_kg=payload95_kg,
        front_share_pct=share_pct,
        front_share_std_pct=share_std_pct,
        front_share_interval95_pct=share95_pct,
    )
    return replace(one, estimate=answered)


def _answer(fit: RatioIndexFit, target: int, row: int, truth: float) -> tuple[float, float, tuple[float, float]]:
    """Estimate, its standard deviation widened as in the calibration, and 95 % interval; NaN where none is told."""
    model, tried, nested = _models(fit)[target], fit.chosen.choice.tried[target], fit.chosen.nested
    if model is None or tried is None:
        return math.nan, math.nan, (math.nan, math.nan)
    centre = truth + float(nested.error[target, row])
    std = float(nested.std[target, row]) * model.residual_std / tried.fitted.model.residual_std
    half = float(stdtrit(model.dof, 0.975)) * std
    return centre, std, (centre - half, centre + half)


def _ratio_index_without(
    calibration: RatioIndexCalibration, runs: Sequence[KnownRun]
) -> dict[int, RatioIndexCalibration]:
    """By run number: the same bands and terms, fitted to the other runs; for campaigns too small to choose anew."""
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
