"""The half-car as textbooks have it: what both the simulator and the estimator are held to."""

import math
from dataclasses import replace

import numpy as np

from gateway.records import C128, F64
from gateway.sim.parameters import Axle, Damper, Load, Vehicle
from gateway.sim.ride import wheel_loads_kg


def linearised(vehicle: Vehicle) -> Vehicle:
    """The textbook car: no progression, friction, asymmetry, digression or tyre patch, wheels round and balanced.

    Stops and tyre lift-off remain; small motion does not reach them.
    """
    return replace(vehicle, front=_linear(vehicle.front), rear=_linear(vehicle.rear), contact_patch_m=0.0)


def _linear(axle: Axle) -> Axle:
    mean = (axle.damper.compression_nspm + axle.damper.rebound_nspm) / 2.0
    return replace(
        axle,
        spring=replace(axle.spring, progression_npm2=0.0),
        damper=Damper(mean, mean),
        wheel=replace(axle.wheel, imbalance_kgm=0.0, runout_m=0.0),
    )


def static_axle_loads_kg(vehicle: Vehicle, loads: tuple[Load, ...]) -> tuple[float, float]:
    """Front and rear axle load on level ground, from the equilibrium of the whole model."""
    front_left, front_right, rear_left, rear_right = wheel_loads_kg(vehicle, loads).tolist()
    return front_left + front_right, rear_left + rear_right


def half_car(vehicle: Vehicle, load: Load, speed_mps: float, freq_hz: F64) -> C128:
    """Heave of the empty body's CoG place and pitch (m, 2) to a road of unit height, the rear axle delayed.

    Lagrange for two rigid bodies on two springs and two wheels; written from the equations, not from the simulator.
    """
    a = vehicle.cog_position_m
    b = vehicle.wheelbase_m - a
    offset = load.position_m - a  # behind the body's CoG: moves by heave + offset * pitch
    total = vehicle.sprung_kg + load.mass_kg
    common_height = (vehicle.sprung_kg * vehicle.cog_height_m + load.mass_kg * load.height_m) / total
    inertia = (
        vehicle.pitch_inertia_kgm2
        + load.mass_kg * (load.length_m**2 + load.tall_m**2) / 12.0
        + vehicle.sprung_kg * (vehicle.cog_height_m - common_height) ** 2
        + load.mass_kg * (load.height_m - common_height) ** 2
        + load.mass_kg * offset**2
    )
    mass = np.zeros((4, 4))
    mass[:2, :2] = [[total, load.mass_kg * offset], [load.mass_kg * offset, inertia]]
    mass[2, 2], mass[3, 3] = 2 * vehicle.front.wheel.unsprung_kg, 2 * vehicle.rear.wheel.unsprung_kg
    answers = np.empty((len(freq_hz), 2), dtype=complex)
    for row, frequency in enumerate(freq_hz):
        s = 2j * math.pi * frequency
        stiffness = np.zeros((4, 4), dtype=complex)
        force = np.zeros(4, dtype=complex)
        for wheel, (axle, lever) in enumerate(((vehicle.front, -a), (vehicle.rear, b))):
            damper = (axle.damper.compression_nspm + axle.damper.rebound_nspm) / 2.0
            suspension = 2 * (axle.spring.rate_npm + damper * s)
            tyre = 2 * (axle.wheel.tyre_npm + axle.wheel.tyre_nspm * s)
            travel = np.zeros(4)
            travel[[0, 1, 2 + wheel]] = 1.0, lever, -1.0
            stiffness += suspension * np.outer(travel, travel)
            stiffness[2 + wheel, 2 + wheel] += tyre
            delay = 0.0 if wheel == 0 else vehicle.wheelbase_m / speed_mps
            force[2 + wheel] = tyre * np.exp(-s * delay)
        answers[row] = np.linalg.solve(mass * s * s + stiffness, force)[:2]
    return answers
