"""The equations of motion and their Runge-Kutta steps, compiled.

State: heave, pitch, roll, four wheel lifts, then the lifts of the elastic loads, all counted from
the empty vehicle's equilibrium.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np

from gateway.records import F64
from gateway.sim.chassis import Chassis, Records
from gateway.sim.compiled import compiled
from gateway.units import STANDARD_GRAVITY_MPS2

N_BODY = 3  # heave, pitch, roll
N_WHEELS = 4  # lifts of the wheels
FIRST_LOAD = N_BODY + N_WHEELS


class Course(NamedTuple):
    """The road under the tracks and the vehicle's speed along it.

    left_m, right_m heights every road_step_m; speed, longitudinal and lateral acceleration (n,) every drive_step_s,
    linear in between; travelled_m (n,) the front axle's distance at each.
    """

    road_step_m: float
    left_m: F64
    right_m: F64
    wheelbase_m: float
    drive_step_s: float
    travelled_m: F64
    speed_mps: F64
    longitudinal_mps2: F64
    lateral_mps2: F64


GROUND: Final = np.dtype([(name, np.float64) for name in ("height_m", "height_rate_mps", "imbalance_n")])


@compiled
def look_up_ground(course: Course, corners: Records, t_s: float, ground: Records) -> tuple[float, float]:
    """Fill ``ground`` (4,) of GROUND for time t_s; longitudinal and lateral acceleration [m/s2] then.

    Speed is linear between the drive's samples, so the distance is their exact integral.
    """
    place = t_s / course.drive_step_s
    k = min(max(int(place), 0), course.speed_mps.size - 2)
    share = place - k
    tau = share * course.drive_step_s
    gain = (course.speed_mps[k + 1] - course.speed_mps[k]) / course.drive_step_s
    speed = course.speed_mps[k] + gain * tau
    front_m = course.travelled_m[k] + course.speed_mps[k] * tau + 0.5 * gain * tau * tau
    for wheel in range(N_WHEELS):
        _feel(course, corners[wheel], wheel, front_m, speed, ground[wheel])
    a, b = course.longitudinal_mps2, course.lateral_mps2
    return a[k] + share * (a[k + 1] - a[k]), b[k] + share * (b[k + 1] - b[k])


@compiled
def _feel(course: Course, corner: Any, wheel: int, front_m: float, speed_mps: float, ground: Any) -> None:
    """Height and slope of the track under one wheel, with its run-out and imbalance."""
    s = front_m if wheel < 2 else front_m - course.wheelbase_m
    track = course.left_m if wheel % 2 == 0 else course.right_m
    at = min(max(s / course.road_step_m, 0.0), track.size - 1.000001)
    i = int(at)
    rise = track[i + 1] - track[i]
    angle = s / corner["radius_m"] + 1.7 * wheel  # each wheel mounted as it came
    swing = math.sin(angle)
    slope = rise / course.road_step_m + corner["runout_m"] * math.cos(angle) / corner["radius_m"]
    ground["height_m"] = track[i] + (at - i) * rise + corner["runout_m"] * swing
    ground["height_rate_mps"] = slope * speed_mps
    ground["imbalance_n"] = corner["imbalance_kgm"] * (speed_mps / corner["radius_m"]) ** 2 * swing


@compiled
def spring_force(corner: Any, travel_m: float) -> float:
    """Static spring force [N] with progression and stops at travel_m beyond the empty vehicle's."""
    force: float = corner["spring_preload_n"] + corner["rate_npm"] * travel_m
    if travel_m > 0.0:
        force += 0.5 * corner["progression_npm2"] * travel_m * travel_m
    beyond_bump = travel_m - corner["bump_clearance_m"]
    if beyond_bump > 0.0:
        force += corner["stop_npm2"] * beyond_bump * beyond_bump
    beyond_rebound = -travel_m - corner["rebound_clearance_m"]
    if beyond_rebound > 0.0:
        force -= corner["stop_npm2"] * beyond_rebound * beyond_rebound
    return force


@compiled
def saturated(x: float) -> float:
    """Smooth, odd, of slope 1 at 0, towards -1 and 1: x / sqrt(1 + x^2), several times faster than tanh."""
    return x / math.sqrt(1.0 + x * x)


@compiled
def damper_force(corner: Any, rate_mps: float) -> float:
    """Digressive asymmetric damper and smoothed Coulomb friction [N] at a compression rate."""
    side = corner["compression_nspm"] if rate_mps > 0.0 else corner["rebound_nspm"]
    q = corner["digression"]
    effective = rate_mps
    if q < 1.0:
        knee = corner["knee_mps"]
        effective = q * rate_mps + (1.0 - q) * knee * saturated(rate_mps / knee)
    force: float = side * effective
    if corner["friction_n"] > 0.0:
        force += corner["friction_n"] * saturated(rate_mps / corner["friction_slip_mps"])
    return force


@compiled
def tyre_force(corner: Any, squash_m: float, squash_rate_mps: float) -> float:
    """Push of the road on the tyre [N]; it never pulls: a lifted wheel feels nothing."""
    force: float = corner["tyre_preload_n"] + corner["tyre_npm"] * squash_m
    if force <= 0.0:
        return 0.0
    force += corner["tyre_nspm"] * squash_rate_mps
    return max(force, 0.0)


@compiled
def _press_load(load: Any, position: F64, rate: F64, i: int) -> float:
    """Force of the body on the elastic load with state i [N], up."""
    forward, left = load["forward_m"], load["left_m"]
    lift = position[0] - forward * position[1] + left * position[2] - position[i]
    lift_rate = rate[0] - forward * rate[1] + left * rate[2] - rate[i]
    force: float = load["mass_kg"] * STANDARD_GRAVITY_MPS2 + load["base_npm"] * lift + load["base_nspm"] * lift_rate
    return force


@compiled
def accelerations(
    chassis: Chassis,
    position: F64,
    rate: F64,
    ground: Records,
    longitudinal_mps2: float,
    lateral_mps2: float,
    acceleration: F64,
    tyre_n: F64,
) -> None:
    """Newton and Euler: fill ``acceleration`` (7 + k,) and the wheel loads ``tyre_n`` (4,).

    Braking (negative longitudinal acceleration) presses the nose down, a left turn the right side:
    the inertial forces act at the heights of the masses, the tyres' at the ground.
    """
    lift = chassis.weight[0]
    pitching = chassis.weight[1] - chassis.height_moment_kgm * longitudinal_mps2
    rolling = chassis.weight[2] + chassis.height_moment_kgm * lateral_mps2
    for wheel in range(N_WHEELS):
        c, met = chassis.corners[wheel], ground[wheel]
        forward, left, i = c["forward_m"], c["left_m"], N_BODY + wheel
        travel = position[i] - (position[0] - forward * position[1] + left * position[2])
        travel_rate = rate[i] - (rate[0] - forward * rate[1] + left * rate[2])
        across = N_BODY + wheel + 1 - 2 * (wheel % 2)
        twist = position[i] - position[across] - 2.0 * left * position[2]
        force = spring_force(c, travel) + damper_force(c, travel_rate) + c["anti_roll_npm"] * twist
        tyre_n[wheel] = tyre_force(c, met["height_m"] - position[i], met["height_rate_mps"] - rate[i])
        push = tyre_n[wheel] - force + met["imbalance_n"]
        acceleration[i] = push / c["unsprung_kg"] - STANDARD_GRAVITY_MPS2
        lift += force
        pitching -= forward * force
        rolling += left * force
    for k in range(chassis.elastic.size):
        load, i = chassis.elastic[k], FIRST_LOAD + k
        force = _press_load(load, position, rate, i)
        acceleration[i] = force / load["mass_kg"] - STANDARD_GRAVITY_MPS2
        lift -= force
        pitching += load["forward_m"] * force
        rolling -= load["left_m"] * force
    inverse = chassis.inverse_mass
    for i in range(N_BODY):
        acceleration[i] = inverse[i, 0] * lift + inverse[i, 1] * pitching + inverse[i, 2] * rolling


@compiled
def integrate(
    chassis: Chassis, course: Course, position: F64, rate: F64, step_s: float, record_every: int, n_records: int
) -> tuple[F64, F64]:
    """Classic Runge-Kutta of fourth order from the given state (changed in place).

    Returns motion (n_records, 9): position, rate and acceleration of heave, pitch, roll; and the
    wheel loads (n_records, 4) in N; one row every record_every steps from time 0.
    """
    n = position.size
    ground = np.zeros(N_WHEELS, GROUND)
    tyre = np.zeros(N_WHEELS)
    position_0, rate_0 = np.zeros(n), np.zeros(n)
    acceleration, rate_sum, acceleration_sum = np.zeros(n), np.zeros(n), np.zeros(n)
    motion = np.empty((n_records, 3 * N_BODY))
    tyre_n = np.empty((n_records, N_WHEELS))
    along, aside = look_up_ground(course, chassis.corners, 0.0, ground)
    for step in range((n_records - 1) * record_every + 1):
        position_0[:], rate_0[:] = position, rate
        rate_sum[:], acceleration_sum[:] = 0.0, 0.0
        for stage in range(4):
            accelerations(chassis, position, rate, ground, along, aside, acceleration, tyre)
            if stage == 0 and step % record_every == 0:
                row = step // record_every
                for i in range(N_BODY):
                    motion[row, i], motion[row, 3 + i], motion[row, 6 + i] = position[i], rate[i], acceleration[i]
                for i in range(N_WHEELS):
                    tyre_n[row, i] = tyre[i]
            weight = step_s / 3.0 if stage in (1, 2) else step_s / 6.0
            reach = step_s if stage == 2 else 0.5 * step_s
            for i in range(n):
                rate_sum[i] += weight * rate[i]
                acceleration_sum[i] += weight * acceleration[i]
                position[i] = position_0[i] + reach * rate[i]
                rate[i] = rate_0[i] + reach * acceleration[i]
            if stage in (0, 2):  # the ground is the same in the two middle stages, and in the last and the next first
                along, aside = look_up_ground(course, chassis.corners, step * step_s + reach, ground)
        for i in range(n):
            position[i] = position_0[i] + rate_sum[i]
            rate[i] = rate_0[i] + acceleration_sum[i]
    return motion, tyre_n
