"""Roughness: the road's, not the speed's; unknown where nothing tells."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.drives import drive

from gateway.core.estimator import estimate
from gateway.core.scheduler import Scheduler
from gateway.core.settings import BatchSettings
from gateway.core.spectrum import REFERENCE_SPEED_MPS, roughness_mps2
from gateway.estimate_json import estimate_to_json
from gateway.records import Spectra


def spectra(amplitude: float, step_hz: float = 0.2) -> Spectra:
    """White acceleration of this amplitude density."""
    freq_hz = np.arange(0.5, 15.05, step_hz)
    return Spectra(freq_hz, np.full(len(freq_hz), amplitude), *(np.ones(len(freq_hz)) for _ in range(3)))


def test_at_the_reference_speed_it_is_the_root_mean_square_of_the_band() -> None:
    assert roughness_mps2(spectra(0.3), REFERENCE_SPEED_MPS) == pytest.approx(0.3 * math.sqrt(14.0), rel=0.02)


@given(st.floats(3.0, 40.0), st.floats(1.1, 4.0))
def test_a_faster_drive_over_the_same_road_tells_the_same(speed_mps: float, factor: float) -> None:
    """ISO 8608: the same road met ``factor`` times as fast has ``factor`` times the power at every frequency."""
    slow = roughness_mps2(spectra(0.3), speed_mps)
    assert roughness_mps2(spectra(0.3 * math.sqrt(factor)), factor * speed_mps) == pytest.approx(slow)


@given(st.floats(0.01, 3.0), st.floats(1.0, 10.0))
def test_it_grows_as_the_acceleration_does(amplitude: float, factor: float) -> None:
    one = roughness_mps2(spectra(amplitude), 15.0)
    assert roughness_mps2(spectra(factor * amplitude), 15.0) == pytest.approx(factor * one)


@pytest.mark.parametrize("speed_mps", [0.0, math.nan])
def test_without_speed_or_spectra_it_is_unknown(speed_mps: float) -> None:
    assert math.isnan(roughness_mps2(spectra(0.3), speed_mps))
    assert math.isnan(roughness_mps2(None, 15.0))


def test_every_estimate_tells_it_of_its_own_batch() -> None:
    """White acceleration of 0.5 m/s2 at 100 samples a second, at 15 m/s: 14 of its 50 Hz, brought to 80 km/h."""
    motion = drive(30.0)
    scheduler = Scheduler(BatchSettings(window_s=20.0), {})
    (batch, *_) = [*scheduler.feed(motion), *scheduler.flush()]
    found = estimate(batch, None, "cross_spectrum")
    expected = 0.5 * math.sqrt(14.0 / 50.0 * REFERENCE_SPEED_MPS / 15.0)
    assert found.roughness_mps2 == pytest.approx(expected, rel=0.1)
    assert estimate_to_json(found)["roughness_mps2"] == pytest.approx(found.roughness_mps2, rel=1e-5)
