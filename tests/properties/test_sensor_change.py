"""A sensor that is not where, or what, it was, is found."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import chdtri
from support.half_car_road import CAR, batch_over_road, calibrated_on_known_loads, weighed

from gateway.core.cross_spectrum import located
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import DRIFTING, MOST_TENSION, tension_of
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.core.cross_spectrum.sensor_change import is_gyro_turned
from gateway.estimate import Estimate
from gateway.records import Batch, Why

LOAD = (200.0, 50.0)
WITH_OTHER_DAMPERS = replace(CAR, rear=replace(CAR.rear, damper_nspm=1.74 * CAR.rear.damper_nspm))


@pytest.fixture(scope="module")
def calibration() -> CrossSpectrumCalibration:
    return calibrated_on_known_loads()


def amplified(batch: Batch, gain: float) -> Batch:
    """Another gain of the accelerometer shows in what it reads of gravity too."""
    return replace(
        batch,
        vertical_acceleration_mps2=gain * batch.vertical_acceleration_mps2,
        gravity_mps2=gain * batch.gravity_mps2,
    )


def answered(batch: Batch, calibration: CrossSpectrumCalibration) -> Estimate:
    estimate = weighed(batch, calibration)
    assert estimate.counted, estimate.rejected
    return estimate


def test_the_limit_of_tension_is_the_quantile_that_it_says() -> None:
    assert pytest.approx(chdtri(5, 1e-4), rel=1e-9) == MOST_TENSION


@pytest.mark.parametrize("seed", range(4))
def test_a_sensor_that_nobody_touched_is_believed(calibration: CrossSpectrumCalibration, seed: int) -> None:
    told = answered(batch_over_road(*LOAD, seed=60 + seed), calibration).diagnostics
    assert abs(told["sensor_position_score"]) < 4.0
    assert told["sensor_noise_score"] < 4.0


def moved(moved_m: float, calibration: CrossSpectrumCalibration) -> Estimate:
    elsewhere = replace(CAR, sensor_position_m=CAR.sensor_position_m + moved_m)
    return weighed(batch_over_road(*LOAD, seed=61, car=elsewhere), calibration)


@pytest.mark.parametrize(
    ("moved_m", "why"),
    [
        (-0.3, Why.SENSOR_CHANGED),
        (-0.2, Why.SENSOR_CHANGED),
        (0.15, Why.SENSOR_CHANGED),
        (0.2, Why.SENSOR_CHANGED),
        (0.3, Why.MODEL_MISFIT),
    ],
)
def test_a_sensor_moved_along_the_vehicle_is_told(
    calibration: CrossSpectrumCalibration, moved_m: float, why: Why
) -> None:
    estimate = moved(moved_m, calibration)
    assert estimate.rejected == (why,)
    assert np.sign(estimate.diagnostics["sensor_position_score"]) == np.sign(moved_m)


def test_what_does_not_come_through_the_springs_is_told_as_noise(calibration: CrossSpectrumCalibration) -> None:
    """As roll does, where the sensor was moved sideways or turned."""
    batch = batch_over_road(*LOAD, seed=62)
    roll = np.random.default_rng(62).standard_normal(len(batch.speed_mps))
    mixed = replace(batch, vertical_acceleration_mps2=batch.vertical_acceleration_mps2 + 0.15 * roll)
    estimate = weighed(mixed, calibration)
    assert estimate.rejected == (Why.SENSOR_CHANGED,)
    assert estimate.diagnostics["sensor_noise_score"] > calibration.most_noise_score


def test_noise_that_ends_where_the_vehicles_motion_does_is_roll_in_a_turned_gyro(
    calibration: CrossSpectrumCalibration,
) -> None:
    theta = calibration.parameters.copy()
    theta[INDEX["noise_pitch_rate_rad2ps"]] += np.log(4.0)
    noisy, as_calibrated = Point(theta, 200.0, 0.5), Point(calibration.parameters, 200.0, 0.5)
    quiet, gyro_loud, accelerometer_loud = np.ones(2), np.array([1.0, 2.0]), np.array([2.0, 1.0])
    assert is_gyro_turned(noisy, calibration, quiet)
    assert is_gyro_turned(noisy, calibration, accelerometer_loud)
    assert not is_gyro_turned(noisy, calibration, gyro_loud)
    assert not is_gyro_turned(as_calibrated, calibration, quiet)


def test_gravity_that_reads_otherwise_is_told(calibration: CrossSpectrumCalibration) -> None:
    assert calibration.gravity_mps2 == pytest.approx(9.81)
    assert weighed(amplified(batch_over_road(*LOAD, seed=63), 1.05), calibration).rejected == (Why.SENSOR_CHANGED,)


@pytest.mark.parametrize(("gain", "is_refused"), [(1.01, False), (1.05, True), (0.95, True), (None, False)])
def test_a_gyro_s_gain_that_bends_tell_otherwise_is_told(
    calibration: CrossSpectrumCalibration, gain: float | None, is_refused: bool
) -> None:
    with_bends = replace(calibration, gyro_gain=(1.0, 0.002))
    batch = replace(batch_over_road(*LOAD, seed=63), gyro_gain=None if gain is None else (gain, 0.008))
    found = weighed(batch, with_bends)
    assert found.rejected == ((Why.SENSOR_CHANGED,) if is_refused else ())
    assert found.diagnostics.get("gyro_gain_ratio") == gain
    assert weighed(batch, calibration).counted  # which knows of no gain


def test_a_little_more_gain_is_within_the_interval(calibration: CrossSpectrumCalibration) -> None:
    batch = batch_over_road(*LOAD, seed=64)
    as_it_was, stronger = answered(batch, calibration), answered(amplified(batch, 1.01), calibration)
    assert stronger.payload.std > as_it_was.payload.std
    assert stronger.payload.interval95[0] <= LOAD[0] <= stronger.payload.interval95[1]
    assert stronger.front_share.interval95[0] <= LOAD[1] <= stronger.front_share.interval95[1]


def test_a_file_that_does_not_say_gravity_is_no_fault(calibration: CrossSpectrumCalibration) -> None:
    older = replace(calibration, gravity_mps2=None)
    batch = batch_over_road(*LOAD, seed=65)
    assert answered(batch, older).payload.number == answered(batch, calibration).payload.number


@pytest.mark.parametrize("lag_s", [-0.02, -0.005, 0.005, 0.02])
def test_a_lag_between_the_sensors_costs_nothing(calibration: CrossSpectrumCalibration, lag_s: float) -> None:
    lagging = answered(batch_over_road(*LOAD, seed=66, car=replace(CAR, gyro_lag_s=lag_s)), calibration)
    assert lagging.payload.number == pytest.approx(
        answered(batch_over_road(*LOAD, seed=66), calibration).payload.number, abs=6.0
    )
    assert lagging.front_share.number == pytest.approx(LOAD[1], abs=0.4)


def test_a_gyro_that_is_far_too_late_is_told(calibration: CrossSpectrumCalibration) -> None:
    late = weighed(batch_over_road(*LOAD, seed=66, car=replace(CAR, gyro_lag_s=0.05)), calibration)
    assert late.rejected == (Why.SENSOR_CHANGED,)


def test_tension_counts_the_vehicle_and_not_the_lag() -> None:
    off = np.zeros(len(DRIFTING))
    off[DRIFTING.index(INDEX["gyro_lag_s"])] = 0.02
    assert tension_of(off) == 0.0
    off[DRIFTING.index(INDEX["damper_rear_nspm"])] = 0.55
    assert tension_of(off) > MOST_TENSION


def test_other_dampers_are_found_and_weighed_by(calibration: CrossSpectrumCalibration) -> None:
    found = answered(batch_over_road(*LOAD, seed=67, car=WITH_OTHER_DAMPERS), calibration)
    assert found.payload.interval95[0] <= LOAD[0] <= found.payload.interval95[1]
    assert found.front_share.interval95[0] <= LOAD[1] <= found.front_share.interval95[1]
    assert found.diagnostics["damper_rear_freed_ratio"] == pytest.approx(1.74, rel=0.1)
    assert found.diagnostics["tension"] < MOST_TENSION


def test_a_vehicle_that_no_drift_explains_is_refused(
    calibration: CrossSpectrumCalibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(located, "LEAST_STRAIN", np.inf)  # no other dampers are thought of
    estimate = weighed(batch_over_road(*LOAD, seed=67, car=WITH_OTHER_DAMPERS), calibration)
    assert not estimate.counted
    assert estimate.diagnostics["tension"] > MOST_TENSION


def test_payload_and_share_say_how_their_errors_go_together(calibration: CrossSpectrumCalibration) -> None:
    """Errors of many batches are correlated as each of them says, in sign at least."""
    estimates = [answered(batch_over_road(*LOAD, seed=200 + k, duration_s=100.0), calibration) for k in range(12)]
    told = float(np.mean([one.payload_front_share_correlation for one in estimates]))
    seen = float(np.corrcoef([[e.payload.number, e.front_share.number] for e in estimates], rowvar=False)[0, 1])
    assert all(-1.0 < one.payload_front_share_correlation < 1.0 for one in estimates)
    if abs(told) > 0.5:
        assert np.sign(seen) == np.sign(told)
