"""A linear half-car that meets one road twice: with the front axle, and one wheelbase later with the rear.

Heave and pitch of a rigid body on two axles, each a spring, a damper in series with its elastic mount, an unsprung mass
and a tyre. The payload is a point mass on a slightly elastic floor; its own inertia turns with the body. The
coordinates are the vertical positions of the body over the two axles: in these the suspension is diagonal, and the
payload enters without a division by it.
Fields may be numbers or arrays that broadcast against frequency, so that many vehicles are solved at once.
"""

from dataclasses import dataclass

import numpy as np

from gateway.core.cross_spectrum.model.motion import Frame, Motion, Numbers
from gateway.records import C128, F64
from gateway.units import STANDARD_GRAVITY_MPS2

Real = float | F64
Rate = Real | C128

INVERSE_PAYLOAD_KG = 30.0  # chosen: 1/L becomes L / (L^2 + this^2), as an empty vehicle has no payload position


@dataclass(frozen=True, slots=True)
class Axle:
    """Both wheels of one axle together.

    The spring stiffens with the static load W (kN) that the payload adds: the logarithm of its rate has a slope at W =
    0, which changes by spring_bends_per_kn (..., n) at each of bend_loads_kn (n,). Helper springs and bump stops cause
    sharp bends, progressive coils gentle ones.
    """

    spring_npm: Real
    spring_slope_per_kn: Real
    spring_bends_per_kn: tuple[float, ...] | F64
    bend_loads_kn: tuple[float, ...]
    damper_nspm: Real
    damper_mount_npm: Real
    tyre_npm: Real
    unsprung_kg: Real


@dataclass(frozen=True, slots=True)
class HalfCar:
    """A vehicle on a straight road, without its payload. Masses are of the sprung mass, share 0..1.

    payload_gyration_m2 is the payload's squared radius of gyration in pitch; payload_mode_hz and payload_damping_ratio
    describe its movement on the floor; gyro_lag_s is the delay of the pitch rate against the acceleration.
    """

    empty_mass_kg: float
    empty_front_share: float
    wheelbase_m: float
    front: Axle
    rear: Axle
    pitch_inertia_kgm2: Real
    sensor_position_m: Real
    payload_gyration_m2: Real
    payload_mode_hz: Real
    payload_damping_ratio: Real
    gyro_lag_s: Real


@dataclass(frozen=True, slots=True)
class Response:
    """Sensor readings for a unit road displacement under one axle, in the frequency domain.

    Arrays (..., m): acceleration in (m/s2)/m, pitch rate in (rad/s)/m, for the front and the rear axle.
    """

    acceleration_front: C128
    acceleration_rear: C128
    pitch_rate_front: C128
    pitch_rate_rear: C128


def frequency_response(car: HalfCar, payload_kg: Real, front_share: Real, freq_hz: F64) -> Response:
    """Sensor readings per road displacement at freq_hz (m,) > 0, with the payload on board.

    ``front_share`` (0..1) is of the sprung mass with payload. At frequency zero the body follows the road: its
    displacement over each axle is that of the road there.
    """
    numbers = half_car_numbers(car, payload_kg, front_share)
    r = Motion(numbers, Frame(car.wheelbase_m), freq_hz, n_sensors=2).paths
    return Response(r[0, 0], r[0, 1], r[1, 0], r[1, 1])


def half_car_numbers(car: HalfCar, payload_kg: Real, front_share: Real) -> Numbers:
    """The numbers in its equations of motion."""
    rigid_kg, carried_kg = body_masses_kg(car, payload_kg, front_share)
    added_front_kg, added_rear_kg = added_axle_masses_kg(car, payload_kg, front_share)
    return Numbers.of(
        axle_numbers(car.front, spring_npm(car.front, added_front_kg)),
        axle_numbers(car.rear, spring_npm(car.rear, added_rear_kg)),
        rigid_kg,
        carried_kg,
        (car.payload_mode_hz, car.payload_damping_ratio),
        (car.sensor_position_m, car.gyro_lag_s),
    )


def strokes(car: HalfCar, payload_kg: Real, front_share: Real, freq_hz: F64) -> tuple[C128, C128]:
    """Stretch of front and rear springs (2, ..., m), per unit of road under the front axle, and under the rear one.

    With K the suspension and T the wheel on its tyre the wheel moves by (K body + k_t road) / (K + T).
    """
    omega = 2.0 * np.pi * freq_hz
    added = added_axle_masses_kg(car, payload_kg, front_share)
    numbers = half_car_numbers(car, payload_kg, front_share)
    body = Motion(numbers, Frame(car.wheelbase_m), freq_hz, n_sensors=2).body
    stretched = []
    for i in range(2):
        of_axles = []
        for k, (axle, added_kg) in enumerate(zip((car.front, car.rear), added, strict=True)):
            wheel = axle.tyre_npm - omega**2 * axle.unsprung_kg
            by_road = axle.tyre_npm if i == k else 0.0
            of_axles.append((wheel * body[k, i] - by_road) / (suspension_npm(axle, added_kg, omega) + wheel))
        stretched.append(np.stack(of_axles))
    return stretched[0], stretched[1]


def axle_numbers(axle: Axle, spring_npm: Real) -> tuple[Real, ...]:
    """The axle's part of motion.Numbers without roll, for springs of this rate."""
    return spring_npm, axle.damper_nspm, axle.damper_mount_npm, axle.tyre_npm, axle.unsprung_kg


def suspension_npm(axle: Axle, added_kg: Real, omega: F64) -> Rate:
    """Springs in parallel with dampers on their elastic mounts, under ``added_kg`` on the axle."""
    damper = 1j * omega * axle.damper_nspm
    return spring_npm(axle, added_kg) + damper / (1.0 + damper / axle.damper_mount_npm)


def spring_npm(axle: Axle, added_kg: Real) -> Real:
    """Rate of both springs under ``added_kg`` on the axle."""
    added_kn = added_kg * (STANDARD_GRAVITY_MPS2 / 1000.0)
    beyond_kn = np.maximum(added_kn - np.asarray(axle.bend_loads_kn), 0.0)
    bent = np.asarray(axle.spring_bends_per_kn * beyond_kn).sum(axis=-1, keepdims=True)
    stiffened: Real = axle.spring_npm * np.exp(axle.spring_slope_per_kn * added_kn + bent)
    return stiffened


def added_axle_masses_kg(car: HalfCar, payload_kg: Real, front_share: Real) -> tuple[Real, Real]:
    """Payload on the front and on the rear axle."""
    front_kg = front_share * (car.empty_mass_kg + payload_kg) - car.empty_front_share * car.empty_mass_kg
    return front_kg, payload_kg - front_kg


def body_masses_kg(
    car: HalfCar, payload_kg: Real, front_share: Real
) -> tuple[tuple[Real, Real, Real], tuple[Real, Real, Real]]:
    """Mass matrix (front-front, rear-rear, front-rear) of the body for the displacements over the axles, then that of
    the payload, which moves on its floor.

    A point mass L at d adds L (1 - d/l)^2, L (d/l)^2 and L (1 - d/l)(d/l). With its masses F and R on the axles the
    last is q = L/4 - (R - F)^2 / (4 L) and the others F - q and R - q. The payload's own inertia turns with the body: a
    load rests on its edges, so that it rocks on its floor at a higher frequency than it bounces.
    """
    share, length = car.empty_front_share, car.wheelbase_m
    front_kg, rear_kg = added_axle_masses_kg(car, payload_kg, front_share)
    inverse_payload = payload_kg / (payload_kg**2 + INVERSE_PAYLOAD_KG**2)
    coupling = payload_kg / 4.0 - (rear_kg - front_kg) ** 2 / 4.0 * inverse_payload
    turning = (car.pitch_inertia_kgm2 + payload_kg * car.payload_gyration_m2) / length**2
    rigid = (
        car.empty_mass_kg * share**2 + turning,
        car.empty_mass_kg * (1.0 - share) ** 2 + turning,
        car.empty_mass_kg * share * (1.0 - share) - turning,
    )
    return rigid, (front_kg - coupling, rear_kg - coupling, coupling)
