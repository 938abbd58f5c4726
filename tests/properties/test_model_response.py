"""The vehicle's response against statics, symmetry and four wheels of their own."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.special
from hypothesis import given, settings
from hypothesis import strategies as st
from support.four_wheels import FourWheels
from support.model_road import BAND_HZ, GROUND, LEFT, QUIET, RATE_HZ, UNCOUPLED, VAN, batch_of, paths_of, theta_of

from gateway.core.vehicle import Load
from gateway.model import car
from gateway.model.car import LEAST_LEFT, LEVELS, MOST, MOST_APART, natural, numbers_about, numbers_of, roll_share_front
from gateway.model.expected import Expected, Groups, log_stroke_speeds
from gateway.model.spectra import Mount, Reading, cross_spectra_of
from gateway.model.table import INDEX, NAMES, N
from gateway.model.tracks import MOST_X, coherence_of, coherence_slope_of
from gateway.records import C128, F64

FREQ_HZ = np.array([0.8, 1.5, 2.4, 4.0, 8.0, 12.0])
HEAVY = 1e4
"""So many times as heavy and stiff as a van, the rounding of a payload's place vanishes (car.INVERSE_PAYLOAD_KG)."""
HEAVY_GROUND = replace(GROUND, empty_mass_kg=HEAVY * GROUND.empty_mass_kg)
PAYLOAD_KG, POSITION_M = 320.0 * HEAVY, 2.1
FIRM = {"payload_mode_hz": 1e9, "payload_damping_ratio": 1e-9}
SQUARE = {"gyro_yaw_rad": 0.0, "sensor_left_m": 0.3, "empty_left_m": 0.01, "damper_against_rear": 1.1}
MOVABLE = {"twist_level": 1.2, "damper_friction_rear": 0.3, "damper_digression_front": 0.2, "accelerometer_gain": 0.02}
HALF, ROLLING = theta_of(**MOVABLE), theta_of(with_roll=True, **MOVABLE, **LEFT)
LOADED = (300.0, 0.47, 0.06)


def heavy_theta(slope_per_kn: float, **units: float) -> F64:
    """ROLLING's like, firm, heavy and, at its usual movement, without friction."""
    vehicle = replace(VAN, empty_mass_kg=HEAVY * VAN.empty_mass_kg)
    slopes = {"spring_slope_front_per_kn": slope_per_kn / HEAVY, "spring_slope_rear_per_kn": 1.5 * slope_per_kn / HEAVY}
    return theta_of(with_roll=True, vehicle=vehicle, **FIRM, **(SQUARE | slopes | units))


def off(theta: F64, left_m: float, speed_mps: float = 14.0) -> float:
    """The model's distance from four wheels: the largest difference over the largest reading of the same sensor."""
    wheels = FourWheels(theta, HEAVY_GROUND, PAYLOAD_KG, POSITION_M, left_m)
    expected = wheels.paths(FREQ_HZ, speed_mps)
    found = paths_of(theta, wheels.load, FREQ_HZ, 3, speed_mps, HEAVY_GROUND)
    return float(np.max(np.abs(found - expected) / np.max(np.abs(expected), axis=(1, 2), keepdims=True)))


@pytest.mark.parametrize("left_m", [0.0, 0.3, -0.45])
@pytest.mark.parametrize("driveline_kg", [1e-20, 40.0 * HEAVY])
def test_on_even_springs_it_is_the_car_on_four_wheels(left_m: float, driveline_kg: float) -> None:
    """With the longitudinal force of both drivelines, at any speed."""
    coupled = {"driveline_front_kg": driveline_kg, "driveline_rear_kg": 0.5 * driveline_kg}
    assert off(heavy_theta(0.0, accelerometer_gain=0.05, **coupled), left_m, 21.0) < 1e-8


def test_without_roll_it_is_the_same_car_in_the_middle() -> None:
    theta = heavy_theta(0.1, empty_left_m=0.0, sensor_left_m=0.0, driveline_rear_kg=30.0 * HEAVY)
    wheels = FourWheels(theta, HEAVY_GROUND, PAYLOAD_KG, POSITION_M, 0.0)
    half = paths_of(theta[:N], wheels.load[:2], FREQ_HZ, 2, 14.0, HEAVY_GROUND)
    np.testing.assert_allclose(half, wheels.paths(FREQ_HZ)[:2, :2], rtol=1e-7)


def test_springs_that_stiffen_turn_heave_into_roll_to_first_order() -> None:
    """What is left out is of second order: half as uneven, a quarter as far off. Even springs would be off by far."""
    far, near = (off(heavy_theta(0.08, empty_left_m=0.0), left_m) for left_m in (0.4, 0.2))
    assert 1e-5 < far < 0.02
    assert near == pytest.approx(far / 4.0, rel=0.25)
    stiffening = heavy_theta(0.08)
    wheels = FourWheels(stiffening, HEAVY_GROUND, PAYLOAD_KG, POSITION_M, 0.4)
    front_npm, rear_npm = 2.0 * wheels.level_springs_npm[::2]
    even = heavy_theta(0.0, spring_front_npm=front_npm, spring_rear_npm=rear_npm)
    expected, plain = wheels.paths(FREQ_HZ), paths_of(even, wheels.load, FREQ_HZ, 3, 14.0, HEAVY_GROUND)
    scale = np.max(np.abs(expected), axis=(1, 2), keepdims=True)
    assert np.max(np.abs(plain - expected) / scale) > 5.0 * off(stiffening, 0.4)


@pytest.mark.parametrize("slope_per_kn", [0.0, 0.08])
@pytest.mark.parametrize("left_m", [0.3, -0.2])
def test_the_axles_share_a_steady_moment_as_statics_has_it(slope_per_kn: float, left_m: float) -> None:
    theta = heavy_theta(slope_per_kn)
    wheels = FourWheels(theta, HEAVY_GROUND, PAYLOAD_KG, POSITION_M, left_m)
    front, rear = wheels.more_on_the_left_n
    assert roll_share_front(theta, wheels.load, HEAVY_GROUND) == pytest.approx(front / (front + rear), rel=1e-9)


def test_the_responses_of_groups_follow_their_speed() -> None:
    """To first order about their mean: half as far from it, a quarter as far off."""
    theta = theta_of(driveline_front_kg=30.0, driveline_rear_kg=60.0)
    batches = [
        batch_of(*np.random.default_rng(i).standard_normal((2, 4000)), speed_mps=v) for i, v in enumerate((11, 17))
    ]
    spectra = cross_spectra_of(batches, Reading(VAN.wheelbase_m, BAND_HZ, 256))
    still = replace(spectra, log_amplitude=np.zeros_like(spectra.log_amplitude))
    misses = []
    for apart in (1.0, 0.5):
        delays_s = still.delay_s.mean() * (1.0 + apart * (still.delay_s / still.delay_s.mean() - 1.0))
        groups = Groups(replace(still, delay_s=delays_s), GROUND)
        found = Expected(theta[None], np.array([[300.0], [0.47]]), groups).paths[:, :, 0]
        exact = [paths_of(theta, LOADED[:2], still.freq_hz, 2, float(GROUND.wheelbase_m / d)) for d in delays_s[:, 0]]
        unmoved = paths_of(theta, LOADED[:2], still.freq_hz, 2, groups.speed_mps)
        misses.append(np.abs(found - np.array(exact).transpose(1, 2, 0, 3)).max())
        assert misses[-1] < 0.1 * np.abs(unmoved[:, :, None] - np.array(exact).transpose(1, 2, 0, 3)).max()
    assert misses[1] == pytest.approx(misses[0] / 4.0, rel=0.3)


@pytest.mark.parametrize("load", [(0.0, 0.52, 0.0), LOADED], ids=["empty", "loaded on the left"])
@pytest.mark.parametrize(("left_m", "right_m"), [(1.0, 1.0), (1.0, 0.0), (0.3, -0.5)])
def test_slowly_the_body_follows_both_tracks(load: tuple[float, ...], left_m: float, right_m: float) -> None:
    """Heave is the tracks' mean and roll their difference over the width, whatever lies where on uneven springs."""
    slow_hz, omega = np.array([1e-3]), 2e-3 * np.pi
    theta = theta_of(with_roll=True, spring_slope_rear_per_kn=0.2, **(LEFT | {"gyro_yaw_rad": 0.0}))
    paths = paths_of(theta, load, slow_hz, 3)[:, :, 0]
    mean, half_difference = (left_m + right_m) / 2.0, (left_m - right_m) / 2.0
    acceleration, pitch_rate, roll_rate = mean * paths[:, :2].sum(axis=1) + half_difference * paths[:, 2:].sum(axis=1)
    roll = (left_m - right_m) / (2.0 * GROUND.half_track_m)
    assert acceleration / -(omega**2) == pytest.approx(mean + 0.3 * roll, abs=1e-4)
    assert pitch_rate / (1j * omega) == pytest.approx(0.0, abs=1e-4)
    assert roll_rate / (1j * omega) == pytest.approx(roll, abs=1e-4)
    lever = VAN.sensor_position_m / VAN.wheelbase_m
    half = paths_of(theta[:N], load[:2], slow_hz)[:, :, 0]
    np.testing.assert_allclose(half[0] / -(omega**2), [1.0 - lever, lever], atol=1e-3)
    np.testing.assert_allclose(half[1] / (1j * omega) * VAN.wheelbase_m, [-1.0, 1.0], rtol=1e-3)


@settings(max_examples=30)
@given(
    cg_left_m=st.floats(-0.15, 0.15),
    payload_kg=st.floats(0.0, 600.0),
    front_share=st.floats(0.35, 0.6),
    sensor_left_m=st.floats(-0.6, 0.6),
    yaw_rad=st.floats(-0.1, 0.1),
    slope=st.floats(-0.1, 0.3),
)
def test_in_the_mirror_left_is_right(
    cg_left_m: float, payload_kg: float, front_share: float, sensor_left_m: float, yaw_rad: float, slope: float
) -> None:
    """Mirrored, roll turns over where both tracks are alike; where one is against the other, all but roll does."""
    placed = {"spring_slope_rear_per_kn": slope, "sensor_left_m": sensor_left_m, "gyro_yaw_rad": yaw_rad}
    one = theta_of(with_roll=True, **(LEFT | placed))
    other = one.copy()
    other[[INDEX[name] for name in ("empty_left_m", "gyro_yaw_rad", "sensor_left_m")]] *= -1.0
    sign = np.array([1.0, 1.0, -1.0])[:, None, None] * np.array([1.0, 1.0, -1.0, -1.0])[:, None]
    here = paths_of(one, (payload_kg, front_share, cg_left_m), FREQ_HZ, 3)
    mirrored = sign * paths_of(other, (payload_kg, front_share, -cg_left_m), FREQ_HZ, 3)
    scale = np.abs(here).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(mirrored / scale, here / scale, atol=1e-9)


def test_a_payload_on_a_soft_floor_feels_heavier_below_its_mode() -> None:
    """At 8 Hz a load ringing at 14 Hz weighs half as much again: 1 / (1 - (8/14)^2) = 1.48."""
    soft, firm = (
        theta_of(payload_mode_hz=hz, payload_damping_ratio=1e-6, payload_gyration_m2=1e-9) for hz in (14.0, 1e6)
    )
    heavier = 300.0 / (1.0 - (8.0 / 14.0) ** 2)
    at_hz = np.array([8.0])
    at_soft, at_firm = paths_of(soft, (300.0, 0.52), at_hz), paths_of(firm, (heavier, 0.52), at_hz)
    assert at_soft[0, 0] == pytest.approx(at_firm[0, 0], rel=0.02)


def springs_npm(theta: F64, added_kn: float) -> F64:
    """(2,) front and rear, the load on the rear axle alone."""
    payload_kg = added_kn * 1000.0 / 9.80665
    share = GROUND.empty_front_share * GROUND.empty_mass_kg / (GROUND.empty_mass_kg + payload_kg)
    return numbers_of(natural(theta)[None], np.array([[payload_kg], [share]]), GROUND)[car.SPRING, 0, car.USUAL_LEVEL]


def test_springs_stiffen_by_the_exponential_of_slope_and_bends() -> None:
    """A slope of 0.1 per kN and a bend of 0.5 beyond 0.2 of half the empty weight, 1.216 kN."""
    theta = theta_of(spring_slope_rear_per_kn=0.1, spring_bend_rear_1_per_kn=0.5)
    bend_kn = 0.2 * 0.5 * 1240.0 * 9.80665e-3
    empty = springs_npm(theta, 0.0)
    for added_kn in (0.5, 2.0):
        front, rear = springs_npm(theta, added_kn) / empty
        assert front == pytest.approx(1.0)
        assert rear == pytest.approx(np.exp(0.1 * added_kn + 0.5 * max(added_kn - bend_kn, 0.0)))


def rates_at_levels(**units: float) -> tuple[F64, F64]:
    """(5,) rear damper and rear spring at each of LEVELS, over those without friction and digression."""
    numbers, plain = (
        numbers_of(natural(theta_of(**one))[None], np.array([[0.0], [0.52]]), GROUND)[:, 0]
        for one in (units, dict.fromkeys(("damper_friction_rear", "spring_friction_rear"), 0.0))
    )
    damper, spring = (numbers[of][1] / plain[of][1] for of in (car.DAMPER, car.SPRING))
    return damper, spring


@given(share=st.floats(-0.2, 1.0), power=st.floats(-0.3, 0.5))
def test_a_rate_goes_with_one_less_p_and_p_over_s_and_a_damper_s_with_s_to_the_less_q(
    share: float, power: float
) -> None:
    damper, spring = rates_at_levels(
        damper_friction_rear=share, spring_friction_rear=0.5 * share, damper_digression_rear=power
    )
    s = np.exp(LEVELS[:, 1])
    np.testing.assert_allclose(damper, np.maximum(LEAST_LEFT, 1.0 - share + share / s) * s**-power)
    np.testing.assert_allclose(spring, 1.0 - 0.5 * share + 0.5 * share / s)
    assert damper[car.USUAL_LEVEL] == pytest.approx(1.0)


amplitudes, factors = st.floats(-2.0, 2.0), st.floats(-3.0, 3.0)


@given(front=amplitudes, rear=amplitudes, a=factors, b=factors, c=factors, d=factors, e=factors)
def test_between_levels_parabolas_are_met_exactly(
    front: float, rear: float, a: float, b: float, c: float, d: float, e: float
) -> None:
    """One of what both axles have in common, one of what sets them apart."""

    def value(front: F64, rear: F64) -> F64:
        u = np.clip(0.5 * (front + rear), -MOST, MOST)
        v = np.clip(0.5 * (front - rear), -MOST_APART, MOST_APART)
        return np.asarray(a + b * u + c * u**2 + d * v + e * v**2)

    met = car.level_weights(np.array([[front, rear]])) @ value(*LEVELS.T)
    assert met[0] == pytest.approx(float(value(np.array(front), np.array(rear))), abs=1e-9)


@pytest.mark.parametrize("theta", [HALF, ROLLING], ids=["upright", "rolling"])
@pytest.mark.parametrize("payload_kg", [0.0, 320.0])
def test_numbers_move_with_each_entry_as_a_small_change_does(theta: F64, payload_kg: float) -> None:
    load, n = np.array((payload_kg, *LOADED[1:]))[: 3 if len(theta) > N else 2], len(theta)
    entries = [*sorted(i for i in car.IN_MOTION if i < n), *range(n, n + len(load))]
    directions, far = numbers_about(natural(theta), load, GROUND, entries)
    slopes = directions @ far
    whole = np.r_[theta, load]

    def numbers(at: F64) -> F64:
        return numbers_of(natural(at[:n])[None], at[n:, None], GROUND)[:, 0].T

    for column, entry in enumerate(entries):
        step = np.zeros_like(whole)
        step[entry] = 1e-5 if entry != n else 1e-3
        expected = (numbers(whole + step) - numbers(whole - step)) / (2.0 * step[entry])
        name = NAMES[entry] if entry < n else f"load {entry - n}"
        scale = np.abs(numbers(whole)) + 1.0
        np.testing.assert_allclose(slopes[..., column] / scale, expected / scale, rtol=1e-4, atol=1e-7, err_msg=name)


@pytest.mark.parametrize("speed_mps", [7.0, 22.0])
def test_springs_move_as_fast_as_four_wheels_make_them(speed_mps: float) -> None:
    """Told from the body's sensors alone; no part of the model is in what is compared."""
    theta = theta_of(with_roll=True, sensor_left_m=0.0, track_offset_m=1e-9, **QUIET, **UNCOUPLED, **FIRM)
    wheels = FourWheels(theta, GROUND, 1e-9, 1.0, 0.0)
    n = 15_000
    freq_hz = np.fft.rfftfreq(n, 1.0 / RATE_HZ)[1:]
    rng = np.random.default_rng(int(speed_mps))
    road = 1e-2 * (rng.standard_normal(len(freq_hz)) + 1j * rng.standard_normal(len(freq_hz))) / freq_hz
    grid_hz = np.geomspace(freq_hz[0], freq_hz[-1], 600)

    def driven(paths: C128) -> F64:
        smooth = [
            [np.interp(freq_hz, grid_hz, each.real) + 1j * np.interp(freq_hz, grid_hz, each.imag) for each in one]
            for one in paths
        ]
        later = np.exp(-2j * np.pi * freq_hz * GROUND.wheelbase_m / speed_mps)
        inside = (freq_hz > 0.3) & (freq_hz < 22.0)
        return np.array([(one[0] + later * one[1]) * road * inside for one in smooth])

    acceleration, pitch_rate = (np.fft.irfft(np.r_[0.0, one], n) for one in driven(wheels.paths(grid_hz)[:2]))
    within = (freq_hz > BAND_HZ[0]) & (freq_hz < BAND_HZ[1])
    speed = np.abs(2.0 * np.pi * freq_hz * driven(wheels.strokes(grid_hz)))[:, within] / n
    spectra = cross_spectra_of(
        [batch_of(acceleration, pitch_rate, speed_mps=speed_mps)], Reading(VAN.wheelbase_m, BAND_HZ, 256)
    )
    told = log_stroke_speeds(spectra, theta[:N], Load(0.0, 52.0), GROUND)
    told_mps = np.sqrt(np.average(np.exp(2.0 * told), axis=0, weights=spectra.n_segments[:, 0]))
    np.testing.assert_allclose(told_mps, np.sqrt(2.0 * np.sum(speed**2, axis=1)), rtol=0.06)


@settings(max_examples=30)
@given(left_m=st.floats(-0.8, 0.8), yaw_rad=st.floats(-0.05, 0.05), lag_s=st.floats(-0.01, 0.01))
def test_levelled_readings_are_those_of_a_sensor_on_the_centre_line(
    left_m: float, yaw_rad: float, lag_s: float
) -> None:
    """Of every path of a car that rolls, up to the square of the yaw."""
    placed = {"sensor_left_m": left_m, "gyro_yaw_rad": yaw_rad}
    here = theta_of(with_roll=True, gyro_lag_s=lag_s, **(LEFT | placed))
    square = theta_of(with_roll=True, gyro_lag_s=lag_s, **(LEFT | dict.fromkeys(placed, 0.0)))
    read, wanted = (paths_of(one, LOADED, FREQ_HZ, 3) for one in (here, square))
    levelled = np.stack(Mount(left_m, yaw_rad, lag_s).levelled(read, FREQ_HZ))
    scale = np.max(np.abs(np.concatenate([read, wanted], axis=1)), axis=(1, 2), keepdims=True)
    assert np.max(np.abs(levelled - wanted) / scale) < 1e-9 + 2.0 * yaw_rad**2
    np.testing.assert_array_equal(np.stack(Mount(0.0, 0.0, lag_s).levelled(read, FREQ_HZ)), read)


@given(x=st.floats(1e-4, MOST_X))
def test_two_tracks_are_as_coherent_as_bessel_functions_say(x: float) -> None:
    """x K1(x), and its slope by log x, -x^2 K0(x)."""
    assert coherence_of(np.log([x]))[0] == pytest.approx(x * scipy.special.k1(x), rel=1e-9)
    assert coherence_slope_of(np.log([x]))[0] == pytest.approx(-(x**2) * scipy.special.k0(x), rel=1e-9)
