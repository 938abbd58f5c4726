"""A simulated vehicle at rest."""

import numpy as np

from gateway.sim.chassis import chassis_of
from gateway.sim.ride import Course, equilibrium
from gateway.sim.vehicle import Load, Vehicle
from gateway.units import STANDARD_GRAVITY_MPS2


def static_axle_loads_kg(vehicle: Vehicle, loads: tuple[Load, ...]) -> tuple[float, float]:
    """Front and rear axle load on level ground, from the equilibrium of the whole model."""
    level = np.zeros(2)
    course = Course(1.0, level, level, vehicle.wheelbase_m, 1.0, level, level, level, level)
    _, tyre_n = equilibrium(chassis_of(vehicle, loads), course)
    front, rear = (float(np.sum(pair)) / STANDARD_GRAVITY_MPS2 for pair in (tyre_n[:2], tyre_n[2:]))
    return front, rear
