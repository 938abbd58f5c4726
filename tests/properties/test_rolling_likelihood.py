"""The likelihood of three sensors: its derivatives, and what it must not depend on."""

from dataclasses import replace

import numpy as np
import pytest
from support.rolling_road import WIDE_VAN, batch_over_two_tracks

from gateway.calibration.half_car.prior import prior_of
from gateway.core.cross_spectrum.lateral import ROLL_BAND_HZ
from gateway.core.cross_spectrum.likelihood import Point, Whittle
from gateway.core.cross_spectrum.measured import CrossSpectra, cross_spectra_of
from gateway.core.cross_spectrum.model.driven import spectral_model
from gateway.core.cross_spectrum.model.expected import expected_spectra
from gateway.core.cross_spectrum.model.matrix import SpectralMatrix
from gateway.core.cross_spectrum.model.parameters import INDEX, Ground, names_of, upright
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.records import F64

GROUND = Ground.of(WIDE_VAN, with_roll=True)
READING = Reading(WIDE_VAN.wheelbase_m, (1.1, 14.0), 256, with_roll=True)
LOADED = (150.0, 0.49, 0.03)
STEPS = (1.0, 1e-4, 1e-4)  # of payload in kg, front share, lateral place in m


@pytest.fixture(scope="module")
def spectra() -> CrossSpectra:
    found = cross_spectra_of([batch_over_two_tracks(150.0, 49.0, 0.04, 1, duration_s=60.0)], READING)
    assert found.n_sensors == 3
    return found


def rolling_theta() -> F64:
    """Near the prior's mean, with nothing left at zero."""
    theta = prior_of(WIDE_VAN, with_roll=True).mean.copy()
    theta[[INDEX["gyro_yaw_rad"], INDEX["empty_left_m"], INDEX["sensor_left_m"]]] = 0.03, 0.01, 0.25
    theta[[INDEX["gyro_lag_s"], INDEX["twist_level"], INDEX["damper_against_rear"]]] = 0.004, 0.2, -0.1
    return theta


@pytest.mark.parametrize("band_hz", [READING.band_hz, ROLL_BAND_HZ], ids=["everywhere", "where the body rolls"])
@pytest.mark.parametrize("usually", [0.5, 1.0, 3.0])
def test_the_gradient_is_the_slope_of_the_cost(
    band_hz: tuple[float, float], usually: float, spectra: CrossSpectra
) -> None:
    """For every parameter of a vehicle that rolls, and for the load, wherever axles move as they usually do or not."""
    moving = replace(spectra, log_strokes=spectra.log_amplitude - np.log([[usually, usually**0.5]]))
    whittle = Whittle(moving.within(band_hz), GROUND)
    theta = rolling_theta()
    n = len(theta)
    gradient = whittle.curvature(Point(theta, *LOADED), range(n + 3)).gradient
    for entry, name in enumerate(names_of(theta)):
        up, down = theta.copy(), theta.copy()
        up[entry] += 1e-4
        down[entry] -= 1e-4
        slope = (whittle.cost(Point(up, *LOADED)) - whittle.cost(Point(down, *LOADED))) / 2e-4
        assert gradient[entry] == pytest.approx(slope, rel=1e-3, abs=1e-2), name
    for i, step in enumerate(STEPS):
        up_load, down_load = list(LOADED), list(LOADED)
        up_load[i] += step
        down_load[i] -= step
        slope = (whittle.cost(Point(theta, *up_load)) - whittle.cost(Point(theta, *down_load))) / (2.0 * step)
        assert gradient[n + i] == pytest.approx(slope, rel=1e-3, abs=1e-2), i


def test_the_information_is_that_of_the_expected_second_derivative(spectra: CrossSpectra) -> None:
    """Held against spectra that are just as expected, cost curves as Fisher says."""
    theta = rolling_theta()
    model = spectral_model(theta, LOADED, GROUND, spectra.freq_hz, 3)
    exact = spectra.showing(expected_spectra(model, spectra))
    whittle = Whittle(exact, GROUND)
    n = len(theta)
    free = [INDEX["roll_inertia_kgm2"], INDEX["sensor_left_m"], INDEX["twist_level"], n, n + 2]
    found = whittle.curvature(Point(theta, *LOADED), free)
    np.testing.assert_allclose(found.gradient, 0.0, atol=1e-6 * np.max(np.sqrt(np.diag(found.information))))

    def cost(moved: F64) -> float:
        there, load = theta.copy(), list(LOADED)
        for entry, by in zip(free, moved.tolist(), strict=True):
            if entry < n:
                there[entry] += by
            else:
                load[entry - n] += by
        return whittle.cost(Point(there, *load))

    at = cost(np.zeros(len(free)))
    for i in range(len(free)):
        step = 0.02 / np.sqrt(found.information[i, i]) * np.eye(len(free))[i]
        second = (cost(step) - 2.0 * at + cost(-step)) / float(step[i]) ** 2
        assert second == pytest.approx(found.information[i, i], rel=1e-3), free[i]


@pytest.mark.parametrize("gain", [1e-3, 1e3])
def test_the_roads_level_does_not_matter(gain: float, spectra: CrossSpectra) -> None:
    louder = spectra.showing(SpectralMatrix(gain * spectra.matrix.auto, gain * spectra.matrix.cross))
    here, there = Point(rolling_theta(), 0.0, 0.52, 0.0), Point(rolling_theta(), 300.0, 0.47, 0.05)
    difference = Whittle(spectra, GROUND).cost(here) - Whittle(spectra, GROUND).cost(there)
    assert Whittle(louder, GROUND).cost(here) - Whittle(louder, GROUND).cost(there) == pytest.approx(difference)


def test_mirrored_spectra_cost_what_a_mirrored_load_does(spectra: CrossSpectra) -> None:
    mirrored = replace(
        spectra,
        roll=replace(
            spectra.roll,
            with_acceleration=-spectra.roll.with_acceleration,
            with_pitch_rate=-spectra.roll.with_pitch_rate,
        ),
    )
    theta, other = rolling_theta(), rolling_theta()
    other[[INDEX["gyro_yaw_rad"], INDEX["empty_left_m"], INDEX["sensor_left_m"]]] *= -1.0
    one = Whittle(spectra, GROUND).cost(Point(theta, *LOADED))
    assert Whittle(mirrored, GROUND).cost(Point(other, *LOADED[:2], -LOADED[2])) == pytest.approx(one, rel=1e-12)


def test_two_sensors_of_a_car_that_is_level_are_those_of_the_half_car(spectra: CrossSpectra) -> None:
    """With load and sensor on the centre line roll tells nothing of two sensors, as long as tracks are alike."""
    theta = rolling_theta()
    theta[[INDEX["gyro_yaw_rad"], INDEX["empty_left_m"], INDEX["sensor_left_m"]]] = 0.0
    flat = Whittle(spectra.without_roll, GROUND)
    rolling, half = flat.cost(Point(theta, *LOADED[:2], 0.0)), flat.cost(Point(upright(theta), *LOADED[:2]))
    assert rolling == pytest.approx(half, rel=1e-10)


@pytest.mark.parametrize("flat", [False, True], ids=["three sensors", "two"])
def test_points_cost_together_what_each_costs_alone(flat: bool, spectra: CrossSpectra) -> None:
    theta = rolling_theta()
    points = [Point(theta, *LOADED), Point(theta, 300.0, 0.47, -0.05), Point(1.01 * theta, 0.0, 0.52)]
    if flat:
        spectra, points = spectra.without_roll, [replace(one, theta=upright(one.theta)) for one in points]
    whittle = Whittle(spectra, GROUND)
    np.testing.assert_allclose(whittle.costs(points), [whittle.cost(one) for one in points], rtol=1e-12)
