"""Spectra for people to look at."""

import numpy as np
import pytest

from gateway.core.spectrum import spectra_of
from gateway.records import F64, Batch, Bool


def batch_of(acceleration: F64, pitch_rate: F64, usable: Bool) -> Batch:
    n = len(acceleration)
    return Batch(
        t_start_ns=0,
        t_end_ns=n * 20_000_000,
        drive_start_ns=0,
        rate_hz=50.0,
        vertical_acceleration_mps2=acceleration,
        pitch_rate_radps=pitch_rate,
        speed_mps=np.full(n, 15.0),
        usable=usable,
        gravity_mps2=9.81,
        gap_share=0.0,
        shares={},
    )


def noise(seed: int, n: int = 15_000) -> F64:
    return np.random.default_rng(seed).standard_normal(n)


def test_densities_coherence_and_phase_of_a_pure_gain() -> None:
    a = 2.0 * noise(1)
    shown = spectra_of(batch_of(a, -0.5 * a, np.ones(len(a), bool)))
    assert shown is not None
    np.testing.assert_allclose(shown.coherence, 1.0, atol=1e-9)
    np.testing.assert_allclose(np.abs(shown.phase_rad), np.pi, atol=1e-6)
    np.testing.assert_allclose(shown.pitch_rate, 0.5 * shown.vertical_acceleration)
    assert np.mean(shown.vertical_acceleration**2) == pytest.approx(4.0 / 25.0, rel=0.05)
    assert shown.freq_hz[0] >= 0.5
    assert shown.freq_hz[-1] <= 15.0


def test_phase_is_that_of_pitch_rate_against_acceleration() -> None:
    a = noise(2)
    delayed = np.r_[np.zeros(2), a[:-2]]  # 40 ms
    shown = spectra_of(batch_of(a, delayed, np.ones(len(a), bool)))
    assert shown is not None
    low = shown.freq_hz < 8.0
    np.testing.assert_allclose(shown.phase_rad[low], -2 * np.pi * shown.freq_hz[low] * 0.04, atol=0.05)


def test_unrelated_signals_are_not_coherent() -> None:
    shown = spectra_of(batch_of(noise(3), noise(4), np.ones(15_000, bool)))
    assert shown is not None
    assert np.mean(shown.coherence) < 0.05


def test_masked_samples_are_never_looked_at() -> None:
    a, usable = noise(5), np.ones(15_000, bool)
    usable[4000:9000] = False
    spoiled = np.where(usable, a, 1e6)
    clean, dirty = (spectra_of(batch_of(x, 0.1 * x, usable)) for x in (a, spoiled))
    assert clean is not None
    assert dirty is not None
    np.testing.assert_array_equal(clean.vertical_acceleration, dirty.vertical_acceleration)


def test_no_unbroken_stretch_is_no_spectrum() -> None:
    usable = np.ones(15_000, bool)
    usable[::200] = False
    assert spectra_of(batch_of(noise(6), noise(7), usable)) is None
    silent = np.full(15_000, np.nan)
    assert spectra_of(batch_of(noise(6), silent, np.ones(15_000, bool))) is None
