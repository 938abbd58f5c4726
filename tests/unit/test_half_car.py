"""The half-car against statics, a rigid block and the simulator's own equations of motion; its mount on the van."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.half_car_road import CAR
from support.rolling_car import HALF_TRACK_M, ROLLING_CAR
from support.textbook import half_car as textbook_half_car
from support.textbook import linearised

from gateway.core.cross_spectrum.model.half_car import (
    INVERSE_PAYLOAD_KG,
    Axle,
    HalfCar,
    body_masses_kg,
    frequency_response,
    half_car_numbers,
    spring_npm,
)
from gateway.core.cross_spectrum.model.motion import Frame, Motion, Numbers
from gateway.core.cross_spectrum.model.reading import Mount
from gateway.core.cross_spectrum.model.rolling_car import SidewaysLoad, rolling_numbers, rolling_response
from gateway.records import C128
from gateway.sim.vans import PAPER_VAN, SMALL_VAN
from gateway.sim.vehicle import Axle as SimulatedAxle
from gateway.sim.vehicle import Load, Vehicle, front_share_pct

STIFF = 1e12
PLACE_ROUNDED = 5e-3  # 1/L is rounded off below 30 kg: 1 % of what the place of 300 kg does


def test_slowly_the_body_follows_the_road() -> None:
    """Lifting the front by 1 moves the sensor by 1 - x/l and pitches by -1/l: no dynamics at low frequency."""
    freq_hz = np.array([1e-3])
    omega = 2.0 * np.pi * freq_hz
    r = frequency_response(CAR, 250.0, 0.45, freq_hz)
    lever = CAR.sensor_position_m / CAR.wheelbase_m
    assert (r.acceleration_front / -(omega**2)).real == pytest.approx(1.0 - lever, rel=1e-3)
    assert (r.acceleration_rear / -(omega**2)).real == pytest.approx(lever, rel=1e-3)
    assert (r.pitch_rate_front / (1j * omega)).real == pytest.approx(-1.0 / CAR.wheelbase_m, rel=1e-3)
    assert (r.pitch_rate_rear / (1j * omega)).real == pytest.approx(1.0 / CAR.wheelbase_m, rel=1e-3)


@given(payload_kg=st.floats(-60.0, 500.0), position=st.floats(0.1, 0.9))
def test_both_axles_lifted_alike_lift_without_pitch_where_the_vehicle_is_symmetric(
    payload_kg: float, position: float
) -> None:
    """Mirrored about the middle, a mirrored load pitches the other way."""
    car = replace(CAR, empty_front_share=0.5, rear=CAR.front, sensor_position_m=CAR.wheelbase_m / 2.0)
    share = (0.5 * car.empty_mass_kg + (1.0 - position) * payload_kg) / (car.empty_mass_kg + payload_kg)
    freq_hz = np.array([1.3, 4.0, 9.0])
    one = frequency_response(car, payload_kg, share, freq_hz)
    mirrored = frequency_response(car, payload_kg, 1.0 - share, freq_hz)
    np.testing.assert_allclose(one.acceleration_front, mirrored.acceleration_rear, rtol=1e-9)
    np.testing.assert_allclose(one.pitch_rate_front, -mirrored.pitch_rate_rear, rtol=1e-9)


@pytest.mark.parametrize("van", [PAPER_VAN, SMALL_VAN], ids=lambda van: van.name)
@pytest.mark.parametrize("position_m", [0.6, 2.4])
def test_it_is_the_half_car_of_the_textbooks(van: Vehicle, position_m: float) -> None:
    """Lagrange's equations for four coordinates, written independently, give the same heave and pitch."""
    linear = _without_tyre_damping(linearised(replace(van, cog_height_m=0.8)))
    load = Load(300.0, position_m, height_m=0.8, length_m=1.0, tall_m=0.4)
    freq_hz = np.array([0.7, 1.4, 3.0, 7.0, 11.0])
    speed_mps = 15.0
    heave_and_pitch = textbook_half_car(linear, load, speed_mps, freq_hz)
    omega = 2.0 * np.pi * freq_hz
    later = np.exp(-1j * omega * linear.wheelbase_m / speed_mps)
    r = frequency_response(_as_half_car(linear, load), 300.0, front_share_pct(linear, (load,)) / 100.0, freq_hz)
    pitch = (r.pitch_rate_front + r.pitch_rate_rear * later) / (1j * omega)
    heave = (r.acceleration_front + r.acceleration_rear * later) / -(omega**2)
    np.testing.assert_allclose(heave, heave_and_pitch[:, 0], rtol=PLACE_ROUNDED)
    np.testing.assert_allclose(pitch, heave_and_pitch[:, 1], rtol=PLACE_ROUNDED)


def _without_tyre_damping(van: Vehicle) -> Vehicle:
    def bare(axle: SimulatedAxle) -> SimulatedAxle:
        return replace(axle, wheel=replace(axle.wheel, tyre_nspm=0.0))

    return replace(van, front=bare(van.front), rear=bare(van.rear))


def _as_half_car(van: Vehicle, load: Load) -> HalfCar:
    def axle(one: SimulatedAxle) -> Axle:
        return Axle(
            spring_npm=2 * one.spring.rate_npm,
            spring_slope_per_kn=0.0,
            spring_bends_per_kn=(),
            bend_loads_kn=(),
            damper_nspm=one.damper.compression_nspm + one.damper.rebound_nspm,
            damper_mount_npm=STIFF,
            tyre_npm=2 * one.wheel.tyre_npm,
            unsprung_kg=2 * one.wheel.unsprung_kg,
        )

    return HalfCar(
        empty_mass_kg=van.sprung_kg,
        empty_front_share=van.empty_front_share_pct / 100.0,
        wheelbase_m=van.wheelbase_m,
        front=axle(van.front),
        rear=axle(van.rear),
        pitch_inertia_kgm2=van.pitch_inertia_kgm2,
        sensor_position_m=van.cog_position_m,
        payload_gyration_m2=load.pitch_inertia_kgm2 / load.mass_kg,
        payload_mode_hz=1e4,
        payload_damping_ratio=0.1,
        gyro_lag_s=0.0,
    )


def test_a_payload_on_a_soft_floor_feels_heavier_below_its_mode() -> None:
    """At 8 Hz a load ringing at 14 Hz weighs half as much again: 1 / (1 - (8/14)^2) = 1.48."""
    soft = replace(CAR, payload_mode_hz=14.0, payload_damping_ratio=1e-6, payload_gyration_m2=0.0)
    rigid = replace(CAR, payload_mode_hz=1e6, payload_gyration_m2=0.0)
    share = CAR.empty_front_share
    heavier = 300.0 / (1.0 - (8.0 / 14.0) ** 2)
    at_soft = frequency_response(soft, 300.0, share, np.array([8.0]))
    at_rigid = frequency_response(rigid, heavier, share, np.array([8.0]))
    assert at_soft.acceleration_front == pytest.approx(at_rigid.acceleration_front, rel=0.02)


def test_springs_stiffen_by_the_exponential_of_slope_and_bends() -> None:
    """A slope of 0.1 per kN and a bend of 0.5 beyond 1 kN: under 2 kN the rate is exp(0.1 * 2 + 0.5 * 1) times that of
    the empty vehicle, under 0.5 kN exp(0.05) times.
    """
    axle = replace(CAR.rear, spring_slope_per_kn=0.1, spring_bends_per_kn=(0.5,), bend_loads_kn=(1.0,))
    for added_kn, logarithm in ((0.0, 0.0), (0.5, 0.05), (2.0, 0.7)):
        assert spring_npm(axle, 1000.0 * added_kn / 9.80665) == pytest.approx(axle.spring_npm * np.exp(logarithm))


def test_a_bend_acts_only_beyond_its_load() -> None:
    bent = replace(CAR, rear=replace(CAR.rear, spring_bends_per_kn=(0.5,), bend_loads_kn=(1.0,)))
    freq_hz = np.array([1.5])
    light, heavy = (50.0, 0.51), (400.0, 0.42)
    assert frequency_response(bent, *light, freq_hz) == frequency_response(CAR, *light, freq_hz)
    assert frequency_response(bent, *heavy, freq_hz) != frequency_response(CAR, *heavy, freq_hz)


@pytest.mark.parametrize(("payload_kg", "felt"), [(3000.0, 0.9999), (INVERSE_PAYLOAD_KG, 0.5), (0.0, 0.0)])
def test_the_place_of_a_load_fades_with_its_mass(payload_kg: float, felt: float) -> None:
    """All of it over the rear axle: (R - F)^2 / 4 L would be L / 4, and the mass felt between the axles nothing."""
    all_kg = CAR.empty_mass_kg + payload_kg
    _, (_, _, between_kg) = body_masses_kg(CAR, payload_kg, CAR.empty_front_share * CAR.empty_mass_kg / all_kg)
    assert between_kg == pytest.approx(payload_kg / 4.0 * (1.0 - felt), abs=1e-3)


FREQ_HZ = np.array([0.7, 1.4, 3.3, 9.0, 13.0])
UPRIGHT = half_car_numbers(CAR, 300.0, 0.47), Frame(CAR.wheelbase_m), 2
ROLLING = rolling_numbers(ROLLING_CAR, SidewaysLoad(300.0, 0.47, 0.06)), Frame(CAR.wheelbase_m, HALF_TRACK_M), 3


@pytest.mark.parametrize(("numbers", "frame", "n_sensors"), [UPRIGHT, ROLLING], ids=["upright", "rolling"])
def test_slopes_are_what_a_small_change_of_each_number_does(numbers: Numbers, frame: Frame, n_sensors: int) -> None:
    every = range(len(numbers.all))
    slopes = Motion(numbers, frame, FREQ_HZ, n_sensors).slopes(every)
    for i in every:
        step = np.zeros_like(numbers.all)
        step[i] = 1e-5 * max(abs(numbers.all[i, 0]), 0.1)
        up, down = (Motion(Numbers(numbers.all + by), frame, FREQ_HZ, n_sensors).paths for by in (step, -step))
        expected = (up - down) / (2.0 * step[i])
        np.testing.assert_allclose(slopes[i], expected, rtol=1e-5, atol=1e-7 * np.abs(expected).max())


def test_wanted_slopes_are_those_of_all() -> None:
    numbers, frame, n_sensors = ROLLING
    motion = Motion(numbers, frame, FREQ_HZ, n_sensors)
    wanted = [1, 5, 9, 14, 17, 25, 29, 31]
    np.testing.assert_array_equal(motion.slopes(wanted), motion.slopes(range(len(numbers.all)))[wanted])


MOUNT_FREQ_HZ = np.linspace(0.5, 15.0, 30)
OMEGA = 2.0 * np.pi * MOUNT_FREQ_HZ


def process(seed: int) -> tuple[C128, C128, C128]:
    """Heave where the sensor's place along the vehicle is, pitch and roll of a body: random transforms (4, m)."""
    rng = np.random.default_rng(seed)
    heave, pitch, roll = rng.standard_normal((3, 4, len(MOUNT_FREQ_HZ))) + 1j * rng.standard_normal(
        (3, 4, len(MOUNT_FREQ_HZ))
    )
    return heave, pitch, roll


def sensed(body: tuple[C128, C128, C128], left_m: float, yaw_rad: float, lag_s: float) -> tuple[C128, C128, C128]:
    """A gyro turned to the left by a small angle, late by lag_s; an accelerometer left_m left."""
    heave, pitch, roll = body
    late = 1j * OMEGA * np.exp(-1j * OMEGA * lag_s)
    return -(OMEGA**2) * (heave + left_m * roll), late * (pitch - yaw_rad * roll), late * (roll + yaw_rad * pitch)


@given(
    seed=st.integers(0, 2**31),
    left_m=st.floats(-0.8, 0.8),
    yaw_rad=st.floats(-0.1, 0.1),
    lag_s=st.floats(-0.02, 0.02),
)
def test_what_the_place_put_in_is_taken_out(seed: int, left_m: float, yaw_rad: float, lag_s: float) -> None:
    """Up to yaw^2, by which a small angle turned there and back is longer than it was."""
    body = process(seed)
    back = Mount(left_m, yaw_rad, lag_s).levelled(sensed(body, left_m, yaw_rad, lag_s), MOUNT_FREQ_HZ)
    wanted = sensed(body, 0.0, 0.0, lag_s)
    longer = 1.0 + yaw_rad**2
    np.testing.assert_allclose(back[1], longer * wanted[1], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(back[2], longer * wanted[2], rtol=1e-9, atol=1e-9)
    left_over = -left_m * yaw_rad**2 * -(OMEGA**2) * body[2]
    np.testing.assert_allclose(back[0], wanted[0] + left_over, rtol=1e-9, atol=1e-7)


@given(left_m=st.floats(-0.8, 0.8), yaw_rad=st.floats(-0.05, 0.05), lag_s=st.floats(-0.01, 0.01))
def test_it_undoes_what_the_rolling_car_senses(left_m: float, yaw_rad: float, lag_s: float) -> None:
    """Every path of a car with its sensor anywhere becomes that of the same car with it on the centre line."""
    load = SidewaysLoad(280.0, 0.48, -0.05)
    placed = replace(ROLLING_CAR, half_car=replace(CAR, gyro_lag_s=lag_s), sensor_left_m=left_m, gyro_yaw_rad=yaw_rad)
    square = replace(placed, sensor_left_m=0.0, gyro_yaw_rad=0.0)
    here, wanted = rolling_response(placed, load, MOUNT_FREQ_HZ), rolling_response(square, load, MOUNT_FREQ_HZ)
    for name in ("together_front", "together_rear", "against_front", "against_rear"):
        read, true = getattr(here, name), getattr(wanted, name)
        levelled = np.stack(Mount(left_m, yaw_rad, lag_s).levelled((read[0], read[1], read[2]), MOUNT_FREQ_HZ))
        scale = np.max(np.abs(np.concatenate([read, true])), axis=-1).reshape(2, 3).max(axis=0)[:, None]
        assert np.max(np.abs(levelled - true) / scale) < 1e-9 + 2.0 * yaw_rad**2, name


@given(seed=st.integers(0, 2**31), lag_s=st.floats(-0.02, 0.02))
def test_on_the_centre_line_and_square_nothing_is_moved(seed: int, lag_s: float) -> None:
    read = sensed(process(seed), 0.0, 0.0, lag_s)
    for one, other in zip(Mount(0.0, 0.0, lag_s).levelled(read, MOUNT_FREQ_HZ), read, strict=True):
        np.testing.assert_array_equal(one, other)
