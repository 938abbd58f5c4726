"""The golden car against closed forms."""

import cmath
import math

import numpy as np
import pytest
from support.iri import BASE_M, K1, K2, MU, SPEED_MPS, C, iri_by_section, iri_m_per_km

from gateway.sim.road import PaperRoad, SpectralRoad, iso_roughness_m3


def golden_gain(wavelength_m: float, step_m: float) -> float:
    """|z_s' - z_u'| over the road's slope for a sine, from the equations of motion; 250 mm difference as base."""
    s = 2j * math.pi * SPEED_MPS / wavelength_m
    body = (K2 + C * s) / (s * s + C * s + K2)  # sprung over unsprung
    wheel = K1 / (MU * s * s + (C * s + K2) * (1.0 - body) + K1)
    k = 2.0 * math.pi / wavelength_m
    base = abs(cmath.exp(1j * k * BASE_M) - 1.0) / (BASE_M * k)
    return abs(wheel * (1.0 - body)) * base


@pytest.mark.parametrize("wavelength_m", [1.5, 2.3, 6.0, 15.0, 30.0])
def test_a_sine_gives_its_transfer_function(wavelength_m: float) -> None:
    step_m, amplitude_m = 0.01, 0.002
    way_m = np.arange(round(40 * wavelength_m / step_m) + 5000) * step_m
    slope = amplitude_m * 2.0 * math.pi / wavelength_m
    expected = 1000.0 * slope * golden_gain(wavelength_m, step_m) * 2.0 / math.pi  # mean of |sine|
    profile = amplitude_m * np.sin(2.0 * math.pi * way_m / wavelength_m)
    last = iri_by_section(profile, step_m, 10.0 * wavelength_m)[2:]  # the start has died away
    assert last == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("waviness", [1.5, 1.8, 2.0, 2.2, 2.5])
@pytest.mark.parametrize("road_class", ["A", "C"])
def test_iso_spectra_give_the_known_formula(road_class: str, waviness: float) -> None:
    """IRI = 2.21 sqrt(C 1e6) exp(-0.356 (w-2) + 0.13 (w-2)^2), C at 1 rad/m."""
    roughness = iso_roughness_m3(road_class)
    road = SpectralRoad(roughness, waviness).lay(20_000.0, np.random.default_rng(5))
    from_two = waviness - 2.0
    expected = 2.21 * math.sqrt(roughness * 1e6) * math.exp(-0.356 * from_two + 0.13 * from_two**2)
    assert iri_m_per_km(road.left_m, road.step_m) == pytest.approx(expected, rel=0.05)


def test_the_papers_road_of_6_mm_is_iri_4() -> None:
    road = PaperRoad(sigma_m=0.006).lay(40_000.0, np.random.default_rng(6))
    assert iri_m_per_km(road.left_m, road.step_m) == pytest.approx(4.0, rel=0.03)


def test_flat_and_steadily_rising_roads_are_smooth() -> None:
    way_m = np.arange(2000) * 0.05
    assert iri_m_per_km(np.full(2000, 3.0), 0.05) == 0.0
    assert iri_m_per_km(0.02 * way_m, 0.05) == pytest.approx(0.0, abs=1e-9)


def test_the_sample_step_hardly_matters() -> None:
    fine = SpectralRoad(1e-6, step_m=0.025).lay(5000.0, np.random.default_rng(1))
    coarse = fine.left_m[::5]
    assert iri_m_per_km(coarse, 0.125) == pytest.approx(iri_m_per_km(fine.left_m, 0.025), rel=0.02)


@pytest.mark.parametrize(("n", "step_m", "complaint"), [(100, 0.3, "at most 0.25 m"), (100, 0.05, "longer than 11")])
def test_a_profile_that_the_standard_cannot_take_is_refused(n: int, step_m: float, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        iri_m_per_km(np.zeros(n), step_m)
