"""Piecewise cubics, against those of scipy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, PchipInterpolator

from gateway.core.spline import between, monotone_slopes, smooth_slopes

seeds = st.integers(0, 2**32 - 1)


@given(n=st.integers(4, 60), seed=seeds)
def test_a_smooth_curve_is_the_cubic_spline(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    t, x = np.cumsum(rng.uniform(0.5, 2.0, n)), rng.standard_normal(n)
    at = rng.uniform(t[0], t[-1], 50)
    np.testing.assert_allclose(between(at, t, x, smooth_slopes(t, x)), CubicSpline(t, x)(at), rtol=1e-9, atol=1e-9)


@given(n=st.integers(2, 12), seed=seeds)
def test_a_monotone_curve_is_the_pchip(n: int, seed: int) -> None:
    """Rounded, so that some neighbours are equal."""
    rng = np.random.default_rng(seed)
    t, x = np.cumsum(rng.uniform(0.5, 2.0, n)), np.round(rng.standard_normal((n, 3)), 1)
    at = np.r_[t, rng.uniform(t[0], t[-1], 50)]
    expected = PchipInterpolator(t, x)(at)
    np.testing.assert_allclose(between(at, t, x, monotone_slopes(t, x)), expected, rtol=1e-9, atol=1e-9)


def test_what_is_no_number_is_an_error_and_no_curve() -> None:
    with pytest.raises(ValueError, match="infs or NaNs"):
        smooth_slopes(np.arange(5.0), np.array([0.0, np.nan, 1.0, 2.0, 3.0]))
