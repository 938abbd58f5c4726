"""Roads have the spectra, coherence and obstacles asked for, and drives over them are smooth and honest."""

import cmath
import math
from collections.abc import Callable
from typing import Final

import numpy as np
import pytest
from scipy import signal
from scipy.linalg import expm

from gateway.records import F64
from gateway.sim.compiled import compiled
from gateway.sim.obstacles import Bump, ObstacleRoad, UnevenRoad, with_bumps
from gateway.sim.road import PaperRoad, Road, RoadRecipe, SpectralRoad, iso_road, iso_roughness_m3
from gateway.sim.speed_profile import STEP_S, Drive, Leg, constant, drive_of, motorway, rural, standstill, urban

SPEED_MPS: Final = 80.0 / 3.6
K1: Final = 653.0  # tyre rate over sprung mass [1/s2]
K2: Final = 63.3  # spring rate over sprung mass [1/s2]
C: Final = 6.0  # damper rate over sprung mass [1/s]
MU: Final = 0.15  # unsprung over sprung mass
BASE_M: Final = 0.25  # tyre enveloping: moving average
START_M: Final = 11.0  # the first half second at 80 km/h sets the initial slopes


def iri_m_per_km(height_m: F64, step_m: float) -> float:
    """IRI of a profile of heights (n,) every step_m.

    Raises ValueError for a step over 0.25 m and for a profile shorter than the 11 m from which the
    initial state is taken.
    """
    return float(np.mean(np.abs(_travel_slopes(height_m, step_m)))) * 1000.0


def iri_by_section(height_m: F64, step_m: float, section_m: float) -> F64:
    """IRI of each full section_m of the profile (k,), the quarter car running on through all of them."""
    per_section = round(section_m / step_m)
    slopes = np.abs(_travel_slopes(height_m, step_m))
    k = len(slopes) // per_section
    return slopes[: k * per_section].reshape(k, per_section).mean(axis=1) * 1000.0


def golden_car() -> tuple[F64, F64]:
    """dx/dt = A x + B y: y the road's slope; x the slopes of the sprung and unsprung paths and their rates of change.

    x = (z_s', dz_s'/dt, z_u', dz_u'/dt), A (4, 4), B (4,).
    """
    a = np.array(
        [[0.0, 1.0, 0.0, 0.0], [-K2, -C, K2, C], [0.0, 0.0, 0.0, 1.0], [K2 / MU, C / MU, -(K1 + K2) / MU, -C / MU]]
    )
    return a, np.array([0.0, 0.0, 0.0, K1 / MU])


def _travel_slopes(height_m: F64, step_m: float) -> F64:
    """z_s' - z_u' (m,) at each step."""
    if not 0.0 < step_m <= BASE_M:
        raise ValueError(f"the profile needs a step of at most {BASE_M} m (ASTM E1926), not {step_m} m")
    n_base = max(round(BASE_M / step_m), 1)
    n_start = round(START_M / step_m)
    if len(height_m) <= max(n_start, n_base):
        raise ValueError(f"the profile must be longer than {START_M} m")
    slopes = (height_m[n_base:] - height_m[:-n_base]) / (n_base * step_m)  # of the 250 mm moving average
    start = (height_m[n_start] - height_m[0]) / (n_start * step_m)
    transition, drive = _over_one_step(step_m)
    return _respond(np.ascontiguousarray(slopes), start, transition, drive)


def _over_one_step(step_m: float) -> tuple[F64, F64]:
    """Exact solution of the golden car over step_m for a slope that stays the same within it."""
    a, b = golden_car()
    extended = np.zeros((5, 5))
    extended[:4, :4], extended[:4, 4] = a, b
    solution = np.asarray(expm(extended * (step_m / SPEED_MPS)), dtype=np.float64)
    return np.ascontiguousarray(solution[:4, :4]), np.ascontiguousarray(solution[:4, 4])


@compiled
def _respond(slopes: F64, start: float, transition: F64, drive: F64) -> F64:
    """Step the golden car over the slopes, sprung and unsprung mass first following ``start``."""
    state, following = np.array([start, 0.0, start, 0.0]), np.zeros(4)
    travel = np.empty_like(slopes)
    for k in range(slopes.size):
        for i in range(4):
            following[i] = drive[i] * slopes[k]
            for j in range(4):
                following[i] += transition[i, j] * state[j]
        state[:] = following
        travel[k] = state[0] - state[2]
    return travel


RECIPES: list[RoadRecipe] = [PaperRoad(), iso_road("B"), UnevenRoad(iso_road("C")), ObstacleRoad(iso_road("A"))]


@pytest.mark.parametrize("recipe", RECIPES)
def test_the_seed_is_all_that_decides(recipe: RoadRecipe) -> None:
    one, same, other = (recipe.lay(500.0, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(one.left_m, same.left_m)
    assert np.array_equal(one.right_m, same.right_m)
    assert not np.allclose(one.left_m, other.left_m)


@pytest.mark.parametrize("recipe", RECIPES)
def test_a_road_is_as_long_as_asked(recipe: RoadRecipe) -> None:
    assert 500.02 <= recipe.lay(500.02, np.random.default_rng(1)).length_m < 500.08


def test_the_papers_road_has_its_variance_and_memory() -> None:
    """(1) in space: variance sigma^2, autocovariance sigma^2 exp(-0.15 s)."""
    road = PaperRoad(sigma_m=0.006).lay(200_000.0, np.random.default_rng(3))
    height = road.left_m
    assert np.std(height) == pytest.approx(0.006, rel=0.02)
    for lag_m in (1.0, 5.0, 10.0):
        lag = round(lag_m / road.step_m)
        assert np.mean(height[lag:] * height[:-lag]) == pytest.approx(0.006**2 * math.exp(-0.15 * lag_m), rel=0.06)


def test_both_wheels_of_the_paper_meet_the_same_road() -> None:
    road = PaperRoad().lay(100.0, np.random.default_rng(3))
    assert np.array_equal(road.left_m, road.right_m)


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


def test_classes_are_a_factor_of_four_apart() -> None:
    assert [iso_roughness_m3(c) for c in "ABCH"] == pytest.approx([1e-6, 4e-6, 16e-6, 16384e-6])
    with pytest.raises(ValueError, match="A to H"):
        iso_roughness_m3("K")


def test_a_road_of_no_length_is_refused() -> None:
    with pytest.raises(ValueError, match="positive length"):
        PaperRoad().lay(0.0, np.random.default_rng(1))


def test_a_tyre_averages_over_its_patch() -> None:
    way_m = np.arange(4001) * 0.05
    sine = Road(0.05, np.sin(2.0 * np.pi * way_m / 1.0), 0.3 * way_m)
    felt = sine.enveloped(0.25)
    inner = slice(10, -10)
    k = np.pi / 1.0
    assert np.max(felt.left_m[inner]) == pytest.approx(math.sin(k * 0.25) / (5 * math.sin(k * 0.05)), rel=1e-3)
    assert felt.right_m[inner] == pytest.approx(sine.right_m[inner])
    assert sine.enveloped(0.0) is sine


def test_stretches_differ_in_roughness() -> None:
    even = iso_road("B").lay(20_000.0, np.random.default_rng(8))
    uneven = UnevenRoad(iso_road("B"), spread=0.6).lay(20_000.0, np.random.default_rng(8))
    scatter = [np.std(np.log(iri_by_section(road.left_m, road.step_m, 100.0))) for road in (even, uneven)]
    assert scatter[1] > 3.0 * scatter[0]
    assert np.array_equal(UnevenRoad(iso_road("B"), spread=0.0).lay(900.0, np.random.default_rng(8)).left_m,
                          iso_road("B").lay(900.0, np.random.default_rng(8)).left_m)  # fmt: skip


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


def test_obstacles_are_as_frequent_as_asked() -> None:
    flat = SpectralRoad(1e-12)
    road = ObstacleRoad(flat, potholes_per_km=5.0, humps_per_km=1.0).lay(20_000.0, np.random.default_rng(2))
    deep = (np.minimum(road.left_m, road.right_m) < -0.005).astype(int)
    high = (road.left_m > 0.04).astype(int)
    assert np.count_nonzero(np.diff(deep) == 1) == pytest.approx(100, abs=25)
    assert np.count_nonzero(np.diff(high) == 1) == pytest.approx(20, abs=10)


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


RANDOM = {"urban": (urban, 0.0, 52.0), "rural": (rural, 0.0, 100.0), "motorway": (motorway, 0.0, 131.0)}


@pytest.mark.parametrize("kind", RANDOM)
def test_random_drives_keep_to_their_speeds_and_stop_at_the_end(kind: str) -> None:
    make, low_kmh, high_kmh = RANDOM[kind]
    drive = make(900.0, np.random.default_rng(1))
    assert np.min(drive.speed_mps) * 3.6 >= low_kmh
    assert 0.75 * high_kmh < np.max(drive.speed_mps) * 3.6 <= high_kmh
    assert drive.speed_mps[0] == drive.speed_mps[-1] == 0.0
    assert drive.duration_s == pytest.approx(900.0, abs=300.0)


@pytest.mark.parametrize("make", [urban, rural, motorway])
def test_the_seed_is_all_that_decides_about_a_drive(make: Callable[[float, np.random.Generator], Drive]) -> None:
    one, same, other = (make(600.0, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(one.speed_mps, same.speed_mps)
    assert np.array_equal(one.lateral_mps2, same.lateral_mps2)
    assert len(one.speed_mps) != len(other.speed_mps) or not np.allclose(one.speed_mps, other.speed_mps)


def test_urban_driving_stops_and_motorway_driving_does_not() -> None:
    stops = [
        np.count_nonzero(np.diff((make(1800.0, np.random.default_rng(3)).speed_mps == 0.0).astype(int)) == 1)
        for make in (urban, rural, motorway)
    ]
    assert stops[0] >= 10
    assert 1 <= stops[1] < stops[0]
    assert stops[2] == 1  # the end


def test_the_distance_is_the_speed_integrated() -> None:
    drive = drive_of([Leg(10.0, 20.0)], start_mps=10.0)
    assert drive.travelled_m == pytest.approx(10.0 * np.arange(len(drive.speed_mps)) * STEP_S)


def test_a_constant_drive_wanders_as_much_as_asked() -> None:
    drive = constant(13.9, 3600.0, np.random.default_rng(2), jitter_std_mps=0.3)
    assert np.std(drive.speed_mps) == pytest.approx(0.3, rel=0.15)
    assert np.mean(drive.speed_mps) == pytest.approx(13.9, abs=0.05)
    assert np.max(np.abs(drive.longitudinal_mps2)) < 0.2
    assert np.ptp(constant(13.9, 60.0, np.random.default_rng(2), jitter_std_mps=0.0).speed_mps) == 0.0


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
