"""Where roll is not to be used, a roll rate changes no bit of any number."""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import VAN
from support.rolling_road import WIDE_VAN, batch_over_two_tracks, calibrated_with_roll, runs_over_two_tracks

from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.half_car.prior import can_roll
from gateway.calibration.known_run import KnownRun
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.lateral import sideways_columns
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.measured import cross_spectra_of
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, ROLL_PARAMETERS
from gateway.core.estimator import estimate
from gateway.core.vehicle import UNKNOWN_OFFSET_STD_M, Vehicle
from gateway.estimate import Estimate
from gateway.records import Batch


def silent(batch: Batch) -> Batch:
    return replace(batch, roll_rate_radps=None)


def runs(*, with_roll: bool) -> list[KnownRun]:
    rolling = runs_over_two_tracks()
    return rolling if with_roll else [replace(run, batches=tuple(map(silent, run.batches))) for run in rolling]


def weighed(batch: Batch, calibration: CrossSpectrumCalibration) -> Estimate:
    calibrated = CalibratedVehicle("sha256:ab", WIDE_VAN, (0.0, 0.0), (0.0, 0.0), cross_spectrum=calibration)
    return estimate(batch, calibrated, "cross_spectrum")


def assert_same(one: CrossSpectrumCalibration, other: CrossSpectrumCalibration) -> None:
    assert one.names == other.names == PARAMETERS
    np.testing.assert_array_equal(one.parameters, other.parameters)
    np.testing.assert_array_equal(one.covariance, other.covariance)
    np.testing.assert_array_equal(one.directions, other.directions)
    blank = dict.fromkeys(("parameters", "covariance", "directions"), np.empty(0))
    assert repr(replace(one, **blank)) == repr(replace(other, **blank))


@pytest.fixture(scope="module")
def unrolled() -> CrossSpectrumCalibration:
    """Of a van that could roll, from drives without a roll rate."""
    return calibrate_cross_spectrum(runs(with_roll=False), WIDE_VAN)


def test_a_calibration_without_roll_weighs_the_same_with_a_roll_rate_and_without(
    unrolled: CrossSpectrumCalibration,
) -> None:
    batch = batch_over_two_tracks(200.0, 50.0, 0.03, seed=7)
    with_roll, without = weighed(batch, unrolled), weighed(silent(batch), unrolled)
    assert without.counted
    assert with_roll.roll_usable_share == 1.0  # the one thing that it tells
    assert repr(replace(with_roll, roll_usable_share=np.nan)) == repr(without)
    assert not np.isfinite(with_roll.cg_left.number)


def test_one_run_without_a_roll_rate_and_none_is_used(unrolled: CrossSpectrumCalibration) -> None:
    first, second = runs(with_roll=True)
    mixed = [replace(first, batches=tuple(silent(batch) for batch in first.batches)), second]
    assert_same(calibrate_cross_spectrum(mixed, WIDE_VAN), unrolled)


@pytest.mark.parametrize(
    "vehicle",
    [
        replace(WIDE_VAN, track_width_m=None),
        replace(WIDE_VAN, sensor_offset_left_std_m=UNKNOWN_OFFSET_STD_M),
    ],
    ids=["no track stated", "sensor somewhere"],
)
def test_a_vehicle_of_which_too_little_is_known_does_not_use_roll(vehicle: Vehicle) -> None:
    assert not can_roll(vehicle)
    rolling, flat = (calibrate_cross_spectrum(runs(with_roll=with_roll), vehicle) for with_roll in (True, False))
    assert_same(rolling, flat)


@pytest.fixture(scope="module")
def rolled() -> CrossSpectrumCalibration:
    return calibrated_with_roll()


def test_a_roll_rate_is_used_where_enough_is_known(rolled: CrossSpectrumCalibration) -> None:
    assert can_roll(WIDE_VAN)
    assert not can_roll(VAN)
    assert rolled.names == PARAMETERS + ROLL_PARAMETERS
    answer = weighed(batch_over_two_tracks(200.0, 50.0, 0.03, seed=7), rolled)
    low, high = answer.cg_left.interval95
    assert low <= 0.03 <= high
    assert answer.cg_left.number > 0.0


def test_a_lost_roll_rate_leaves_what_a_load_to_either_side_does_alike(
    rolled: CrossSpectrumCalibration, unrolled: CrossSpectrumCalibration
) -> None:
    """Half of what two sides differ by would be nothing; of a vehicle never seen to roll it is all there is."""
    point = Point(rolled.parameters, 200.0, 0.5)
    spectra = cross_spectra_of([silent(batch_over_two_tracks(200.0, 50.0, 0.03, seed=7))], rolled.reading)
    assert spectra is not None
    alike = sideways_columns(spectra, point, rolled, lambda _: np.array([200.0, 0.52]))
    np.testing.assert_allclose(alike.T @ alike, [[0.0, 0.0], [0.0, 0.02**2]], atol=1e-12)
    flat = replace(point, theta=unrolled.parameters)
    assert not sideways_columns(spectra, flat, unrolled, lambda _: np.array([200.0, 0.52])).any()
