"""Spectra of batches: what leaves a trace in them, and the noise of the sensors."""

from dataclasses import replace

import numpy as np
import pytest
from support.model_road import BAND_HZ, RATE_HZ, VAN, batch_over_road, theta_of

from gateway.core.vehicle import Load
from gateway.model.spectra import Mount, Reading, as_read, cross_spectra_of, expected_floor, floor_of, noise_over
from gateway.records import Batch

READING = Reading(VAN.wheelbase_m, BAND_HZ, 256)
ROLL_READING = replace(READING, with_roll=True)
HALF = theta_of()
DENSITY = 8.7e-4  # rad/s/sqrt(Hz): a gyro of 0.05 deg/s/sqrt(Hz)


def test_masked_samples_leave_no_trace() -> None:
    batch = batch_over_road(HALF, Load(200.0, 50.0), 3, duration_s=120.0)
    kept = (np.arange(len(batch.usable)) < 2000) | (np.arange(len(batch.usable)) > 2400)
    spoilt = np.where(kept, batch.vertical_acceleration_mps2, np.nan)
    masked = replace(batch, usable=kept)
    one, other = (
        cross_spectra_of([each], READING) for each in (masked, replace(masked, vertical_acceleration_mps2=spoilt))
    )
    np.testing.assert_array_equal(one.parts, other.parts)


def noisy(density: float) -> Batch:
    """A drive whose gyro adds white noise of this density."""
    batch = batch_over_road(HALF, Load(200.0, 50.0), 60, duration_s=120.0)
    noise = density * np.sqrt(RATE_HZ / 2.0) * np.random.default_rng(60).standard_normal(len(batch.usable))
    return replace(batch, pitch_rate_radps=batch.pitch_rate_radps + noise)


def test_a_floor_is_the_density_of_white_noise_and_deaf_to_tones() -> None:
    batch = noisy(0.0)
    n = len(batch.usable)
    white = DENSITY * np.sqrt(RATE_HZ / 2.0) * np.random.default_rng(1).standard_normal(n)
    alone = replace(batch, pitch_rate_radps=white + 0.01 * np.sin(2.0 * np.pi * 18.0 * np.arange(n) / RATE_HZ))
    assert np.sqrt(floor_of(alone)[1]) == pytest.approx(DENSITY, rel=0.2)
    assert np.isnan(floor_of(replace(alone, usable=np.zeros(n, bool)))).all()


def test_vibration_grows_with_the_road_and_noise_does_not() -> None:
    usual = ((1.0, 3.0), (1.0, 1.0))
    np.testing.assert_allclose(expected_floor(usual, 0.5), (3.0, 1.0))
    np.testing.assert_allclose(expected_floor(usual, 4.0), (9.0, 1.0))
    np.testing.assert_allclose(noise_over(np.array([30.0, 5.0, 9.0]), expected_floor(usual, 4.0)), (0.0, 4.0, 0.0))


def test_the_noise_of_the_roll_rate_reaches_a_sensor_that_is_brought_to_the_centre_line() -> None:
    freq_hz = np.array([2.0, 10.0])
    placed = replace(ROLL_READING, mount=Mount(0.4, 0.1, 0.0))
    found = as_read(np.array([1.0, 2.0, 3.0]), placed, freq_hz, with_roll=True)
    np.testing.assert_allclose(found[0], 1.0 + 3.0 * (2.0 * np.pi * freq_hz * 0.4) ** 2)
    np.testing.assert_allclose(found[1:], [[2.03, 2.03], [3.0, 3.0]])
    np.testing.assert_allclose(as_read(np.array([1.0, 2.0, 3.0]), placed, freq_hz, with_roll=False), [[1, 1], [2, 2]])


def test_the_roll_rate_is_used_if_most_segments_have_it() -> None:
    batch = batch_over_road(theta_of(with_roll=True), Load(200.0, 50.0), 4, duration_s=120.0)
    n = len(batch.usable)
    for kept, has_roll in ((1.0, True), (0.8, True), (0.4, False)):
        rate = np.where(np.arange(n) < kept * n, batch.roll_rate_radps, np.nan)
        found = cross_spectra_of([replace(batch, roll_rate_radps=rate)], ROLL_READING)
        assert found.has_roll is has_roll
        assert found.without_roll.parts.shape[0] == 4
    assert not cross_spectra_of([batch], READING).has_roll


def test_fewer_frequencies_are_those_of_the_whole_band() -> None:
    whole = cross_spectra_of([batch_over_road(theta_of(with_roll=True), Load(200.0, 50.0), 4)], ROLL_READING)
    part = whole.within((2.0, 5.0))
    inside = (whole.freq_hz[1:-1] >= 2.0) & (whole.freq_hz[1:-1] <= 5.0)
    np.testing.assert_array_equal(part.freq_hz[1:-1], whole.freq_hz[1:-1][inside])
    np.testing.assert_array_equal(part.parts, whole.parts[..., inside])
    np.testing.assert_array_equal(part.delay_phase[:, 1:-1], whole.delay_phase[:, 1:-1][:, inside])
