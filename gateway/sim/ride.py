"""A vehicle on a road: the movement of body and wheels."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.records import F64
from gateway.sim.chassis import Chassis, Records, chassis_of
from gateway.sim.integrator import FIRST_LOAD, GROUND, N_BODY, Course, accelerations, integrate, look_up_ground
from gateway.sim.parameters import Load, Vehicle
from gateway.sim.road import Road
from gateway.sim.speed_profile import Drive
from gateway.units import STANDARD_GRAVITY_MPS2

STEP_S: Final = 0.001  # chosen: of the integration
RECORD_EVERY: Final = 2  # chosen: steps; 500 Hz, above all sensors


@dataclass(frozen=True, slots=True)
class Ride:
    """The movement every step_s from the drive's start: rows (n,).

    Body motion about the empty body's centre of gravity, as heave [m], pitch and roll [rad], columns of position, rate
    and acceleration (n, 3); wheel loads tyre_n (n, 4) in N; speed and accelerations of the course (n,).
    """

    step_s: float
    position: F64
    rate: F64
    acceleration: F64
    tyre_n: F64
    speed_mps: F64
    longitudinal_mps2: F64
    lateral_mps2: F64

    def __len__(self) -> int:
        return len(self.speed_mps)

    @property
    def t_s(self) -> F64:
        return np.arange(len(self), dtype=np.float64) * self.step_s


def ride(
    vehicle: Vehicle,
    loads: tuple[Load, ...],
    road: Road,
    drive: Drive,
    start_m: float | None = None,
    step_s: float = STEP_S,
    record_every: int = RECORD_EVERY,
) -> Ride:
    """Drive over the road, starting with the front axle at start_m (default: the wheelbase).

    Begins in the static equilibrium on the heights there. Raises ValueError if the road ends before the drive.
    """
    begin_m = vehicle.wheelbase_m if start_m is None else start_m
    travelled = begin_m + drive.travelled_m
    if travelled[-1] > road.length_m:
        raise ValueError(f"the drive needs {travelled[-1]:.0f} m of road, this one has {road.length_m:.0f} m")
    felt = road.enveloped(vehicle.contact_patch_m)
    along = drive.longitudinal_mps2
    course = Course(
        felt.step_m, felt.left_m, felt.right_m, vehicle.wheelbase_m,
        drive.step_s, travelled, drive.speed_mps, along, drive.lateral_mps2,
    )  # fmt: skip
    chassis = chassis_of(vehicle, loads)
    position, _ = equilibrium(chassis, course)
    n_records = int(drive.duration_s / (step_s * record_every) + 1e-9) + 1
    motion, tyre_n = integrate(chassis, course, position, np.zeros_like(position), step_s, record_every, n_records)
    t_s = np.arange(n_records) * step_s * record_every
    drive_t_s = np.arange(len(drive.speed_mps)) * drive.step_s
    speed, longitudinal, lateral = (np.interp(t_s, drive_t_s, x) for x in (drive.speed_mps, along, drive.lateral_mps2))
    return Ride(
        step_s * record_every, motion[:, 0:3], motion[:, 3:6], motion[:, 6:9], tyre_n, speed, longitudinal, lateral
    )


def equilibrium(chassis: Chassis, course: Course) -> tuple[F64, F64]:
    """The vehicle's rest at the course's start: position (7 + k,), wheel loads (4,) in N.

    Newton's method on the equations of motion themselves, so a simulation begun there stays there.
    """
    n = FIRST_LOAD + len(chassis.elastic)
    still, tyre_n = np.zeros(4, GROUND), np.zeros(4)
    look_up_ground(course, chassis.corners, 0.0, still)
    position = np.full(n, np.mean(still["height_m"]))
    position[N_BODY:FIRST_LOAD] = still["height_m"]  # every tyre on the ground, or it would give Newton no slope
    position[1:N_BODY] = 0.0
    still["height_rate_mps"] = still["imbalance_n"] = 0.0
    for _ in range(50):
        slope = np.column_stack([_residual_change(chassis, position, still, i) for i in range(n)])
        correction = np.linalg.solve(slope, _residual(chassis, position, still, tyre_n))
        position = position - correction
        if np.max(np.abs(correction)) < 1e-12:
            break
    _residual(chassis, position, still, tyre_n)
    return position, tyre_n


def wheel_loads_kg(vehicle: Vehicle, loads: tuple[Load, ...]) -> F64:
    """Readings of scales under the four wheels (front left and right, rear left and right) at rest on level ground."""
    level = np.zeros(2)
    course = Course(1.0, level, level, vehicle.wheelbase_m, 1.0, level, level, level, level)
    _, tyre_n = equilibrium(chassis_of(vehicle, loads), course)
    return tyre_n / STANDARD_GRAVITY_MPS2


def _residual(chassis: Chassis, position: F64, ground: Records, tyre_n: F64) -> F64:
    acceleration = np.zeros_like(position)
    accelerations(chassis, position, np.zeros_like(position), ground, 0.0, 0.0, acceleration, tyre_n)
    return acceleration


def _residual_change(chassis: Chassis, position: F64, ground: Records, i: int) -> F64:
    """Derivative of the residual to position i, central difference."""
    nudge = np.zeros_like(position)
    nudge[i] = 1e-6
    tyre_n = np.zeros(4)
    ahead = _residual(chassis, position + nudge, ground, tyre_n)
    return (ahead - _residual(chassis, position - nudge, ground, tyre_n)) / 2e-6
