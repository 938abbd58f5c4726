"""A linear half-car that meets one road twice: first with the front axle, one wheelbase later with the rear.

Heave and pitch of a rigid body on two axles, each a spring, a damper in series with its elastic
mount, an unsprung mass and a tyre. The payload is a point mass with its own inertia, carried on a
floor that gives a little. The body is described by the vertical positions of its points over the two
axles, in which coordinates the suspension is diagonal and the payload enters without dividing by it.

Fields may be numbers or arrays that broadcast against frequency, so that many vehicles are solved at once.
"""

from dataclasses import dataclass

import numpy as np

from gateway.records import C128, F64
from gateway.units import STANDARD_GRAVITY_MPS2

Real = float | F64
Rate = Real | C128

INVERSE_PAYLOAD_KG = 30.0  # 1/L becomes L / (L^2 + this^2): an empty vehicle has no payload position


@dataclass(frozen=True, slots=True)
class Axle:
    """Both wheels of one axle together.

    The spring stiffens with the static load W (kN) that the payload adds: the logarithm of its rate
    has a slope at W = 0, which changes by spring_bends_per_kn at each of bend_loads_kn. Helper springs
    and bump stops bend it sharply, progressive coils gently.
    """

    spring_npm: Real
    spring_slope_per_kn: Real
    spring_bends_per_kn: tuple[Real, ...]
    bend_loads_kn: tuple[float, ...]
    damper_nspm: Real
    damper_mount_npm: Real
    tyre_npm: Real
    unsprung_kg: Real


@dataclass(frozen=True, slots=True)
class HalfCar:
    """A vehicle on a straight road, without its payload. Masses are of the sprung mass, share 0..1.

    payload_gyration_m2 is the payload's squared radius of gyration in pitch; payload_mode_hz and
    payload_damping_ratio say how it moves against the floor; gyro_lag_s is by how much the pitch
    rate comes later than the acceleration.
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
    """What the sensors read for a unit road displacement under one axle, in the frequency domain.

    Arrays (..., m): acceleration in (m/s2)/m, pitch rate in (rad/s)/m, by the front and the rear axle.
    """

    acceleration_front: C128
    acceleration_rear: C128
    pitch_rate_front: C128
    pitch_rate_rear: C128


def frequency_response(car: HalfCar, payload_kg: Real, front_share: Real, freq_hz: F64) -> Response:
    """Sensor readings per road displacement at freq_hz (m,) > 0, with the payload aboard.

    ``front_share`` (0..1) is of the sprung mass with payload. At frequency zero the body follows the
    road: over each axle the displacement is that of the road there.
    """
    omega = 2.0 * np.pi * freq_hz
    by_front, by_rear = _body_over_axles(car, payload_kg, front_share, freq_hz)
    from_front, from_rear = _sensed(car, *by_front, omega), _sensed(car, *by_rear, omega)
    return Response(from_front[0], from_rear[0], from_front[1], from_rear[1])


def strokes(car: HalfCar, payload_kg: Real, front_share: Real, freq_hz: F64) -> tuple[C128, C128]:
    """By how much the springs of front and rear axle (2, ..., m) stretch, for a unit of road under the front axle, and
    under the rear one.

    With K the suspension and T the wheel held by its tyre the wheel moves by (K body + k_t road) / (K + T).
    """
    omega = 2.0 * np.pi * freq_hz
    added = added_axle_masses_kg(car, payload_kg, front_share)
    stretched = []
    for i, over_axles in enumerate(_body_over_axles(car, payload_kg, front_share, freq_hz)):
        of_axles = []
        for k, (axle, added_kg) in enumerate(zip((car.front, car.rear), added, strict=True)):
            wheel = wheel_npm(axle, omega)
            by_road = axle.tyre_npm if i == k else 0.0
            of_axles.append((wheel * over_axles[k] - by_road) / (suspension_npm(axle, added_kg, omega) + wheel))
        stretched.append(np.stack(of_axles))
    return stretched[0], stretched[1]


def _body_over_axles(
    car: HalfCar, payload_kg: Real, front_share: Real, freq_hz: F64
) -> tuple[tuple[C128, C128], tuple[C128, C128]]:
    """The body's displacement over front and rear axle, for a unit of road under the front one; then the rear one."""
    omega = 2.0 * np.pi * freq_hz
    mass_ff, mass_rr, mass_fr = body_mass(car, payload_kg, front_share, freq_hz)
    added_front_kg, added_rear_kg = added_axle_masses_kg(car, payload_kg, front_share)
    body_front, road_front = axle_forces(car.front, added_front_kg, omega)
    body_rear, road_rear = axle_forces(car.rear, added_rear_kg, omega)
    d_ff = body_front - omega**2 * mass_ff
    d_rr = body_rear - omega**2 * mass_rr
    d_fr = -(omega**2) * mass_fr
    determinant = d_ff * d_rr - d_fr * d_fr
    by_front = road_front / determinant
    by_rear = road_rear / determinant
    return (d_rr * by_front, -d_fr * by_front), (-d_fr * by_rear, d_ff * by_rear)


def _sensed(car: HalfCar, over_front: C128, over_rear: C128, omega: F64) -> tuple[C128, C128]:
    """Vertical acceleration at the sensor and pitch rate (nose down), from the body's displacement over the axles."""
    pitch = (over_rear - over_front) / car.wheelbase_m
    acceleration = -(omega**2) * (over_front + car.sensor_position_m * pitch)
    pitch_rate = 1j * omega * pitch * np.exp(-1j * omega * car.gyro_lag_s)
    return acceleration, pitch_rate


def axle_forces(axle: Axle, added_kg: Real, omega: F64) -> tuple[C128, C128]:
    """Force on the body per minus its displacement, and per road displacement, in N/m.

    With K the suspension and T the wheel held by its tyre: K T / (K + T) and K k_t / (K + T); the wheel's own movement
    is eliminated.
    """
    suspension, wheel = suspension_npm(axle, added_kg, omega), wheel_npm(axle, omega)
    in_series = suspension / (suspension + wheel)
    return np.asarray(in_series * wheel, np.complex128), np.asarray(in_series * axle.tyre_npm, np.complex128)


def suspension_npm(axle: Axle, added_kg: Real, omega: F64) -> Rate:
    """Springs, and beside them dampers on their elastic mounts, under ``added_kg`` on the axle."""
    damper = 1j * omega * axle.damper_nspm
    return spring_npm(axle, added_kg) + damper / (1.0 + damper / axle.damper_mount_npm)


def wheel_npm(axle: Axle, omega: F64) -> Real:
    """T = k_t - m_u omega^2: both wheels held by their tyres."""
    wheel: Real = axle.tyre_npm - omega**2 * axle.unsprung_kg
    return wheel


def spring_npm(axle: Axle, added_kg: Real) -> Real:
    """Rate of both springs under ``added_kg`` on the axle."""
    added_kn = added_kg * (STANDARD_GRAVITY_MPS2 / 1000.0)
    log_stiffening = axle.spring_slope_per_kn * added_kn
    for bend, load_kn in zip(axle.spring_bends_per_kn, axle.bend_loads_kn, strict=True):
        log_stiffening = log_stiffening + bend * np.maximum(added_kn - load_kn, 0.0)
    stiffened: Real = axle.spring_npm * np.exp(log_stiffening)
    return stiffened


def added_axle_masses_kg(car: HalfCar, payload_kg: Real, front_share: Real) -> tuple[Real, Real]:
    """What the payload adds on the front and on the rear axle."""
    front_kg = front_share * (car.empty_mass_kg + payload_kg) - car.empty_front_share * car.empty_mass_kg
    return front_kg, payload_kg - front_kg


def body_mass(car: HalfCar, payload_kg: Real, front_share: Real, freq_hz: F64) -> tuple[C128, C128, C128]:
    """Mass matrix (front-front, rear-rear, front-rear) of body and payload for the displacements over the axles.

    A point mass L at d adds L (1 - d/l)^2, L (d/l)^2 and L (1 - d/l)(d/l); written with the masses
    F and R it puts on the axles, the last is q = L/4 - (R - F)^2 / (4 L) and the others F - q and R - q.
    """
    share, length = car.empty_front_share, car.wheelbase_m
    front_kg, rear_kg = added_axle_masses_kg(car, payload_kg, front_share)
    inverse_payload = payload_kg / (payload_kg**2 + INVERSE_PAYLOAD_KG**2)
    coupling = (
        payload_kg / 4.0
        - (rear_kg - front_kg) ** 2 / 4.0 * inverse_payload
        - payload_kg * car.payload_gyration_m2 / length**2
    )
    felt = payload_felt(car, freq_hz)
    turning = car.pitch_inertia_kgm2 / length**2
    front_front = car.empty_mass_kg * share**2 + turning + felt * (front_kg - coupling)
    rear_rear = car.empty_mass_kg * (1.0 - share) ** 2 + turning + felt * (rear_kg - coupling)
    front_rear = car.empty_mass_kg * share * (1.0 - share) - turning + felt * coupling
    return front_front, rear_rear, front_rear


def payload_felt(car: HalfCar, freq_hz: F64) -> C128:
    """By which factor the payload feels heavier than it is, moving on its own floor: a base-excited oscillator."""
    ratio = freq_hz / car.payload_mode_hz
    damping = 2j * car.payload_damping_ratio * ratio
    felt: C128 = (1.0 + damping) / (1.0 - ratio**2 + damping)
    return felt
