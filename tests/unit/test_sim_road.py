"""Roads have the spectra, coherence and obstacles asked for, and drives over them are smooth and honest."""

import math

import numpy as np
import pytest
from scipy import signal

from gateway.sim.obstacles import Bump, ObstacleRoad, with_bumps
from gateway.sim.road import PaperRoad, Road, SpectralRoad
from gateway.sim.speed_profile import Leg, constant, drive_of, motorway, rural, standstill, urban


def test_the_papers_road_has_its_variance_and_memory() -> None:
    """(1) in space: variance sigma^2, autocovariance sigma^2 exp(-0.15 s)."""
    road = PaperRoad(sigma_m=0.006).lay(200_000.0, np.random.default_rng(3))
    height = road.left_m
    assert np.std(height) == pytest.approx(0.006, rel=0.02)
    for lag_m in (1.0, 5.0, 10.0):
        lag = round(lag_m / road.step_m)
        assert np.mean(height[lag:] * height[:-lag]) == pytest.approx(0.006**2 * math.exp(-0.15 * lag_m), rel=0.06)


@pytest.mark.parametrize("waviness", [1.8, 2.0, 2.5])
def test_the_spectrum_is_the_one_asked_for(waviness: float) -> None:
    recipe = SpectralRoad(4e-6, waviness)
    road = recipe.lay(40_000.0, np.random.default_rng(4))
    wave, density = signal.welch(road.right_m, 1.0 / road.step_m, nperseg=8192)
    omega, density_per_rad = 2.0 * np.pi * wave, density / (2.0 * np.pi)
    for low, high in ((0.3, 0.6), (0.6, 2.0), (2.0, 8.0), (8.0, 30.0)):
        band = (omega >= low) & (omega < high)
        assert np.sum(density_per_rad[band]) == pytest.approx(np.sum(recipe.spectrum_m3(omega[band])), rel=0.08)


def test_the_tracks_coherence_falls_at_short_waves() -> None:
    recipe = SpectralRoad(4e-6, coherence_decay_m=0.7)
    road = recipe.lay(60_000.0, np.random.default_rng(4))
    wave, coherence = signal.coherence(road.left_m, road.right_m, 1.0 / road.step_m, nperseg=4096)
    omega = 2.0 * np.pi * wave
    for low, high in ((0.2, 0.4), (0.8, 1.2), (1.8, 2.2)):
        band = (omega >= low) & (omega < high)
        expected = np.mean(np.exp(-0.7 * omega[band]) ** 2)
        assert np.mean(coherence[band]) == pytest.approx(expected, abs=0.04)


def test_a_tyre_averages_over_its_patch() -> None:
    way_m = np.arange(4001) * 0.05
    sine = Road(0.05, np.sin(2.0 * np.pi * way_m / 1.0), 0.3 * way_m)
    felt = sine.enveloped(0.25)
    inner = slice(10, -10)
    k = np.pi / 1.0
    assert np.max(felt.left_m[inner]) == pytest.approx(math.sin(k * 0.25) / (5 * math.sin(k * 0.05)), rel=1e-3)
    assert felt.right_m[inner] == pytest.approx(sine.right_m[inner])
    assert sine.enveloped(0.0) is sine


def test_a_pothole_lies_under_one_wheel_and_a_hump_under_both() -> None:
    flat = Road(0.05, np.zeros(400), np.zeros(400))
    built = with_bumps(flat, [Bump(5.0, 0.5, -0.04, is_right=False), Bump(12.0, 3.7, 0.08)])
    assert np.min(built.left_m) == pytest.approx(-0.04)
    assert np.min(built.right_m) == 0.0
    assert np.max(built.left_m) == np.max(built.right_m) == pytest.approx(0.08)
    raised = np.flatnonzero(built.right_m) * 0.05
    assert raised[0] > 12.0 - 1.86
    assert raised[-1] < 12.0 + 1.86
    assert not flat.left_m.any()


RANDOM = {"urban": (urban, 0.0, 52.0), "rural": (rural, 0.0, 100.0), "motorway": (motorway, 0.0, 131.0)}


@pytest.mark.parametrize("kind", RANDOM)
def test_random_drives_keep_to_their_speeds_and_stop_at_the_end(kind: str) -> None:
    make, low_kmh, high_kmh = RANDOM[kind]
    drive = make(900.0, np.random.default_rng(1))
    assert np.min(drive.speed_mps) * 3.6 >= low_kmh
    assert 0.75 * high_kmh < np.max(drive.speed_mps) * 3.6 <= high_kmh
    assert drive.speed_mps[0] == drive.speed_mps[-1] == 0.0
    assert drive.duration_s == pytest.approx(900.0, abs=300.0)


def test_curves_are_driven_only_in_motion() -> None:
    drive = urban(900.0, np.random.default_rng(4))
    assert np.std(drive.lateral_mps2) > 0.1
    assert not drive.lateral_mps2[drive.speed_mps == 0.0].any()


def test_drives_join_where_their_speeds_meet() -> None:
    stop, go = standstill(10.0), drive_of([Leg(10.0, 5.0), Leg(0.0, 2.0)])
    whole = go.then(stop).then(go)
    assert whole.duration_s == pytest.approx(2 * go.duration_s + 10.0)
    assert whole.part(go.duration_s, go.duration_s + 10.0).speed_mps.max() == 0.0
    with pytest.raises(ValueError, match=r"ends at 0\.0 m/s cannot go on at 12\.0 m/s"):
        stop.then(constant(12.0, 5.0, np.random.default_rng(1), 0.0))


def test_obstacles_are_as_frequent_as_asked() -> None:
    flat = SpectralRoad(1e-12)
    road = ObstacleRoad(flat, potholes_per_km=5.0, humps_per_km=1.0).lay(20_000.0, np.random.default_rng(2))
    deep = (np.minimum(road.left_m, road.right_m) < -0.005).astype(int)
    high = (road.left_m > 0.04).astype(int)
    assert np.count_nonzero(np.diff(deep) == 1) == pytest.approx(100, abs=25)
    assert np.count_nonzero(np.diff(high) == 1) == pytest.approx(20, abs=10)
