"""The uniform time line: what lies in band comes through, what would alias does not, gaps stay gaps; its spline."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from gateway.core.spline import between, smooth_slopes
from gateway.core.timeline import onto_grid, speed_onto_grid
from gateway.records import F64, I64

T0_NS = 1_790_000_000_000_000_000
RATE_HZ, N, GAP_S = 50.0, 1500, 0.05
GRID_S = np.arange(N) / RATE_HZ
INSIDE = slice(25, -25)  # half a second from either end


def stamps(rate_hz: float, jitter_s: float = 0.0, offset_s: float = 0.0) -> tuple[F64, I64]:
    rng = np.random.default_rng(7)
    count = int(N / RATE_HZ * rate_hz)
    t_s = offset_s + np.arange(count) / rate_hz + rng.uniform(-jitter_s, jitter_s, count)
    return t_s, T0_NS + np.rint(t_s * 1e9).astype(np.int64)


def gridded(t_ns: I64, x: F64) -> F64:
    return onto_grid(t_ns, x, T0_NS, N, RATE_HZ, GAP_S)


def rms(x: F64) -> float:
    return float(np.sqrt(np.mean(x**2)))


@pytest.mark.parametrize("rate_hz", [52.0, 100.0, 104.0, 200.0])
@pytest.mark.parametrize("freq_hz", [1.0, 5.0])
def test_a_sine_sampled_with_jitter_comes_back_within_a_percent(rate_hz: float, freq_hz: float) -> None:
    t_s, t_ns = stamps(rate_hz, jitter_s=0.1 / rate_hz, offset_s=0.2 / rate_hz)
    back = gridded(t_ns, np.sin(2 * np.pi * freq_hz * t_s))
    error = back[INSIDE] - np.sin(2 * np.pi * freq_hz * GRID_S[INSIDE])
    assert np.max(np.abs(error)) < 0.01


@pytest.mark.parametrize("freq_hz", [2.0, 8.0, 14.0])
def test_the_band_of_the_estimators_keeps_its_amplitude(freq_hz: float) -> None:
    t_s, t_ns = stamps(200.0, offset_s=0.0013)
    back = gridded(t_ns, np.sin(2 * np.pi * freq_hz * t_s))
    assert rms(back[INSIDE]) == pytest.approx(np.sqrt(0.5), rel=0.01)


@pytest.mark.parametrize(("rate_hz", "freq_hz"), [(200.0, 47.6), (100.0, 47.6), (104.0, 47.6), (200.0, 36.0)])
def test_engine_firing_does_not_fold_onto_the_band(rate_hz: float, freq_hz: float) -> None:
    t_s, t_ns = stamps(rate_hz)
    tone = np.sin(2 * np.pi * freq_hz * t_s)
    assert rms(gridded(t_ns, tone)[INSIDE]) < 1e-3 * rms(tone)


def test_order_and_repeated_stamps_do_not_matter() -> None:
    t_s, t_ns = stamps(100.0, jitter_s=0.002)
    x = np.sin(2 * np.pi * 3.0 * t_s)
    mixed = np.random.default_rng(8).permutation(len(x))
    again = gridded(np.r_[t_ns[mixed], t_ns[:50]], np.r_[x[mixed], x[:50]])
    np.testing.assert_array_equal(again, gridded(t_ns, x))


@pytest.mark.parametrize("count", [0, 1, 3])
def test_too_few_samples_are_unknown_throughout(count: int) -> None:
    assert np.isnan(gridded(T0_NS + np.arange(count), np.ones(count))).all()


def test_speed_is_linear_between_samples_and_held_no_longer_than_allowed() -> None:
    t_ns = T0_NS + np.array([2, 4, 10, 12], np.int64) * 1_000_000_000
    speed = speed_onto_grid(t_ns, np.array([10.0, 12.0, 20.0, 20.0]), T0_NS, 1000, RATE_HZ, hold_s=3.0)
    at = {s: speed[round(s * RATE_HZ)] for s in (0.0, 2.0, 3.0, 4.0, 5.0, 9.0, 11.0, 15.0, 15.1)}
    assert at[3.0] == pytest.approx(11.0)
    assert (at[0.0], at[2.0], at[11.0], at[15.0]) == (10.0, 10.0, 20.0, 20.0)  # held at either end
    assert np.isnan([at[5.0], at[9.0], at[15.1]]).all()  # six seconds apart, and past the hold


@pytest.mark.parametrize(("n_lost", "is_known"), [(1, True), (3, False)])
def test_a_gap_is_bridged_up_to_its_limit(n_lost: int, is_known: bool) -> None:
    """Of 0.05 s: one sample that is missing of 52 in a second leaves 0.04 s, three leave 0.08 s."""
    t_s, t_ns = stamps(52.0)
    kept = np.r_[0:500, 500 + n_lost : len(t_s)]
    within = (t_s[499] < GRID_S) & (t_s[500 + n_lost] > GRID_S)
    assert np.all(np.isfinite(gridded(t_ns[kept], t_s[kept])[within]) == is_known)


def test_nothing_is_known_beyond_a_quarter_of_a_gap_from_either_end() -> None:
    t_s, t_ns = stamps(52.0)
    kept = slice(200, 1200)
    known = GRID_S[np.isfinite(gridded(t_ns[kept], t_s[kept]))]
    assert t_s[200] - GAP_S / 4.0 <= known[0] <= t_s[200] + 0.02
    assert t_s[1199] - 0.02 <= known[-1] <= t_s[1199] + GAP_S / 4.0


seeds = st.integers(0, 2**32 - 1)


@given(n=st.integers(4, 60) | st.just(3000), seed=seeds)
def test_a_smooth_curve_is_the_cubic_spline(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    t, x = np.cumsum(rng.uniform(0.5, 2.0, n)), rng.standard_normal(n)
    at = rng.uniform(t[0], t[-1], 50)
    np.testing.assert_allclose(between(at, t, x, smooth_slopes(t, x)), CubicSpline(t, x)(at), rtol=1e-9, atol=1e-9)
