"""What the regressions of the ratio index state of their coefficients is true."""

import numpy as np
import pytest
from scipy import stats

from gateway.calibration.ratio_index.least_squares import fit_regression, held_out_errors, without_each_run
from gateway.core.ratio_index.regression import scaled_columns
from gateway.records import F64, I64

N_SEEDS = 300


def indexes(seed: int, n_runs: int, per_run: int = 2) -> tuple[F64, F64, I64]:
    """R_a and R_g that differ between runs and scatter a little within them, as a campaign's do."""
    rng = np.random.default_rng(seed)
    run = np.repeat(np.arange(n_runs), per_run)
    ra, rg = np.exp(0.4 * rng.standard_normal((2, n_runs)))[:, run]
    return ra * np.exp(0.05 * rng.standard_normal(len(run))), rg * np.exp(0.05 * rng.standard_normal(len(run))), run


@pytest.mark.parametrize("shared", [0.0, 0.5, 1.0])
def test_a_known_model_returns_its_coefficients_within_their_stated_covariance(shared: float) -> None:
    """Hotelling's T^2 of the coefficients' errors follows F, whatever part of an error the batches of a run share."""
    terms, n_runs = ("log_ra", "log_rg"), 40
    truth, chi2 = np.array([200.0, 120.0, -60.0]), []
    ra, rg, run = indexes(1, n_runs)
    lows, highs = np.log([ra.min(), rg.min()]), np.log([ra.max(), rg.max()])
    exact = scaled_columns(terms, ra, rg, lows, highs) @ truth
    for seed in range(N_SEEDS):
        rng = np.random.default_rng(2000 + seed)
        of_run, of_batch = rng.standard_normal(n_runs)[run], rng.standard_normal(len(run))
        target = exact + 20.0 * (np.sqrt(shared) * of_run + np.sqrt(1.0 - shared) * of_batch)
        fitted = fit_regression(terms, ra, rg, target, run)
        error = fitted.model.coefficients - truth
        chi2.append(error @ np.linalg.solve(fitted.covariance, error))
    p, dof = len(truth), n_runs - len(truth)
    f = np.array(chi2) * dof / (p * (n_runs - 1.0))
    # the jackknife states rather too much than too little: a tenth at most
    assert 0.75 < np.mean(f) * (dof - 2.0) / dof < 1.15
    assert 0.91 < np.mean(f < stats.f.ppf(0.95, p, dof)) <= 0.99


def test_many_designs_at_once_are_each_fitted_as_if_alone() -> None:
    rng = np.random.default_rng(9)
    run = np.array([0, 0, 1, 1, 1, 2, 3, 3, 4, 4])
    columns = np.concatenate([np.ones((3, 10, 1)), rng.standard_normal((3, 10, 2))], axis=-1)
    target = rng.standard_normal(10)
    errors = held_out_errors(columns, without_each_run(columns, target, run)[0], target, run)
    for i in range(3):
        for number in range(5):
            out = run == number
            coefficients = np.linalg.lstsq(columns[i][~out], target[~out], rcond=None)[0]
            np.testing.assert_allclose(errors[i, out], columns[i][out] @ coefficients - target[out], atol=1e-8)
