"""Sensors that sample at another rate than in calibration are named, whichever the estimator."""

import math
from dataclasses import replace

import pytest
from support.calibrated import calibration_file
from support.half_car_road import batch_over_road

from gateway.calibration.known_run import KnownRun, sensor_rate_seen_hz
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.estimator import ESTIMATORS, estimate
from gateway.records import Batch, Why


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
