"""A simulated vehicle at rest."""

from gateway.sim.parameters import Load, Vehicle
from gateway.sim.ride import wheel_loads_kg


def static_axle_loads_kg(vehicle: Vehicle, loads: tuple[Load, ...]) -> tuple[float, float]:
    """Front and rear axle load on level ground, from the equilibrium of the whole model."""
    front_left, front_right, rear_left, rear_right = wheel_loads_kg(vehicle, loads).tolist()
    return front_left + front_right, rear_left + rear_right
