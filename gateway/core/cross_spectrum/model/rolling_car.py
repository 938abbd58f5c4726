"""The half-car with roll: the same body on two axles that meets two tracks, with a load that may lie sideways.

Wheels of an axle are alike, so that it moves in two ways that do not disturb each other: both wheels together, as the
half-car has it, and one against the other, where the anti-roll bar is a further spring. A payload off the centre line
couples them through its inertia. Left is positive, roll is positive with the left side up (ISO 8855).

Newton's law for a rigid body on four wheels, written out in docs/method.md. Sideways movement of body and tyres, and
roll centres, are left out: what they do to roll is in the free rates against roll, at frequencies where the body moves.
"""

from dataclasses import dataclass, replace

import numpy as np

from gateway.core.cross_spectrum.model.half_car import (
    INVERSE_PAYLOAD_KG,
    Axle,
    HalfCar,
    Real,
    added_axle_masses_kg,
    body_mass,
    payload_felt,
    spring_npm,
    suspension_npm,
    wheel_npm,
)
from gateway.records import C128, F64


@dataclass(frozen=True, slots=True)
class Against:
    """What is different of an axle where its wheels move against each other.

    The anti-roll bar's rate as one wheel feels it, and by how much dampers count for more or less: they stand further
    in, wheels slip sideways as the body rolls.
    """

    anti_roll_npm: Real
    damper: Real = 1.0

    def of(self, axle: Axle) -> Axle:
        """The axle as it is so moved, its bar apart."""
        return replace(axle, damper_nspm=axle.damper_nspm * self.damper)


@dataclass(frozen=True, slots=True)
class RollingCar:
    """A half-car with a width. Inertia is about the roll axis, the rates of anti-roll bars are as one wheel feels them
    of both, sensor and empty body are so far left of the centre line.

    payload_roll_gyration_m2 is the payload's squared radius of gyration in roll about its own place; gyro_yaw_rad is
    by how much the gyro is turned to the left.
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
    """A payload, and with it the front share (0..1) and the centre of gravity's lateral place of all that is sprung."""

    payload_kg: Real
    front_share: Real
    cg_left_m: Real


@dataclass(frozen=True, slots=True)
class RollingResponse:
    """What vertical acceleration, pitch rate and roll rate (3, ..., m) read for a unit of road under one axle.

    together: both tracks alike; against: the left as much up as the right is down.
    """

    together_front: C128
    together_rear: C128
    against_front: C128
    against_rear: C128


def rolling_response(car: RollingCar, load: SidewaysLoad, freq_hz: F64) -> RollingResponse:
    """Sensor readings per road displacement at freq_hz (m,) > 0: half_car.frequency_response with a third coordinate.

    Roll is eliminated first, which leaves the half-car's two equations with a little taken off.
    """
    body, half_track_m = car.half_car, car.half_track_m
    omega = 2.0 * np.pi * freq_hz
    mass_ff, mass_rr, mass_fr = body_mass(body, load.payload_kg, load.front_share, freq_hz)
    added_front_kg, added_rear_kg = added_axle_masses_kg(body, load.payload_kg, load.front_share)
    moved_front_kg, moved_rear_kg = _moved_kg(car, load)
    front = _axle(body.front, added_front_kg, moved_front_kg, car.front, omega)
    rear = _axle(body.rear, added_rear_kg, moved_rear_kg, car.rear, omega)
    mass_fp, mass_rp, mass_pp = _roll_mass(car, load, added_front_kg, freq_hz)
    d_fp = half_track_m * front.body_uneven - omega**2 * mass_fp
    d_rp = half_track_m * rear.body_uneven - omega**2 * mass_rp
    d_pp = half_track_m**2 * (front.body_against + rear.body_against) - omega**2 * mass_pp
    by_fp, by_rp = d_fp / d_pp, d_rp / d_pp
    d_ff = front.body - omega**2 * mass_ff - d_fp * by_fp
    d_rr = rear.body - omega**2 * mass_rr - d_rp * by_rp
    d_fr = -(omega**2) * mass_fr - d_fp * by_rp
    determinant = d_ff * d_rr - d_fr * d_fr

    def moved(force_front: C128, force_rear: C128, moment: C128) -> C128:
        """Sensed (3, ..., m), for generalised forces on the body over the axles and about the roll axis."""
        on_front, on_rear = force_front - by_fp * moment, force_rear - by_rp * moment
        over_front = (d_rr * on_front - d_fr * on_rear) / determinant
        over_rear = (d_ff * on_rear - d_fr * on_front) / determinant
        roll = moment / d_pp - by_fp * over_front - by_rp * over_rear
        return _sensed(car, over_front, over_rear, roll, omega)

    none = np.zeros_like(determinant)
    return RollingResponse(
        together_front=moved(front.road, none, half_track_m * front.road_uneven),
        together_rear=moved(none, rear.road, half_track_m * rear.road_uneven),
        against_front=moved(front.road_uneven, none, half_track_m * front.road_against),
        against_rear=moved(none, rear.road_uneven, half_track_m * rear.road_against),
    )


@dataclass(frozen=True, slots=True)
class _Wheels:
    """Forces of an axle on the body in N/m, as half_car.axle_forces has them: by both wheels, by one against the other,
    and what of either the uneven springs of an uneven load turn into the other.
    """

    body: C128
    body_against: C128
    body_uneven: C128
    road: C128
    road_against: C128
    road_uneven: C128


def _axle(axle: Axle, added_kg: Real, moved_kg: Real, against: Against, omega: F64) -> _Wheels:
    """``moved_kg`` is what the left wheel carries more and the right one less.

    Each wheel's spring is as stiff as under an axle that carries twice the wheel's load. With K, K' the suspension of
    both wheels together and against each other, D the left spring's rate less the right one's, and T the wheels:
    (K T / (K + T), ...) as for one axle, coupled by T / (K + T) D T / (K' + T) to first order in D.
    """
    turned = against.of(axle)
    together = suspension_npm(axle, added_kg, omega)
    opposed = suspension_npm(turned, added_kg, omega) + against.anti_roll_npm
    wheel = wheel_npm(axle, omega)
    left, right = spring_npm(axle, added_kg + 2.0 * moved_kg), spring_npm(axle, added_kg - 2.0 * moved_kg)
    per_together, per_opposed = 1.0 / (together + wheel), 1.0 / (opposed + wheel)
    coupled = 0.5 * (left - right) * per_together * per_opposed
    forces = (
        together * wheel * per_together,
        opposed * wheel * per_opposed,
        wheel * coupled * wheel,
        together * axle.tyre_npm * per_together,
        opposed * axle.tyre_npm * per_opposed,
        wheel * coupled * axle.tyre_npm,
    )
    return _Wheels(*(np.asarray(force, np.complex128) for force in forces))


def _moved_kg(car: RollingCar, load: SidewaysLoad) -> tuple[Real, Real]:
    """What the left wheel of the front and of the rear axle carries more than half their axle's load."""
    moment_kgm = (car.half_car.empty_mass_kg + load.payload_kg) * load.cg_left_m
    share = roll_share_front(car, load)
    moved_kg = moment_kgm / (2.0 * car.half_track_m)
    return share * moved_kg, (1.0 - share) * moved_kg


def roll_share_front(car: RollingCar, load: SidewaysLoad) -> Real:
    """Which part of a steady moment about the roll axis the front axle takes, 0..1, by springs, bars and tyres."""
    body = car.half_car
    added_front_kg, added_rear_kg = added_axle_masses_kg(body, load.payload_kg, load.front_share)
    front = _still_npm(body.front, added_front_kg, car.front)
    rear = _still_npm(body.rear, added_rear_kg, car.rear)
    return front / (front + rear)


def _still_npm(axle: Axle, added_kg: Real, against: Against) -> Real:
    suspension, tyre_npm = spring_npm(axle, added_kg) + against.anti_roll_npm, axle.tyre_npm
    return suspension * tyre_npm / (suspension + tyre_npm)


def _roll_mass(
    car: RollingCar, load: SidewaysLoad, added_front_kg: Real, freq_hz: F64
) -> tuple[Real | C128, Real | C128, Real | C128]:
    """Mass that couples the front and the rear with roll (kg m), and roll inertia (kg m2).

    A point mass L at (d, y) adds L y (1 - d/l), L y d/l and L y^2. An empty vehicle has no payload to divide by: what
    moment it is told to have lies as its own mass does.
    """
    body = car.half_car
    payload_kg, own_kgm = load.payload_kg, body.empty_mass_kg * car.empty_left_m
    moment_kgm = (body.empty_mass_kg + payload_kg) * load.cg_left_m - own_kgm
    felt = payload_felt(body, freq_hz)
    small = INVERSE_PAYLOAD_KG**2
    to_front = (added_front_kg * payload_kg + body.empty_front_share * small) / (payload_kg**2 + small)
    inverse_payload = payload_kg / (payload_kg**2 + small)
    front = own_kgm * body.empty_front_share + felt * (moment_kgm * to_front)
    rear = own_kgm * (1.0 - body.empty_front_share) + felt * (moment_kgm * (1.0 - to_front))
    turning = car.roll_inertia_kgm2 + felt * (
        payload_kg * car.payload_roll_gyration_m2 + moment_kgm**2 * inverse_payload
    )
    return front, rear, turning


def _sensed(car: RollingCar, over_front: C128, over_rear: C128, roll: C128, omega: F64) -> C128:
    """(3, ..., m), from the body's displacement over the axles and its roll."""
    body = car.half_car
    pitch = (over_rear - over_front) / body.wheelbase_m
    acceleration = -(omega**2) * (over_front + body.sensor_position_m * pitch + car.sensor_left_m * roll)
    late = 1j * omega * np.exp(-1j * omega * body.gyro_lag_s)
    pitch_rate = late * (pitch - car.gyro_yaw_rad * roll)
    roll_rate = late * (roll + car.gyro_yaw_rad * pitch)
    return np.stack(np.broadcast_arrays(acceleration, pitch_rate, roll_rate))
