"""Spectra for people to look at, and the road's roughness."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import half_car_road
from support.drives import drive

from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.core.spectrum import REFERENCE_SPEED_MPS, roughness_mps2, spectra_of
from gateway.estimates.as_json import estimate_to_json
from gateway.records import F64, Batch, Bool, Spectra
from gateway.weighing.estimator import estimate


def batch_of(acceleration: F64, pitch_rate: F64, usable: Bool) -> Batch:
    return replace(half_car_road.batch_of(acceleration, pitch_rate, speed_mps=15.0), usable=usable)


def noise(seed: int, n: int = 15_000) -> F64:
    return np.random.default_rng(seed).standard_normal(n)


def test_densities_coherence_and_phase_of_a_pure_gain() -> None:
    a = 2.0 * noise(1)
    shown = spectra_of(batch_of(a, -0.5 * a, np.ones(len(a), bool)))
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
    low = shown.freq_hz < 8.0
    np.testing.assert_allclose(shown.phase_rad[low], -2 * np.pi * shown.freq_hz[low] * 0.04, atol=0.05)


def test_masked_samples_are_never_looked_at() -> None:
    a, usable = noise(5), np.ones(15_000, bool)
    usable[4000:9000] = False
    spoiled = np.where(usable, a, 1e6)
    clean, dirty = (spectra_of(batch_of(x, 0.1 * x, usable)) for x in (a, spoiled))
    np.testing.assert_array_equal(clean.vertical_acceleration, dirty.vertical_acceleration)


def test_without_an_unbroken_stretch_there_is_no_spectrum() -> None:
    usable = np.ones(15_000, bool)
    usable[::200] = False
    assert spectra_of(batch_of(noise(6), noise(7), usable)) is None
    silent = np.full(15_000, np.nan)
    assert spectra_of(batch_of(noise(6), silent, np.ones(15_000, bool))) is None


def spectra(amplitude: float, step_hz: float = 0.2) -> Spectra:
    """White acceleration of this amplitude density."""
    freq_hz = np.arange(0.5, 15.05, step_hz)
    return Spectra(freq_hz, np.full(len(freq_hz), amplitude), *(np.ones(len(freq_hz)) for _ in range(3)))


def test_at_the_reference_speed_it_is_the_root_mean_square_of_the_band() -> None:
    assert roughness_mps2(spectra(0.3), REFERENCE_SPEED_MPS) == pytest.approx(0.3 * math.sqrt(14.0), rel=0.02)


@given(st.floats(3.0, 40.0), st.floats(1.1, 4.0))
def test_roughness_does_not_depend_on_speed(speed_mps: float, factor: float) -> None:
    """ISO 8608: the same road met ``factor`` times as fast has ``factor`` times the power at every frequency."""
    slow = roughness_mps2(spectra(0.3), speed_mps)
    assert roughness_mps2(spectra(0.3 * math.sqrt(factor)), factor * speed_mps) == pytest.approx(slow)


@pytest.mark.parametrize("speed_mps", [0.0, math.nan])
def test_without_speed_or_spectra_it_is_unknown(speed_mps: float) -> None:
    assert math.isnan(roughness_mps2(spectra(0.3), speed_mps))
    assert math.isnan(roughness_mps2(None, 15.0))


def test_every_estimate_has_the_roughness_of_its_batch() -> None:
    """White acceleration of 0.5 m/s2 at 100 samples a second, at 15 m/s: 14 of its 50 Hz, brought to 80 km/h."""
    motion = drive(30.0)
    scheduler = Scheduler(BatchSettings(window_s=20.0), {})
    (batch, *_) = [*scheduler.feed(motion), *scheduler.flush()]
    found = estimate(batch, None, "cross_spectrum")
    expected = 0.5 * math.sqrt(14.0 / 50.0 * REFERENCE_SPEED_MPS / 15.0)
    assert found.roughness_mps2 == pytest.approx(expected, rel=0.1)
    assert estimate_to_json(found)["roughness_mps2"] == pytest.approx(found.roughness_mps2, rel=1e-5)
