"""A slope by Theil and Sen, its interval, and which of many slopes are believed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import false_discovery_control, kendalltau, theilslopes

from gateway.archive.fleet.drift import FALSE_SHARE, LEAST_POINTS, believed, trend_of
from gateway.records import F64

X = np.arange(52.0) / 52.0
NUMBERS = st.lists(st.floats(-100.0, 100.0).map(lambda x: round(x, 3)), min_size=LEAST_POINTS, max_size=30)


def repeating(alike: float, n_series: int, seed: int) -> list[F64]:
    """Series without a trend that follow themselves from point to point."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(n_series, len(X) + 50))
    for k in range(1, noise.shape[1]):
        noise[:, k] += alike * noise[:, k - 1]
    return list(noise[:, 50:])


@given(NUMBERS)
def test_the_slope_is_the_one_of_scipy(numbers: list[float]) -> None:
    y = np.array(numbers)
    trend = trend_of(np.arange(float(len(y))), y)
    assert trend is not None
    assert trend.slope == pytest.approx(theilslopes(y).slope, abs=1e-12)
    assert trend.low <= trend.slope <= trend.high
    assert 0.0 <= trend.p <= 1.0


@given(st.integers(0, 99), st.floats(-5.0, 5.0), st.floats(-50.0, 50.0), st.floats(0.1, 10.0))
def test_a_ramp_a_shift_and_another_unit_do_what_they_must(seed: int, ramp: float, shift: float, unit: float) -> None:
    y, x = np.random.default_rng(seed).normal(size=20), np.arange(20.0)
    plain, moved = trend_of(x, y), trend_of(x / unit, y + shift + ramp * x)
    assert plain is not None
    assert moved is not None
    for name in ("slope", "low", "high"):
        assert getattr(moved, name) == pytest.approx(unit * (getattr(plain, name) + ramp), abs=1e-6)


def test_independent_points_are_judged_as_by_kendall() -> None:
    y = np.array([3.0, 1.0, 4.0, 1.5, 9.0, 2.0, 6.0, 5.0, 3.5, 8.0, 9.5, 7.0])  # a rise; neighbours unlike beside it
    trend = trend_of(np.arange(12.0), y)
    assert trend is not None
    expected = kendalltau(np.arange(12.0), y, method="exact").pvalue
    assert trend.p == pytest.approx(expected, abs=0.01)


def test_too_few_points_tell_nothing_and_equal_ones_no_slope() -> None:
    assert trend_of(X[: LEAST_POINTS - 1], X[: LEAST_POINTS - 1]) is None
    level = trend_of(X, np.zeros(len(X)))
    assert level is not None
    assert (level.slope, level.low, level.high, level.p) == (0.0, 0.0, 0.0, 1.0)


def test_one_wild_week_moves_the_slope_little() -> None:
    y = 0.2 * X
    y[7] = 1e6
    trend = trend_of(X, y)
    assert trend is not None
    assert trend.slope == pytest.approx(0.2)


@pytest.mark.parametrize("alike", [0.0, 0.3, 0.6])
def test_the_interval_holds_a_slope_of_nothing_about_as_often_as_it_says(alike: float) -> None:
    trends = [trend_of(X, y) for y in repeating(alike, 400, seed=3)]
    held = np.mean([trend is not None and trend.low <= 0.0 <= trend.high for trend in trends])
    assert 0.90 <= held <= 0.985


@pytest.mark.parametrize("alike", [0.0, 0.5])
def test_of_a_thousand_vehicles_without_drift_hardly_any_is_flagged(alike: float) -> None:
    chances = [trend.p for y in repeating(alike, 1000, seed=4) if (trend := trend_of(X, y)) is not None]
    assert sum(chance < 0.05 for chance in chances) > 20  # what judging each by itself would flag
    assert believed(chances).sum() <= 2


@given(st.lists(st.floats(0.0, 1.0), max_size=40))
def test_believed_are_those_of_benjamini_and_yekutieli(chances: list[float]) -> None:
    expected = false_discovery_control(chances, method="by") <= FALSE_SHARE * (1 + 1e-12) if chances else np.array([])
    strict = false_discovery_control(chances, method="by") <= FALSE_SHARE * (1 - 1e-12) if chances else np.array([])
    found = believed(chances)
    assert np.all(found <= expected)
    assert np.all(strict <= found)
