"""Calibrate a known half-car, weigh it, and refuse what cannot be believed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt
from support.half_car_road import (
    CAR,
    KNOWN,
    VAN,
    batch_of,
    batch_over_road,
    calibrated_on_known_loads,
    run_over_road,
    weighed,
)
from support.rolling_road import batch_over_two_tracks, calibrated_with_roll

from gateway.calibration.half_car.fit import SPRINGS_FROM_PRIORS, UNTESTED, calibrate_cross_spectrum, fit_cross_spectrum
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.estimator import (
    UNSEEN_PLACE_PART,
    UNSEEN_ROUGHNESS_SCALE,
    UNSEEN_SPEED_SCALE,
)
from gateway.core.cross_spectrum.measured import cross_spectra_of
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS
from gateway.errors import CalibrationImpossibleError
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_to_json
from gateway.posterior import Source
from gateway.records import F64, Batch, Why


@pytest.fixture(scope="module")
def calibration() -> CrossSpectrumCalibration:
    return calibrated_on_known_loads()


def test_calibration_finds_the_vehicle(calibration: CrossSpectrumCalibration) -> None:
    theta = calibration.parameters
    assert calibration.names == PARAMETERS
    assert np.exp(theta[INDEX["spring_front_npm"]]) == pytest.approx(CAR.front.spring_npm, rel=0.05)
    assert np.exp(theta[INDEX["spring_rear_npm"]]) == pytest.approx(CAR.rear.spring_npm, rel=0.05)
    assert np.exp(theta[INDEX["damper_rear_nspm"]]) == pytest.approx(CAR.rear.damper_nspm, rel=0.05)
    assert np.exp(theta[INDEX["pitch_inertia_kgm2"]]) == pytest.approx(CAR.pitch_inertia_kgm2, rel=0.02)
    assert theta[INDEX["sensor_position_m"]] == pytest.approx(CAR.sensor_position_m, abs=0.02)
    assert calibration.warnings == ()


@pytest.mark.parametrize(("payload_kg", "share_pct"), [(0.0, 52.0), (150.0, 50.0), (350.0, 45.0)])
@pytest.mark.parametrize("speed_mps", [9.0, 14.0, 25.0])
def test_it_weighs_at_any_speed_loads_it_never_saw(
    calibration: CrossSpectrumCalibration, payload_kg: float, share_pct: float, speed_mps: float
) -> None:
    found = weighed(batch_over_road(payload_kg, share_pct, seed=99, speed_mps=speed_mps), calibration)
    assert found.counted
    assert found.payload.number == pytest.approx(payload_kg, abs=20.0)
    assert found.front_share.number == pytest.approx(share_pct, abs=0.5)


@pytest.mark.parametrize(("payload_kg", "share_pct"), [(250.0, 55.0), (400.0, 44.0)])
@pytest.mark.parametrize("mode_hz", [13.0, 17.0])
def test_a_payload_on_pallets_is_weighed_and_its_mode_found(
    calibration: CrossSpectrumCalibration, payload_kg: float, share_pct: float, mode_hz: float
) -> None:
    """Calibration saw it ring at 28 Hz; at 8 Hz one that rings at 13 Hz weighs half as much again."""
    on_pallets = replace(CAR, payload_mode_hz=mode_hz)
    found = weighed(batch_over_road(payload_kg, share_pct, seed=31, car=on_pallets), calibration)
    assert found.payload.number == pytest.approx(payload_kg, abs=25.0)
    assert found.front_share.number == pytest.approx(share_pct, abs=0.6)
    assert found.diagnostics["payload_mode_hz"] == pytest.approx(mode_hz, rel=0.1)


@pytest.mark.parametrize("firmer", [0.96, 1.04])
def test_tyres_of_another_day_stay_within_the_interval(calibration: CrossSpectrumCalibration, firmer: float) -> None:
    today = replace(CAR, rear=replace(CAR.rear, tyre_npm=firmer * CAR.rear.tyre_npm))
    found = weighed(batch_over_road(200.0, 50.0, seed=3, car=today), calibration)
    assert found.payload.interval95[0] <= 200.0 <= found.payload.interval95[1]
    assert found.front_share.interval95[0] <= 50.0 <= found.front_share.interval95[1]


@pytest.mark.parametrize("waviness", [1.6, 2.4])
def test_the_road_drops_out(calibration: CrossSpectrumCalibration, waviness: float) -> None:
    found = weighed(batch_over_road(300.0, 48.0, seed=5, waviness=waviness), calibration)
    assert found.payload.number == pytest.approx(300.0, abs=20.0)
    assert found.front_share.number == pytest.approx(48.0, abs=0.5)


def test_intervals_hold_the_truth(calibration: CrossSpectrumCalibration) -> None:
    """Twenty batches of 95 % intervals: fewer than 16 hits have a chance of 1 in 400."""
    found = [weighed(batch_over_road(200.0, 50.0, seed=seed), calibration) for seed in range(200, 220)]
    assert sum(e.payload.interval95[0] <= 200.0 <= e.payload.interval95[1] for e in found) >= 16
    assert sum(e.front_share.interval95[0] <= 50.0 <= e.front_share.interval95[1] for e in found) >= 16


def test_more_driving_makes_it_surer(calibration: CrossSpectrumCalibration) -> None:
    short = weighed(batch_over_road(200.0, 50.0, seed=3, duration_s=60.0), calibration)
    long = weighed(batch_over_road(200.0, 50.0, seed=3, duration_s=300.0), calibration)
    assert short.counted
    assert long.payload.std < short.payload.std
    assert long.front_share.std < short.front_share.std


def model_variances(found: Estimate) -> F64:
    """Of payload (kg) and front share (%): what the model itself adds, the same at any speed and on any road but for
    how far these are from what calibration saw.
    """
    return np.diag(found.posterior.sources[Source.MODEL][:2, :2]) ** 2


def test_an_unseen_speed_widens_the_interval(calibration: CrossSpectrumCalibration) -> None:
    """Twice the variance for a speed a factor of e^0.5 below the slowest of calibration."""
    batch = batch_over_road(200.0, 50.0, seed=3)
    seen = weighed(batch, calibration)
    slowest_mps = seen.mean_speed_mps * np.exp(UNSEEN_SPEED_SCALE)
    at_other_speeds = replace(calibration, speed_seen_mps=(slowest_mps, 99.0))
    unseen = weighed(batch, at_other_speeds)
    assert unseen.payload.number == seen.payload.number
    roughness = roughness_ratio(calibration)
    factor = (2.0 + roughness) / (1.0 + roughness)
    assert model_variances(unseen) == pytest.approx(factor * model_variances(seen), rel=1e-6)


@pytest.mark.parametrize("rougher", [0.5, 2.0])
def test_another_roughness_widens_the_interval(calibration: CrossSpectrumCalibration, rougher: float) -> None:
    """Friction is known on roads like those of calibration; far from them it is an extrapolation."""
    batch = batch_over_road(200.0, 50.0, seed=3)
    seen = weighed(batch, calibration)
    on_other_roads = replace(calibration, acceleration_rms_mps2=calibration.acceleration_rms_mps2 / rougher)
    unseen = weighed(batch, on_other_roads)
    assert unseen.payload.number == seen.payload.number
    factor = (1.0 + roughness_ratio(on_other_roads)) / (1.0 + roughness_ratio(calibration))
    assert factor > 1.5
    assert model_variances(unseen) == pytest.approx(factor * model_variances(seen), rel=1e-6)


def test_the_lateral_place_hardly_loses_on_other_roads() -> None:
    """Of the growth of the model error's standard deviation, squared, it takes UNSEEN_PLACE_PART squared."""
    rolled, batch = calibrated_with_roll(), batch_over_two_tracks(200.0, 50.0, 0.03, seed=7)
    on_other_roads = replace(
        rolled, acceleration_rms_mps2=3.0 * rolled.acceleration_rms_mps2, model_per_reach=(0.0, 0.0)
    )
    found = weighed(batch, on_other_roads)
    payload, _, place = np.diag(found.posterior.sources[Source.MODEL][:3]) / rolled.model_std
    assert payload > 1.5
    assert place == pytest.approx(np.sqrt(1.0 + UNSEEN_PLACE_PART**2 * (payload**2 - 1.0)), rel=1e-6)


def roughness_ratio(calibration: CrossSpectrumCalibration) -> float:
    """The square of the road's distance from those of calibration, in its scale."""
    spectra = cross_spectra_of([batch_over_road(200.0, 50.0, seed=3)], calibration.reading)
    distance = np.log(spectra.acceleration_rms_mps2 / calibration.acceleration_rms_mps2)
    return float((distance / UNSEEN_ROUGHNESS_SCALE) ** 2)


def test_one_empty_run_is_enough_and_says_so() -> None:
    calibration = calibrate_cross_spectrum([run_over_road(1, 0.0, 52.0)], VAN)
    assert calibration.warnings == (SPRINGS_FROM_PRIORS, UNTESTED)
    found = weighed(batch_over_road(0.0, 52.0, seed=77), calibration)
    assert found.payload.number == pytest.approx(0.0, abs=20.0)


def test_a_zero_point_is_not_believed_at_other_speeds() -> None:
    calibration = calibrate_cross_spectrum([run_over_road(1, 0.0, 52.0)], VAN)
    assert weighed(batch_over_road(0.0, 52.0, seed=77, speed_mps=20.0), calibration).rejected == (
        Why.SPEED_UNCALIBRATED,
    )


def test_the_same_batch_gives_the_same_numbers(calibration: CrossSpectrumCalibration) -> None:
    batch = batch_over_road(120.0, 51.0, seed=8)
    once, again = (estimate_to_json(weighed(batch, calibration)) for _ in range(2))
    assert once == again


def _silent(batch: Batch) -> Batch:
    return replace(
        batch,
        vertical_acceleration_mps2=1e-3 * batch.vertical_acceleration_mps2,
        pitch_rate_radps=1e-3 * batch.pitch_rate_radps,
    )


def _never_steady(batch: Batch) -> Batch:
    t_s = np.arange(len(batch.speed_mps)) / batch.rate_hz
    return replace(batch, speed_mps=14.0 + 6.0 * np.sin(t_s))


def _mostly_masked(batch: Batch) -> Batch:
    return replace(batch, usable=np.arange(len(batch.usable)) < 500)


def _with_lost_frames(batch: Batch) -> Batch:
    """Three frames in ten, one after the other here and there."""
    usable = np.arange(len(batch.usable)) % 200 < 140
    return replace(batch, usable=usable, shares={Why.TOO_SLOW: 0.0, Why.GAP: 0.3})


def _slow_now_and_then(batch: Batch) -> Batch:
    return replace(_with_lost_frames(batch), shares={Why.TOO_SLOW: 0.28, Why.GAP: 0.02})


def _without_pitch_rate(batch: Batch) -> Batch:
    return replace(batch, pitch_rate_radps=np.full(len(batch.pitch_rate_radps), np.nan))


def _without_acceleration(batch: Batch) -> Batch:
    return replace(batch, vertical_acceleration_mps2=np.full(len(batch.usable), np.nan))


def _unrelated(batch: Batch) -> Batch:
    noise = np.random.default_rng(1).standard_normal(len(batch.pitch_rate_radps))
    return replace(batch, pitch_rate_radps=batch.pitch_rate_radps.std() * noise)


def _reversed(batch: Batch) -> Batch:
    return replace(batch, pitch_rate_radps=-batch.pitch_rate_radps)


def _rejected(batch: Batch) -> Batch:
    return replace(batch, rejected=(Why.GAP,))


def _gyro_on_another_axis(batch: Batch) -> Batch:
    """Coherent with the acceleration, but not as any pitching half-car is, and as quiet above what is weighed."""
    low_passed = butter(4, 14.0, fs=batch.rate_hz, output="sos")
    return replace(batch, pitch_rate_radps=sosfilt(low_passed, np.roll(batch.vertical_acceleration_mps2, 9)) * 0.02)


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (_silent, Why.NOT_ENOUGH_EXCITATION),
        (_never_steady, Why.SPEED_SPREAD),
        (_mostly_masked, Why.TOO_SHORT),
        (_with_lost_frames, Why.GAP),
        (_slow_now_and_then, Why.TOO_SLOW),
        (_without_pitch_rate, Why.PITCH_RATE_MISSING),
        (_without_acceleration, Why.ACCELERATION_MISSING),
        (_unrelated, Why.SENSOR_NOISY),
        (_reversed, Why.WRONG_SIGN),
        (_rejected, Why.GAP),
        (_gyro_on_another_axis, Why.MODEL_MISFIT),
    ],
)
def test_it_refuses_with_the_reason(
    spoil: Callable[[Batch], Batch], why: Why, calibration: CrossSpectrumCalibration
) -> None:
    found = weighed(spoil(batch_over_road(200.0, 50.0, seed=4)), calibration)
    assert found.rejected == (why,)
    assert np.isnan(found.payload.number)
    assert np.isnan(found.front_share.number)


def test_calibration_without_driving_says_what_to_do() -> None:
    still = batch_of(np.zeros(15000), np.zeros(15000), np.zeros(15000))
    parked = KnownRun(1, "parked", 0.0, 52.0, (replace(still, usable=np.zeros(15000, bool)),))
    with pytest.raises(CalibrationImpossibleError, match="steady driving"):
        calibrate_cross_spectrum([parked], VAN)


def test_a_vehicle_without_a_pitch_rate_is_told_that_both_sensors_are_needed() -> None:
    batch = batch_over_road(0.0, 52.0, seed=1, duration_s=60.0)
    silent = replace(batch, pitch_rate_radps=np.full(len(batch.pitch_rate_radps), np.nan))
    with pytest.raises(CalibrationImpossibleError, match="both sensors"):
        calibrate_cross_spectrum([KnownRun(1, "run", 0.0, 52.0, (silent,))], VAN)


def test_a_run_left_out_teaches_the_others_nothing_by_its_label() -> None:
    """The fit without a run must not start from a fit that knew its load.

    The last run is tried: the fits before it knew its load and could pass it on.
    """
    *others, last = (run_over_road(i, *load) for i, load in enumerate(KNOWN[:3]))
    relabelled = replace(last, payload_kg=last.payload_kg + 80.0)
    as_told, otherwise = (fit_cross_spectrum([*others, one], VAN).without[last.number] for one in (last, relabelled))
    assert np.array_equal(as_told.parameters, otherwise.parameters)
    assert np.array_equal(as_told.covariance, otherwise.covariance)
    assert as_told.known_loads == otherwise.known_loads


def test_every_step_of_a_fit_is_told() -> None:
    told: list[tuple[int, int]] = []
    fit_cross_spectrum([run_over_road(i, *load) for i, load in enumerate(KNOWN)], VAN, lambda *step: told.append(step))
    assert told == [(i, len(told)) for i in range(1, len(told) + 1)]
