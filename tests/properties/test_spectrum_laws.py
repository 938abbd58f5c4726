"""Laws of the segment spectra: energy is kept, masks are never crossed, gain and phase are those of the signals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gateway.core.spectrum import frequencies_hz, segment_starts, segment_transforms
from gateway.records import Bool

RATE_HZ = 50.0

masks = hnp.arrays(bool, st.integers(0, 300), elements=st.integers(0, 9).map(bool))


@settings(derandomize=True)
@given(usable=masks, n_segment=st.integers(2, 40), step=st.integers(1, 40))
def test_segments_lie_wholly_in_the_mask_and_fill_every_run(usable: Bool, n_segment: int, step: int) -> None:
    starts = segment_starts(usable, n_segment, step)
    assert all(usable[s : s + n_segment].all() and s + n_segment <= len(usable) for s in starts)
    free = np.concatenate([[False], usable, [False]])
    run_starts, run_ends = (np.flatnonzero(np.diff(free.astype(int)) == way) for way in (1, -1))
    fitting = [max(0, (b - a - n_segment) // step + 1) for a, b in zip(run_starts, run_ends, strict=True)]
    assert len(starts) == sum(fitting)
    assert set(run_starts[np.array(fitting, int) > 0]) <= set(starts)


def test_a_signal_shorter_than_a_segment_has_no_spectrum() -> None:
    none = segment_starts(np.ones(30, bool), 32, 16)
    assert segment_transforms(np.zeros(30), none, 32, RATE_HZ).shape == (0, 17)


@settings(max_examples=30, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), n_segment=st.integers(8, 257), scale=st.floats(1e-3, 1e3))
def test_parseval(seed: int, n_segment: int, scale: float) -> None:
    x = scale * np.random.default_rng(seed).standard_normal(n_segment)
    (power,) = np.abs(segment_transforms(x, np.array([0]), n_segment, RATE_HZ)) ** 2
    k = np.arange(n_segment)
    tapered = (x - np.polyval(np.polyfit(k, x, 1), k)) * np.sin(np.pi * k / n_segment) ** 2
    weight = np.sum(np.sin(np.pi * k / n_segment) ** 4)
    assert np.sum(power) * RATE_HZ / n_segment == pytest.approx(np.sum(tapered**2) / weight, rel=1e-9)


@settings(max_examples=30, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), offset=st.floats(-1e3, 1e3), slope=st.floats(-10.0, 10.0))
def test_a_straight_line_changes_nothing(seed: int, offset: float, slope: float) -> None:
    x = np.random.default_rng(seed).standard_normal(600)
    starts = np.array([0, 100, 344])
    plain = segment_transforms(x, starts, 256, RATE_HZ)
    drifting = segment_transforms(x + offset + slope * np.arange(600) / RATE_HZ, starts, 256, RATE_HZ)
    np.testing.assert_allclose(drifting, plain, atol=1e-9)


def test_white_noise_has_its_variance_spread_evenly() -> None:
    x = 3.0 * np.random.default_rng(5).standard_normal(200_000)
    starts = segment_starts(np.ones(len(x), bool), 256, 128)
    density = np.mean(np.abs(segment_transforms(x, starts, 256, RATE_HZ)) ** 2, axis=0)
    np.testing.assert_allclose(density[3:-3], 9.0 / (RATE_HZ / 2.0), rtol=0.15)
    assert np.sum(density) * RATE_HZ / 256 == pytest.approx(9.0, rel=0.02)


def test_a_sine_holds_half_its_squared_amplitude_about_its_frequency() -> None:
    x = 2.0 * np.sin(2 * np.pi * 5.0 * np.arange(5000) / RATE_HZ)
    starts = segment_starts(np.ones(5000, bool), 500, 250)
    power = np.mean(np.abs(segment_transforms(x, starts, 500, RATE_HZ)) ** 2, axis=0)
    freq_hz = frequencies_hz(500, RATE_HZ)
    near = np.abs(freq_hz - 5.0) < 0.35
    assert np.sum(power[near]) * RATE_HZ / 500 == pytest.approx(2.0, rel=1e-3)
    assert freq_hz[np.argmax(power)] == pytest.approx(5.0)
    assert freq_hz[-1] == RATE_HZ / 2.0
