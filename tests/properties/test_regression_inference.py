"""What the regressions of the ratio index state of themselves is true: coefficients, F-tests, p-values."""

import numpy as np
import pytest
import statsmodels.api as sm
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from gateway.calibration.ratio_index.bands import run_means
from gateway.calibration.ratio_index.regression import fit_regression, held_out_errors, without_each_run
from gateway.calibration.ratio_index.stepwise import partial_f, select_stepwise
from gateway.core.ratio_index.regression import TERMS, scaled_columns
from gateway.records import F64, I64

LIBRARY = tuple(TERMS)
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


@given(seed=st.integers(0, 10_000), n_kept=st.integers(0, 3), n_added=st.integers(1, 3))
def test_the_partial_f_test_is_that_of_statsmodels(seed: int, n_kept: int, n_added: int) -> None:
    rng = np.random.default_rng(seed)
    kept = np.column_stack([np.ones(12), rng.standard_normal((12, n_kept))])
    added, target = rng.standard_normal((12, n_added)), rng.standard_normal(12)
    found = partial_f(kept, added, target)
    whole = sm.OLS(target, np.column_stack([kept, added])).fit()
    statistic, p_value, _ = whole.compare_f_test(sm.OLS(target, kept).fit())
    assert found.statistic == pytest.approx(statistic, rel=1e-6, abs=1e-9)
    assert found.p_value == pytest.approx(p_value, rel=1e-6)
    assert found.dof == whole.df_resid


def test_what_adds_nothing_has_no_p_value() -> None:
    columns = np.column_stack([np.ones(8), np.arange(8.0)])
    assert np.isnan(partial_f(columns, 2.0 * columns[:, [1]] - 3.0, np.arange(8.0) ** 2).p_value)
    assert np.isnan(partial_f(columns[:2], np.array([[1.0], [5.0]]), np.array([0.0, 1.0])).p_value)


def test_p_values_are_uniform_for_a_fixed_regressor_on_noise_but_not_for_a_selected_one() -> None:
    """The reason why a stepwise selection's p-values prove nothing, and why runs left out have the last word."""
    ra, rg, run = indexes(2, 12)
    raw = np.column_stack([np.ones(len(run)), np.log(ra), np.log(rg)])
    means = run_means(run, raw)
    fixed, selected, n_selected = [], [], 0
    for seed in range(N_SEEDS):
        rng = np.random.default_rng(1000 + seed)
        noise = 0.3 * rng.standard_normal(len(run)) + rng.standard_normal(12)[run]
        fixed.append(partial_f(means[:, :2], means[:, 2:], run_means(run, noise)).p_value)
        found = select_stepwise(LIBRARY, ra, rg, noise, run, p_enter=1.01)
        if found.steps:
            n_selected += 1
            selected.append(found.steps[0].test.p_value)
    assert stats.kstest(fixed, "uniform").pvalue > 0.01
    assert n_selected > N_SEEDS / 10
    assert stats.kstest(selected, "uniform").pvalue < 1e-6
    assert np.mean(np.array(selected) < 0.05) > 0.1


def test_on_noise_runs_left_out_keep_most_terms_from_entering() -> None:
    ra, rg, run = indexes(3, 12)
    n_terms = []
    for seed in range(100):
        rng = np.random.default_rng(3000 + seed)
        n_terms.append(len(select_stepwise(LIBRARY, ra, rg, rng.standard_normal(12)[run], run).terms))
    assert np.mean(np.array(n_terms) > 0) < 0.3
    assert max(n_terms) <= 4


@pytest.mark.parametrize("term", ["log_ra", "rg2", "ra_rg"])
def test_a_single_cause_is_found_in_a_library_of_many(term: str) -> None:
    ra, rg, run = indexes(4, 14)
    cause = TERMS[term](ra, rg)
    target = cause + 0.02 * np.std(cause) * np.random.default_rng(5).standard_normal(len(run))
    found = select_stepwise(LIBRARY, ra, rg, target, run)
    assert found.steps[0].term == term
    assert found.steps[0].test.p_value < 1e-6
    rms = [step.held_out_rms for step in found.steps]
    assert rms == sorted(rms, reverse=True)


def test_selection_ends_where_the_terms_repeat_one_another() -> None:
    """With R_a alone and a target exact in it, nothing that remains is independent enough to matter."""
    ra, _, run = indexes(6, 8)
    found = select_stepwise(("ra", "ra2"), ra, ra, 3.0 * ra + 1.0, run)
    assert found.terms == ("ra",)


@given(order=st.permutations(range(20)))
def test_the_order_of_batches_does_not_matter_to_selection(order: list[int]) -> None:
    ra, rg, run = indexes(7, 10)
    target = 100.0 * np.log(ra) + 5.0 * np.random.default_rng(8).standard_normal(20)
    one = select_stepwise(LIBRARY, ra, rg, target, run)
    other = select_stepwise(LIBRARY, ra[order], rg[order], target[order], run[order])
    assert other.terms == one.terms
    for a, b in zip(one.steps, other.steps, strict=True):
        assert b.test.statistic == pytest.approx(a.test.statistic, rel=1e-6)


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
