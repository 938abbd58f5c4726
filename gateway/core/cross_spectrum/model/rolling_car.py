"""The half-car with roll: the same body on two axles and two tracks, with a load that may be off the centre line.

The wheels of an axle are alike, so it moves in two independent ways: both wheels together, as in the half-car, and one
against the other, where the anti-roll bar is a further spring. A payload off the centre line couples them through its
inertia. Left is positive, roll is positive with the left side up (ISO 8855).
Newton's law for a rigid body on four wheels, written out in docs/method.md. Lateral movement of body and tyres, and
roll centres, are neglected: the free rates against roll absorb their effect at the frequencies of the body.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gateway.core.cross_spectrum.model.half_car import (
    INVERSE_PAYLOAD_KG,
    HalfCar,
    Real,
    added_axle_masses_kg,
    axle_numbers,
    body_masses_kg,
    spring_npm,
)
from gateway.core.cross_spectrum.model.motion import Frame, Motion, Numbers
from gateway.records import C128, F64


@dataclass(frozen=True, slots=True)
class Against:
    """The differences of an axle when its wheels move against each other.

    The anti-roll bar's rate at one wheel, and the factor of the dampers: they are mounted further inside, and wheels
    slip sideways as the body rolls.
    """

    anti_roll_npm: Real
    damper: Real = 1.0


@dataclass(frozen=True, slots=True)
class RollingCar:
    """A half-car with a width. Inertia is about the roll axis, rates of anti-roll bars are at one of both wheels,
    sensor and empty body have a place left of the centre line.

    payload_roll_gyration_m2 is the payload's squared radius of gyration in roll about its own centre; gyro_yaw_rad is
    the gyro's turn to the left.
    """

    half_car: HalfCar
    half_track_m: float
    roll_inertia_kgm2: Real
    payload_roll_gyration_m2: Real
    front: Against
    rear: Against
    sensor_left_m: Real
    gyro_yaw_rad: Real
    empty_left_m: Real


@dataclass(frozen=True, slots=True)
class SidewaysLoad:
    """A payload, the resulting front share (0..1), and the centre of gravity of the whole sprung mass left of the
    centre line.
    """

    payload_kg: Real
    front_share: Real
    cg_left_m: Real


@dataclass(frozen=True, slots=True)
class RollingResponse:
    """Readings of vertical acceleration, pitch rate and roll rate (3, ..., m) per unit of road under one axle.

    together: both tracks alike; against: the left as much up as the right is down.
    """

    together_front: C128
    together_rear: C128
    against_front: C128
    against_rear: C128


def rolling_response(car: RollingCar, load: SidewaysLoad, freq_hz: F64) -> RollingResponse:
    """Sensor readings per road displacement at freq_hz (m,) > 0: see half_car.frequency_response."""
    frame = Frame(car.half_car.wheelbase_m, car.half_track_m)
    paths = Motion(rolling_numbers(car, load), frame, freq_hz, n_sensors=3).paths
    return RollingResponse(*(paths[:, way] for way in range(4)))


def rolling_numbers(car: RollingCar, load: SidewaysLoad) -> Numbers:
    """The numbers in its equations of motion."""
    body = car.half_car
    rigid_kg, carried_kg = body_masses_kg(body, load.payload_kg, load.front_share)
    rigid_roll, carried_roll = _roll_masses(car, load)
    per_track = 1.0 / car.half_track_m
    scale = (per_track, per_track, per_track**2)
    return Numbers.of(
        *_axle_numbers(car, load),
        (*rigid_kg, *(mass * unit for mass, unit in zip(rigid_roll, scale, strict=True))),
        (*carried_kg, *(mass * unit for mass, unit in zip(carried_roll, scale, strict=True))),
        (body.payload_mode_hz, body.payload_damping_ratio),
        (body.sensor_position_m, body.gyro_lag_s, car.sensor_left_m, car.gyro_yaw_rad),
    )


def _axle_numbers(car: RollingCar, load: SidewaysLoad) -> list[tuple[Real, ...]]:
    """Numbers of front and rear axle: each wheel's spring is as stiff as under an axle with twice the wheel's load."""
    body = car.half_car
    added_kg = added_axle_masses_kg(body, load.payload_kg, load.front_share)
    springs = [spring_npm(axle, kg) for axle, kg in zip((body.front, body.rear), added_kg, strict=True)]
    share = _roll_share_front(car, springs)
    moved_kg = (body.empty_mass_kg + load.payload_kg) * load.cg_left_m / car.half_track_m  # to the left from the right
    found = []
    for axle, against, spring, kg, moved in zip(
        (body.front, body.rear),
        (car.front, car.rear),
        springs,
        added_kg,
        (share * moved_kg, (1.0 - share) * moved_kg),
        strict=True,
    ):
        left, right = np.asarray(spring_npm(axle, np.array([kg + moved, kg - moved])))
        found.append((*axle_numbers(axle, spring), left - right, against.damper, against.anti_roll_npm))
    return found


def roll_share_front(car: RollingCar, load: SidewaysLoad) -> Real:
    """The front axle's part of a steady roll moment, 0..1, from springs, bars and tyres."""
    body = car.half_car
    added_kg = added_axle_masses_kg(body, load.payload_kg, load.front_share)
    return _roll_share_front(
        car, [spring_npm(axle, kg) for axle, kg in zip((body.front, body.rear), added_kg, strict=True)]
    )


def _roll_share_front(car: RollingCar, springs_npm: Sequence[Real]) -> Real:
    front, rear = springs_npm
    front = _still_npm(front + car.front.anti_roll_npm, car.half_car.front.tyre_npm)
    rear = _still_npm(rear + car.rear.anti_roll_npm, car.half_car.rear.tyre_npm)
    return front / (front + rear)


def _still_npm(suspension_npm: Real, tyre_npm: Real) -> Real:
    return suspension_npm * tyre_npm / (suspension_npm + tyre_npm)


def _roll_masses(car: RollingCar, load: SidewaysLoad) -> tuple[tuple[Real, Real, Real], tuple[Real, Real, Real]]:
    """Coupling mass of front and rear with roll (kg m), and roll inertia (kg m2): of the body, then of the payload on
    its floor.

    A point mass L at (d, y) adds L y (1 - d/l), L y d/l and L y^2. An empty vehicle has no payload to divide by: its
    moment, if any, is distributed like its own mass.
    """
    body = car.half_car
    payload_kg, own_kgm = load.payload_kg, body.empty_mass_kg * car.empty_left_m
    moment_kgm = (body.empty_mass_kg + payload_kg) * load.cg_left_m - own_kgm
    added_front_kg, _ = added_axle_masses_kg(body, payload_kg, load.front_share)
    small = INVERSE_PAYLOAD_KG**2
    to_front = (added_front_kg * payload_kg + body.empty_front_share * small) / (payload_kg**2 + small)
    inverse_payload = payload_kg / (payload_kg**2 + small)
    turning = car.roll_inertia_kgm2 + payload_kg * car.payload_roll_gyration_m2
    rigid = own_kgm * body.empty_front_share, own_kgm * (1.0 - body.empty_front_share), turning
    return rigid, (moment_kgm * to_front, moment_kgm * (1.0 - to_front), moment_kgm**2 * inverse_payload)
