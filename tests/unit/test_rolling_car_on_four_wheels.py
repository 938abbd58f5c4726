"""The car that rolls against four wheels of their own, each on its spring, put together by numpy alone.

All is ten thousand times as heavy and stiff as a van: there the rounding of a payload's place vanishes
(half_car.INVERSE_PAYLOAD_KG), and physics does not mind.
"""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import CAR
from support.rolling_car import HALF_TRACK_M, ROLLING_CAR

from gateway.core.cross_spectrum.model.half_car import Axle, HalfCar
from gateway.core.cross_spectrum.model.rolling_car import (
    Against,
    RollingCar,
    SidewaysLoad,
    roll_share_front,
    rolling_response,
)
from gateway.records import C128, F64

HEAVY = 1e4
FREQ_HZ = np.array([0.8, 1.5, 2.4, 4.0, 8.0, 12.0])
PAYLOAD_KG, POSITION_M = 320.0 * HEAVY, 2.1
GRAVITY = 9.80665
WHEELS = ((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0))  # axle, side: left is positive


def heavy(axle: Axle, slope_per_kn: float) -> Axle:
    return replace(
        axle,
        spring_npm=HEAVY * axle.spring_npm,
        spring_slope_per_kn=slope_per_kn / HEAVY,
        damper_nspm=HEAVY * axle.damper_nspm,
        damper_mount_npm=HEAVY * axle.damper_mount_npm,
        tyre_npm=HEAVY * axle.tyre_npm,
        unsprung_kg=HEAVY * axle.unsprung_kg,
    )


def heavy_car(slope_per_kn: float) -> RollingCar:
    body: HalfCar = replace(
        CAR,
        empty_mass_kg=HEAVY * CAR.empty_mass_kg,
        pitch_inertia_kgm2=HEAVY * CAR.pitch_inertia_kgm2,
        front=heavy(CAR.front, slope_per_kn),
        rear=heavy(CAR.rear, 1.5 * slope_per_kn),
        payload_mode_hz=1e9,
    )
    return replace(
        ROLLING_CAR,
        half_car=body,
        roll_inertia_kgm2=HEAVY * ROLLING_CAR.roll_inertia_kgm2,
        front=Against(HEAVY * 24e3, 0.9),
        rear=Against(HEAVY * 9e3, 1.1),
        gyro_yaw_rad=0.0,
    )


def load_at(car: RollingCar, left_m: float) -> SidewaysLoad:
    body = car.half_car
    total_kg = body.empty_mass_kg + PAYLOAD_KG
    front_kg = body.empty_front_share * body.empty_mass_kg + (1.0 - POSITION_M / body.wheelbase_m) * PAYLOAD_KG
    moment_kgm = body.empty_mass_kg * float(car.empty_left_m) + PAYLOAD_KG * left_m
    return SidewaysLoad(PAYLOAD_KG, front_kg / total_kg, moment_kgm / total_kg)


def axles_of(car: RollingCar) -> tuple[tuple[Axle, Against], tuple[Axle, Against]]:
    return (car.half_car.front, car.front), (car.half_car.rear, car.rear)


def damper_npm(axle: Axle, omega: float, factor: float = 1.0) -> complex:
    damper = 1j * omega * axle.damper_nspm * factor
    return complex(damper * axle.damper_mount_npm / (damper + axle.damper_mount_npm))


def stiffness(car: RollingCar, springs_npm: F64, omega: float) -> C128:
    """(7, 7) of the body over its axles, its roll and four wheels; springs_npm (4,) are the wheels' own."""
    found = np.zeros((7, 7), np.complex128)
    across = []
    for wheel, (axle, side) in enumerate(WHEELS):
        strut = np.zeros(7)
        strut[axle], strut[2], strut[3 + wheel] = 1.0, side * HALF_TRACK_M, -1.0
        across.append(strut)
        part, _ = axles_of(car)[axle]
        found += (springs_npm[wheel] + 0.5 * damper_npm(part, omega)) * np.outer(strut, strut)
        found[3 + wheel, 3 + wheel] += 0.5 * part.tyre_npm
    for axle, (part, against) in enumerate(axles_of(car)):
        opposed = 0.5 * (across[2 * axle] - across[2 * axle + 1])
        more = damper_npm(part, omega, float(against.damper)) - damper_npm(part, omega)
        found += (against.anti_roll_npm + more) * np.outer(opposed, opposed)
    return found


def mass(car: RollingCar, left_m: float) -> F64:
    """(7, 7), from the places of body and payload."""
    body = car.half_car

    def place(behind_m: float, to_left_m: float) -> F64:
        share = behind_m / body.wheelbase_m
        return np.array([1.0 - share, share, to_left_m, 0.0, 0.0, 0.0, 0.0])

    pitch = np.array([-1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]) / body.wheelbase_m
    roll = np.eye(7)[2]
    empty = place((1.0 - body.empty_front_share) * body.wheelbase_m, float(car.empty_left_m))
    payload = place(POSITION_M, left_m)
    found = body.empty_mass_kg * np.outer(empty, empty) + PAYLOAD_KG * np.outer(payload, payload)
    found += (body.pitch_inertia_kgm2 + PAYLOAD_KG * body.payload_gyration_m2) * np.outer(pitch, pitch)
    # the empty body's inertia is about the roll axis, not about its own centre
    own = car.roll_inertia_kgm2 - body.empty_mass_kg * float(car.empty_left_m) ** 2
    found += (own + PAYLOAD_KG * car.payload_roll_gyration_m2) * np.outer(roll, roll)
    for wheel, (axle, _) in enumerate(WHEELS):
        found[3 + wheel, 3 + wheel] = 0.5 * axles_of(car)[axle][0].unsprung_kg
    return np.asarray(found, np.float64)


def level_springs(car: RollingCar, load: SidewaysLoad) -> F64:
    """Each wheel's spring under half its axle's load."""
    body = car.half_car
    front_kg = load.front_share * (body.empty_mass_kg + PAYLOAD_KG) - body.empty_front_share * body.empty_mass_kg
    added_kn = np.array([front_kg, PAYLOAD_KG - front_kg]) * GRAVITY / 1000.0
    rates = [
        0.5 * axle.spring_npm * np.exp(axle.spring_slope_per_kn * kn)
        for (axle, _), kn in zip(axles_of(car), added_kn, strict=True)
    ]
    return np.repeat(np.array(rates, np.float64), 2)


def carried_by_the_left(car: RollingCar, load: SidewaysLoad) -> F64:
    """(2,) what the left wheel of either axle carries more than half in N, by statics of all seven coordinates."""
    moment_nm = GRAVITY * (car.half_car.empty_mass_kg + PAYLOAD_KG) * load.cg_left_m
    rest = np.linalg.solve(stiffness(car, level_springs(car, load), 0.0).real, -moment_nm * np.eye(7)[2])
    tyres = np.array([-0.5 * axles_of(car)[axle][0].tyre_npm * rest[3 + i] for i, (axle, _) in enumerate(WHEELS)])
    return np.asarray(0.5 * (tyres[::2] - tyres[1::2]), np.float64)


def brute_force(car: RollingCar, left_m: float) -> C128:
    """(4, 3, m): both tracks alike under front and rear, then against each other, as rolling_response has them."""
    load = load_at(car, left_m)
    more_kn = np.outer(carried_by_the_left(car, load), [1.0, -1.0]).ravel() / 1000.0
    slopes = np.repeat([float(axle.spring_slope_per_kn) for axle, _ in axles_of(car)], 2)
    springs = level_springs(car, load) * np.exp(slopes * 2.0 * more_kn)  # as under an axle twice so loaded
    roads = np.zeros((7, 4))
    for wheel, (axle, side) in enumerate(WHEELS):
        roads[3 + wheel, [axle, 2 + axle]] = 0.5 * float(axles_of(car)[axle][0].tyre_npm) * np.array([1.0, side])
    found = np.zeros((4, 3, len(FREQ_HZ)), np.complex128)
    body = car.half_car
    for i, omega in enumerate(2.0 * np.pi * FREQ_HZ):
        moved = np.linalg.solve(stiffness(car, springs, omega) - omega**2 * mass(car, left_m), roads)
        pitch = (moved[1] - moved[0]) / body.wheelbase_m
        at_sensor = moved[0] + body.sensor_position_m * pitch + car.sensor_left_m * moved[2]
        found[:, :, i] = np.stack([-(omega**2) * at_sensor, 1j * omega * pitch, 1j * omega * moved[2]], axis=1)
    return found


def modelled(car: RollingCar, left_m: float) -> C128:
    r = rolling_response(car, load_at(car, left_m), FREQ_HZ)
    return np.stack([r.together_front, r.together_rear, r.against_front, r.against_rear])


def off(car: RollingCar, left_m: float) -> float:
    """The largest difference over the largest reading of the same sensor."""
    expected = brute_force(car, left_m)
    scale = np.max(np.abs(expected), axis=(0, 2), keepdims=True)
    return float(np.max(np.abs(modelled(car, left_m) - expected) / scale))


@pytest.mark.parametrize("left_m", [0.0, 0.3, -0.45])
def test_on_even_springs_it_is_the_car_on_four_wheels(left_m: float) -> None:
    assert off(heavy_car(0.0), left_m) < 1e-8


def test_springs_that_stiffen_turn_heave_into_roll_to_first_order() -> None:
    """What is left out is of second order: half as uneven, a quarter as far off."""
    unlike = replace(heavy_car(0.08), empty_left_m=0.0)
    far, near = off(unlike, 0.4), off(unlike, 0.2)
    assert 1e-5 < far < 0.02
    assert near == pytest.approx(far / 4.0, rel=0.25)


def test_left_out_uneven_springs_would_be_seen() -> None:
    """The car on even springs of the same rates under the same load is further off by far."""
    stiffening, left_m = heavy_car(0.08), 0.4
    body, rates = stiffening.half_car, level_springs(stiffening, load_at(stiffening, left_m))
    even = replace(
        body,
        front=replace(body.front, spring_npm=2.0 * rates[0], spring_slope_per_kn=0.0),
        rear=replace(body.rear, spring_npm=2.0 * rates[2], spring_slope_per_kn=0.0),
    )
    expected = brute_force(stiffening, left_m)
    scale = np.max(np.abs(expected), axis=(0, 2), keepdims=True)
    plain = modelled(replace(stiffening, half_car=even), left_m)
    assert np.max(np.abs(plain - expected) / scale) > 5.0 * off(stiffening, left_m)


@pytest.mark.parametrize("slope_per_kn", [0.0, 0.08])
@pytest.mark.parametrize("left_m", [0.3, -0.2])
def test_the_axles_share_a_steady_moment_as_statics_has_it(slope_per_kn: float, left_m: float) -> None:
    car = heavy_car(slope_per_kn)
    load = load_at(car, left_m)
    by_axle = carried_by_the_left(car, load)
    moment_nm = GRAVITY * (car.half_car.empty_mass_kg + PAYLOAD_KG) * load.cg_left_m
    assert 2.0 * HALF_TRACK_M * np.sum(by_axle) == pytest.approx(moment_nm, rel=1e-9)
    assert roll_share_front(car, load) == pytest.approx(by_axle[0] / np.sum(by_axle), rel=1e-9)
