"""Static regression: recovers a known model, tells its spread as ordinary least squares does, knows no order."""

import numpy as np
import pytest
from scipy import stats

from gateway.calibration.ratio_index.regression import fit_regression
from gateway.core.ratio_index.regression import (
    MODEL_9_PAYLOAD,
    MODEL_11_FRONT_SHARE,
    MODEL_11_PAYLOAD,
    RegressionModel,
    scaled_columns,
    term_columns,
)
from gateway.records import F64, I64

STRUCTURES = [MODEL_9_PAYLOAD, MODEL_11_PAYLOAD, MODEL_11_FRONT_SHARE]


def indexes(n_runs: int = 12, per_run: int = 3) -> tuple[F64, F64, I64]:
    rng = np.random.default_rng(11)
    run = np.repeat(np.arange(1, n_runs + 1), per_run)
    return rng.uniform(0.5, 2.0, len(run)), rng.uniform(0.6, 1.8, len(run)), run


@pytest.mark.parametrize("terms", STRUCTURES)
def test_a_noiseless_model_is_recovered(terms: tuple[str, ...]) -> None:
    ra, rg, run = indexes()
    weights = np.linspace(-80.0, 120.0, len(terms))
    target = 200.0 + term_columns(terms, ra, rg) @ weights
    fitted = fit_regression(terms, ra, rg, target, run)
    np.testing.assert_allclose(fitted.held_out_errors, 0.0, atol=1e-6)
    unseen = np.array([0.7, 1.3]), np.array([1.1, 0.9])
    for i in range(2):
        centre, std, _ = fitted.model.predict(unseen[0][i], unseen[1][i])
        assert centre == pytest.approx(200.0 + float(term_columns(terms, *unseen)[i] @ weights), abs=1e-6)
        assert std < 1e-5


def test_prediction_interval_is_the_textbook_one() -> None:
    """Simple regression y = a + b x: s^2 (1 + 1/n + (x0 - mean)^2 / Sxx), Student's t."""
    rng = np.random.default_rng(12)
    x = rng.uniform(0.5, 2.0, 20)
    y = 100.0 + 50.0 * x + 5.0 * rng.standard_normal(20)
    line = stats.linregress(x, y)
    s = np.sqrt(np.sum((y - line.intercept - line.slope * x) ** 2) / 18)
    lows, highs = np.array([x.min()]), np.array([x.max()])
    columns = scaled_columns(("ra",), x, x, lows, highs)
    gram_inverse = np.linalg.inv(columns.T @ columns)
    model = RegressionModel(("ra",), lows, highs, gram_inverse @ columns.T @ y, gram_inverse, float(s), 18.0)
    for x0 in (0.4, 1.2, 2.5):
        centre, std, (low, high) = model.predict(x0, np.nan)
        expected_std = s * np.sqrt(1.0 + 1.0 / 20 + (x0 - x.mean()) ** 2 / np.sum((x - x.mean()) ** 2))
        assert centre == pytest.approx(line.intercept + line.slope * x0, rel=1e-9)
        assert std == pytest.approx(expected_std, rel=1e-9)
        assert (low, high) == pytest.approx(stats.t.interval(0.95, 18, centre, expected_std), rel=1e-9)


@pytest.mark.parametrize("terms", STRUCTURES)
def test_neither_the_order_of_batches_nor_the_names_of_runs_matter(terms: tuple[str, ...]) -> None:
    ra, rg, run = indexes()
    target = 100.0 * ra - 30.0 * rg + np.random.default_rng(13).standard_normal(len(ra))
    mixed = np.random.default_rng(14).permutation(len(ra))
    one = fit_regression(terms, ra, rg, target, run)
    other = fit_regression(terms, ra[mixed], rg[mixed], target[mixed], (100 - run)[mixed])
    np.testing.assert_allclose(other.held_out_errors, one.held_out_errors[mixed], rtol=1e-6, atol=1e-9)
    assert other.model.predict(1.1, 0.9)[:2] == pytest.approx(one.model.predict(1.1, 0.9)[:2], rel=1e-6)


def test_held_out_errors_come_from_fits_that_never_saw_the_run() -> None:
    ra, rg, run = indexes()
    target = 100.0 * ra + 3.0 * np.random.default_rng(15).standard_normal(len(ra))
    fitted = fit_regression(("ra",), ra, rg, target, run)
    for number in (1, 7):
        out = run == number
        line = stats.linregress(ra[~out], target[~out])
        np.testing.assert_allclose(fitted.held_out_errors[out], line.intercept + line.slope * ra[out] - target[out])
    assert fitted.model.dof == 11.0


def test_spread_is_that_of_the_noise() -> None:
    rng = np.random.default_rng(16)
    ra, rg = rng.uniform(0.5, 2.0, 400), rng.uniform(0.6, 1.8, 400)
    target = 50.0 * np.cbrt(ra) + 4.0 * rng.standard_normal(400)
    assert fit_regression(MODEL_9_PAYLOAD, ra, rg, target, np.arange(400)).model.residual_std == pytest.approx(
        4.0, rel=0.1
    )


def test_seen_range_scales_to_one() -> None:
    x = np.array([2.0, 3.0, 6.0])
    columns = scaled_columns(("ra", "ra2"), x, x, np.array([2.0, 4.0]), np.array([6.0, 36.0]))
    np.testing.assert_allclose(columns, [[1, -1, -1], [1, -0.5, -0.6875], [1, 1, 1]])
