"""Sensors that became noisy, or sample at another rate than in calibration."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.calibrated import calibration_file
from support.half_car_road import RATE_HZ, VAN, batch_over_road, calibrated_on_known_loads, weighed

from gateway.calibration.known_run import KnownRun, sensor_rate_seen_hz
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.floor import as_read, expected_floor, floor_of, noise_over, usual_floor
from gateway.core.cross_spectrum.model.reading import Mount, Reading
from gateway.core.estimator import ESTIMATORS, estimate
from gateway.records import Batch, Why
from gateway.service.pipeline import noise_fault

LOAD = (200.0, 50.0)
DENSITY = 8.7e-4  # rad/s/sqrt(Hz): a gyro of 0.05 deg/s/sqrt(Hz)
READING = Reading(VAN.wheelbase_m, (1.1, 14.0), 256)


@pytest.fixture(scope="module")
def calibration() -> CrossSpectrumCalibration:
    return calibrated_on_known_loads()


def noisy(density: float, seed: int = 60) -> Batch:
    """A drive whose gyro adds white noise of this density."""
    batch = batch_over_road(*LOAD, seed=seed)
    noise = density * np.sqrt(RATE_HZ / 2.0) * np.random.default_rng(seed).standard_normal(len(batch.usable))
    return replace(batch, pitch_rate_radps=batch.pitch_rate_radps + noise)


def test_a_noisy_gyro_is_weighed_and_tells_less(calibration: CrossSpectrumCalibration) -> None:
    quiet, loud = weighed(noisy(0.0), calibration), weighed(noisy(DENSITY), calibration)
    assert loud.counted, loud.rejected
    assert loud.payload.interval95[0] <= LOAD[0] <= loud.payload.interval95[1]
    assert loud.posterior.own[0, 0] > quiet.posterior.own[0, 0]
    assert quiet.diagnostics["noise_pitch_rate_ratio"] < 1.5
    assert loud.diagnostics["noise_pitch_rate_ratio"] > 2.0
    assert loud.diagnostics["noise_acceleration_ratio"] < 1.5
    assert noise_fault(quiet) is None
    assert "the gyro's pitch rate is" in str(noise_fault(loud))
    assert loud.diagnostics["misfit"] < 0.5 * calibration.misfit_limit


def test_a_calibration_that_does_not_say_how_loud_the_sensors_were_cannot_weigh_it(
    calibration: CrossSpectrumCalibration,
) -> None:
    assert not weighed(noisy(DENSITY), replace(calibration, floor=None)).counted
    quiet = noisy(0.0)
    as_ever = weighed(quiet, replace(calibration, floor=None))
    assert weighed(quiet, calibration).payload.number == as_ever.payload.number


def test_noise_that_drowns_the_vehicle_is_named(calibration: CrossSpectrumCalibration) -> None:
    assert weighed(noisy(300.0 * DENSITY), calibration).rejected == (Why.SENSOR_NOISY,)


def test_a_floor_is_the_density_of_white_noise_and_deaf_to_tones() -> None:
    batch = noisy(DENSITY)
    n = len(batch.usable)
    white = DENSITY * np.sqrt(RATE_HZ / 2.0) * np.random.default_rng(1).standard_normal(n)
    tone = 0.01 * np.sin(2.0 * np.pi * 18.0 * np.arange(n) / RATE_HZ)
    alone = replace(batch, pitch_rate_radps=white + tone)
    assert np.sqrt(floor_of(alone)[1]) == pytest.approx(DENSITY, rel=0.2)
    assert np.isnan(floor_of(replace(alone, usable=np.zeros(n, bool)))).all()


def test_vibration_grows_with_the_road_and_noise_does_not() -> None:
    usual = ((1.0, 3.0), (1.0, 1.0))
    np.testing.assert_allclose(expected_floor(usual, 0.5), (3.0, 1.0))
    np.testing.assert_allclose(expected_floor(usual, 4.0), (9.0, 1.0))
    np.testing.assert_allclose(noise_over(np.array([30.0, 5.0, 9.0]), expected_floor(usual, 4.0)), (0.0, 4.0, 0.0))


def test_a_calibration_keeps_the_quietest_and_the_loudest() -> None:
    batches = [noisy(0.0), noisy(DENSITY)]
    floors = np.array([floor_of(batch) for batch in batches])
    assert usual_floor(batches, with_roll=True) == tuple(zip(floors.min(axis=0), floors.max(axis=0), strict=True))
    assert usual_floor([], with_roll=True) is None


def test_the_roll_rates_noise_reaches_a_sensor_that_is_brought_to_the_centre_line() -> None:
    freq_hz = np.array([2.0, 10.0])
    placed = replace(READING, mount=Mount(0.4, 0.1, 0.0))
    found = as_read(np.array([1.0, 2.0, 3.0]), placed, freq_hz, with_roll=True)
    np.testing.assert_allclose(found[0], 1.0 + 3.0 * (2.0 * np.pi * freq_hz * 0.4) ** 2)
    np.testing.assert_allclose(found[1:], [[2.03, 2.03], [3.0, 3.0]])
    np.testing.assert_allclose(as_read(np.array([1.0, 2.0, 3.0]), placed, freq_hz, with_roll=False), [[1, 1], [2, 2]])


@pytest.fixture(scope="module")
def batch() -> Batch:
    return batch_over_road(100.0, 50.0, seed=1, duration_s=60.0)


def calibrated_at(*rates_hz: float) -> CalibratedVehicle:
    return replace(calibration_file().for_core(), sensor_rate_seen_hz=rates_hz or None)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize(("calibrated_hz", "driven_hz"), [(100.0, 50.0), (50.0, 100.0), (100.0, 200.0)])
def test_another_rate_is_named(batch: Batch, estimator: str, calibrated_hz: float, driven_hz: float) -> None:
    driven = replace(batch, sensor_rate_hz=driven_hz)
    found = estimate(driven, calibrated_at(calibrated_hz, calibrated_hz), estimator)
    assert found.rejected == (Why.SAMPLE_RATE,)
    assert math.isnan(found.payload.number)


@pytest.mark.parametrize("driven_hz", [99.0, 101.25, math.nan])
def test_clocks_differ_a_little_and_some_tell_nothing(batch: Batch, driven_hz: float) -> None:
    driven = replace(batch, sensor_rate_hz=driven_hz)
    assert Why.SAMPLE_RATE not in estimate(driven, calibrated_at(100.0, 100.0), "ratio_index").rejected


def test_a_calibration_that_does_not_say_its_rate_names_none(batch: Batch) -> None:
    driven = replace(batch, sensor_rate_hz=50.0)
    assert Why.SAMPLE_RATE not in estimate(driven, calibrated_at(), "ratio_index").rejected


def test_a_calibration_remembers_the_rates_of_what_counts(batch: Batch) -> None:
    batches = tuple(replace(batch, sensor_rate_hz=hz) for hz in (100.2, 99.8, math.nan))
    refused = replace(batch, sensor_rate_hz=50.0, rejected=(Why.TOO_SLOW,))
    assert sensor_rate_seen_hz([KnownRun(1, "a", 0.0, 50.0, (*batches, refused))]) == (99.8, 100.2)
    assert sensor_rate_seen_hz([KnownRun(1, "a", 0.0, 50.0, (batches[-1],))]) is None
    assert calibration_file().for_core().sensor_rate_seen_hz == (100.0, 100.0)
