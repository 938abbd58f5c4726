"""The fit of a half-car: directions left open, drives it cannot use, and roll rates that it must not use."""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import VAN
from support.known_runs import known_run
from support.rolling_road import WIDE_VAN, batch_over_two_tracks, calibrated_with_roll, runs_over_two_tracks

from gateway.calibration.half_car.fit import MOST, SCALES, calibrate_cross_spectrum, directions_of, fit_cross_spectrum
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
from gateway.errors import CalibrationImpossibleError
from gateway.estimate import Estimate
from gateway.records import Batch


def made(n: int, n_loads: int, seed: int) -> tuple[list[np.ndarray], np.ndarray]:
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((n, n)) * 0.1
    return [rng.standard_normal((3, n)) * SCALES[:, None] for _ in range(n_loads)], root @ root.T


@pytest.mark.parametrize("n_loads", [1, 2])
def test_loads_that_they_were_made_from_have_their_whole_covariance(n_loads: int) -> None:
    """Up to MOST numbers: 3 of one load, 6 of two."""
    moves, covariance = made(30, n_loads, 1)
    directions = directions_of(moves, covariance)
    for one in moves:
        by_directions = one @ directions
        assert by_directions @ by_directions.T == pytest.approx(one @ covariance @ one.T, rel=1e-6, abs=1e-9)


def test_they_never_claim_more_than_the_covariance() -> None:
    moves, covariance = made(30, 12, 2)
    directions = directions_of(moves, covariance)
    assert directions.shape == (30, MOST)
    assert np.linalg.eigvalsh(covariance - directions @ directions.T).min() > -1e-9
    for other in made(30, 5, 3)[0]:
        claimed = other @ directions @ directions.T @ other.T
        assert np.linalg.eigvalsh((other @ covariance @ other.T - claimed) / np.outer(SCALES, SCALES)).min() > -1e-9


def test_what_moves_no_load_is_left_out() -> None:
    moves, covariance = made(30, 2, 4)
    for one in moves:
        one[:, 10:] = 0.0
    diagonal = np.diag(np.diag(covariance))
    assert np.abs(directions_of(moves, diagonal)[10:]).max() < 1e-9


def test_causes_are_independent_and_of_unit_variance() -> None:
    """F = C^(1/2) V with V orthonormal, so that F' C^-1 F is the identity."""
    moves, covariance = made(20, 6, 5)
    directions = directions_of(moves, covariance)
    assert directions.T @ np.linalg.inv(covariance) @ directions == pytest.approx(np.eye(MOST), abs=1e-6)


def test_loads_with_and_without_a_place_may_be_mixed() -> None:
    moves, covariance = made(30, 2, 6)
    directions = directions_of([moves[0], moves[1][:2]], covariance)
    found = moves[1][:2] @ directions
    assert found @ found.T == pytest.approx(moves[1][:2] @ covariance @ moves[1][:2].T, rel=1e-6)


def unsteady_run() -> KnownRun:
    """Eight stretches of a segment each, every one faster than that before it."""
    run = known_run(1, 0.0, None, seed=1)
    (batch,) = run.batches
    usable, speed_mps = np.zeros_like(batch.usable), batch.speed_mps.copy()
    for i in range(8):
        usable[1000 * i : 1000 * i + 256] = True
        speed_mps[1000 * i : 1000 * (i + 1)] = 8.0 * 1.12**i
    return replace(run, batches=(replace(batch, usable=usable, speed_mps=speed_mps),))


def test_it_is_refused_in_words_for_a_fitter() -> None:
    with pytest.raises(CalibrationImpossibleError, match="drive at an even speed"):
        fit_cross_spectrum([unsteady_run()], VAN)


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
