"""Loads that lie long or short: what a batch cannot tell of them is in the interval, what is stated is made use of."""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import CAR, VAN, batch_over_road, weighed

from gateway.calibration.half_car import calibrate_cross_spectrum
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum import locate, spread
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.measured import cross_spectra_of
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.core.cross_spectrum.spread import PIECES_SCATTER, as_carried, gyration_std_m2, spread_covariance
from gateway.estimate import Estimate

GYRATION = INDEX["payload_gyration_m2"]
LONG_M = 2.4
LONG = replace(CAR, payload_gyration_m2=LONG_M**2 / 12.0)
KNOWN = [
    KnownRun(number, f"run {number}", kg, share_pct, (batch_over_road(kg, share_pct, seed=number),))
    for number, (kg, share_pct) in enumerate(((0.0, 52.0), (200.0, 50.0), (420.0, 44.0), (300.0, 41.0)), 1)
]
LOADS = ((400.0, 46.0), (300.0, 50.0), (450.0, 40.0))


@pytest.fixture(scope="module")
def calibration() -> CrossSpectrumCalibration:
    """Of loads that lie in one place each."""
    return calibrate_cross_spectrum(KNOWN, VAN)


def stating(calibration: CrossSpectrumCalibration, length_m: float) -> CrossSpectrumCalibration:
    return replace(calibration, payload_length_m=length_m)


def error_kg(found: Estimate, payload_kg: float) -> float:
    return found.payload.number - payload_kg


@pytest.mark.parametrize(("payload_kg", "share_pct"), LOADS)
def test_a_load_all_along_the_floor_is_found_too_light_and_within_the_interval(
    payload_kg: float, share_pct: float, calibration: CrossSpectrumCalibration
) -> None:
    short = weighed(batch_over_road(payload_kg, share_pct, seed=7), calibration)
    long = weighed(batch_over_road(payload_kg, share_pct, seed=7, car=LONG), calibration)
    assert long.payload.number < short.payload.number - 20.0
    for found in (short, long):
        assert found.payload.interval95[0] <= payload_kg <= found.payload.interval95[1]


@pytest.mark.parametrize(("payload_kg", "share_pct"), LOADS)
def test_the_interval_foretells_what_another_length_does(
    payload_kg: float, share_pct: float, calibration: CrossSpectrumCalibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Weighed with a squared radius of gyration a standard deviation above and below the stated one's."""
    spectra = cross_spectra_of([batch_over_road(payload_kg, share_pct, seed=7)], calibration.reading)
    assert spectra is not None
    shorter, as_said, longer = (
        locate(spectra, stating(calibration, LONG_M * float(np.sqrt(part))))
        for part in (1.0 - PIECES_SCATTER, 1.0, 1.0 + PIECES_SCATTER)
    )
    moved_kg = 0.5 * (longer.point.payload_kg - shorter.point.payload_kg)
    monkeypatch.setattr(spread, "PIECES_SCATTER", 0.0)
    known_well = locate(spectra, stating(calibration, LONG_M))
    assert known_well.point.payload_kg == as_said.point.payload_kg
    added_kg = float(np.sqrt(as_said.drift_covariance[0, 0] - known_well.drift_covariance[0, 0]))
    linear_kg = added_kg / (1.0 + added_kg / as_said.point.payload_kg)  # added = linear / (1 - linear / load)
    assert linear_kg == pytest.approx(moved_kg, rel=0.15)


@pytest.mark.parametrize(("payload_kg", "share_pct"), LOADS)
def test_a_stated_length_takes_the_bias_out(
    payload_kg: float, share_pct: float, calibration: CrossSpectrumCalibration
) -> None:
    batch = batch_over_road(payload_kg, share_pct, seed=7, car=LONG)
    unsaid, said = weighed(batch, calibration), weighed(batch, stating(calibration, LONG_M))
    assert abs(error_kg(said, payload_kg)) < abs(error_kg(unsaid, payload_kg)) / 2.0


def test_a_pallet_that_is_stated_is_weighed_with_less_doubt(calibration: CrossSpectrumCalibration) -> None:
    batch = batch_over_road(400.0, 46.0, seed=7)
    unsaid, said = weighed(batch, calibration), weighed(batch, stating(calibration, 1.1))
    assert said.payload.std < unsaid.payload.std / 1.5
    assert said.payload.number == pytest.approx(400.0, abs=20.0)


def test_what_is_not_stated_weighs_by_what_was_known(calibration: CrossSpectrumCalibration) -> None:
    assert as_carried(calibration) is calibration
    known_m2 = float(np.exp(calibration.parameters[GYRATION]))
    floor_m2 = (0.8 * VAN.wheelbase_m) ** 2 / 12.0
    half_and_half = np.sqrt(0.5 * (floor_m2 - known_m2) ** 2 + 0.5 * (0.5 * floor_m2) ** 2)
    assert gyration_std_m2(calibration) == pytest.approx(half_and_half)


def test_pieces_anywhere_scatter_as_is_said() -> None:
    """Five of one weight, anywhere on a floor: the squared radius of gyration scatters by half of its mean."""
    places_m = np.random.default_rng(1).uniform(0.0, LONG_M, (200_000, 5))
    squared_m2 = places_m.var(axis=1)
    assert squared_m2.std() / squared_m2.mean() == pytest.approx(PIECES_SCATTER, abs=0.02)


def test_a_stated_length_takes_the_place_of_the_known_one(calibration: CrossSpectrumCalibration) -> None:
    carried = as_carried(stating(calibration, LONG_M))
    assert np.exp(carried.parameters[GYRATION]) == pytest.approx(LONG_M**2 / 12.0)
    assert not carried.covariance[GYRATION].any()
    assert not carried.covariance[:, GYRATION].any()
    others = [i for i in range(len(calibration.parameters)) if i != GYRATION]
    assert np.array_equal(carried.parameters[others], calibration.parameters[others])
    assert np.array_equal(carried.covariance[np.ix_(others, others)], calibration.covariance[np.ix_(others, others)])


def test_nothing_aboard_has_no_length(calibration: CrossSpectrumCalibration) -> None:
    """Nor does a load of less than nothing, which is an empty vehicle weighed a little low, ask for a division."""
    for payload_kg in (0.0, -10.0):
        assert np.isfinite(spread_covariance(np.array([-5.0, 0.01]), payload_kg, calibration)).all()
    empty = weighed(batch_over_road(0.0, 52.0, seed=7), calibration)
    assert empty.diagnostics["payload_drift_std_kg"] < 20.0


def test_left_out_runs_are_weighed_as_known_loads(calibration: CrossSpectrumCalibration) -> None:
    """Whatever the vehicle carries: else a stated length would show as error, and widen all intervals."""
    stated = calibrate_cross_spectrum(KNOWN, replace(VAN, payload_length_m=LONG_M))
    assert stated.payload_length_m == LONG_M
    assert np.array_equal(stated.parameters, calibration.parameters)
    for name in ("payload_inflation", "front_share_inflation", "misfit_limit", "most_position_score"):
        assert getattr(stated, name) == getattr(calibration, name)
