"""The likelihood's derivatives, and what it must not depend on."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.half_car_road import VAN, batch_over_road

from gateway.calibration.half_car.prior import prior_of
from gateway.core.cross_spectrum.likelihood import Point, Whittle
from gateway.core.cross_spectrum.measured import CrossSpectra, cross_spectra_of
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, Ground
from gateway.core.cross_spectrum.model.reading import Reading

GROUND = Ground.of(VAN)
READING = Reading(VAN.wheelbase_m, (1.1, 14.0), 256)


def spectra_of(reading: Reading) -> CrossSpectra:
    found = cross_spectra_of([batch_over_road(200.0, 50.0, seed=1, duration_s=60.0)], reading)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def spectra() -> CrossSpectra:
    return spectra_of(READING)


@pytest.mark.parametrize(("usually", "is_noisy"), [(0.5, False), (1.0, False), (3.0, False), (1.0, True)])
def test_the_gradient_is_the_slope_of_the_cost(usually: float, is_noisy: bool, spectra: CrossSpectra) -> None:
    """Wherever the vehicle moves more or less than it usually does, and where sensors have become noisy, too."""
    own = spectra.reading.usual_log_amplitude
    assert own is not None
    usual_log_amplitude = own + np.log(usually)
    read = spectra_of(replace(READING, usual_log_amplitude=usual_log_amplitude))
    if is_noisy:
        read = replace(read, noise=np.outer([1e-4, 1e-6], np.linspace(1.0, 3.0, read.acceleration.shape[1])))
    whittle = Whittle(read, GROUND)
    prior = prior_of(VAN)
    free = list(range(len(PARAMETERS)))
    point = Point(prior.mean, 150.0, 0.49)
    gradient = whittle.curvature(point, [*free, len(free), len(free) + 1]).gradient
    for entry, name in enumerate(PARAMETERS):
        up, down = prior.mean.copy(), prior.mean.copy()
        up[entry] += 1e-4
        down[entry] -= 1e-4
        slope = (whittle.cost(Point(up, 150.0, 0.49)) - whittle.cost(Point(down, 150.0, 0.49))) / 2e-4
        assert gradient[entry] == pytest.approx(slope, rel=1e-3, abs=1e-2), name
    by_payload = (whittle.cost(Point(prior.mean, 151.0, 0.49)) - whittle.cost(Point(prior.mean, 149.0, 0.49))) / 2.0
    by_share = (whittle.cost(Point(prior.mean, 150.0, 0.4901)) - whittle.cost(Point(prior.mean, 150.0, 0.4899))) / 2e-4
    assert gradient[-2] == pytest.approx(by_payload, rel=1e-3)
    assert gradient[-1] == pytest.approx(by_share, rel=1e-3)


def test_what_is_asked_in_two_steps_is_what_is_asked_at_once(spectra: CrossSpectra) -> None:
    """A search asks for some parameters in its own order, and the answer at its end for all."""
    point = Point(prior_of(VAN).mean, 150.0, 0.49)
    n = len(PARAMETERS)
    some, every = [n + 1, *range(20, 40, 3), 2, n], range(n + 2)
    stepwise = Whittle(spectra, GROUND)
    first, then = stepwise.curvature(point, some), stepwise.curvature(point, every)
    at_once = Whittle(spectra, GROUND).curvature(point, every)
    np.testing.assert_allclose(then.gradient, at_once.gradient, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(then.information, at_once.information, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(first.gradient, at_once.gradient[some], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(first.information, at_once.information[np.ix_(some, some)], rtol=1e-9, atol=1e-9)


@settings(max_examples=20)
@given(gain=st.floats(1e-3, 1e3))
def test_the_roads_level_does_not_matter(gain: float, spectra: CrossSpectra) -> None:
    louder = replace(
        spectra,
        acceleration=gain * spectra.acceleration,
        pitch_rate=gain * spectra.pitch_rate,
        cross=gain * spectra.cross,
    )
    prior = prior_of(VAN)
    here, there = Point(prior.mean, 0.0, 0.52), Point(prior.mean, 300.0, 0.47)
    difference = Whittle(spectra, GROUND).cost(here) - Whittle(spectra, GROUND).cost(there)
    assert Whittle(louder, GROUND).cost(here) - Whittle(louder, GROUND).cost(there) == pytest.approx(difference)


def test_a_batch_scaled_gives_the_same_spectra() -> None:
    batch = batch_over_road(200.0, 50.0, seed=2, duration_s=60.0)
    quieter = replace(
        batch,
        vertical_acceleration_mps2=0.5 * batch.vertical_acceleration_mps2,
        pitch_rate_radps=0.5 * batch.pitch_rate_radps,
    )
    one, other = cross_spectra_of([batch], READING), cross_spectra_of([quieter], READING)
    np.testing.assert_allclose(one.cross, other.cross, rtol=1e-9)
    assert other.acceleration_rms_mps2 == pytest.approx(0.5 * one.acceleration_rms_mps2)


def test_masked_samples_leave_no_trace() -> None:
    """Whatever stands in a masked stretch, the spectra are the same."""
    batch = batch_over_road(200.0, 50.0, seed=3, duration_s=120.0)
    masked = (np.arange(len(batch.usable)) < 2000) | (np.arange(len(batch.usable)) > 2400)
    spoilt = batch.vertical_acceleration_mps2.copy()
    spoilt[~masked] = np.nan
    one = cross_spectra_of([replace(batch, usable=masked)], READING)
    other = cross_spectra_of([replace(batch, usable=masked, vertical_acceleration_mps2=spoilt)], READING)
    np.testing.assert_array_equal(one.cross, other.cross)
