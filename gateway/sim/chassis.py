"""The numbers that the integrator needs, from a vehicle and its loads.

Positions are counted from the empty vehicle's equilibrium. The body's reference point is the empty
body's centre of gravity; a place f metres before it and y metres left of it moves by
heave - f pitch + y roll (ISO 8855: pitch positive nose down, roll positive left side up).
Wheels in order: front left, front right, rear left, rear right.
"""

import math
from dataclasses import fields
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gateway.records import F64
from gateway.sim.parameters import Axle, Damper, Load, Spring, Vehicle, Wheel
from gateway.units import STANDARD_GRAVITY_MPS2

_PARTS: Final = (Spring, Damper, Wheel)
_PLACED: Final = ("forward_m", "left_m", "anti_roll_npm", "spring_preload_n", "tyre_preload_n")  # preloads: when empty
CORNER: Final = np.dtype(
    [(name, np.float64) for name in (*_PLACED, *(f.name for part in _PARTS for f in fields(part)))]
)
ELASTIC: Final = np.dtype([(name, np.float64) for name in ("forward_m", "left_m", "mass_kg", "base_npm", "base_nspm")])
Records = NDArray[np.void]  # rows of CORNER or ELASTIC; one array passes between compiled functions at little cost


class Chassis(NamedTuple):
    """The data of the equations of motion.

    corners (4,) of CORNER; elastic (k,) of ELASTIC, the loads on a base of their own. inverse_mass (3, 3) and weight
    (3,) belong to heave, pitch and roll of the body with its welded loads; height_moment_kgm is the sum of mass times
    height above the ground of the whole sprung mass.
    """

    corners: Records
    elastic: Records
    inverse_mass: F64
    weight: F64
    height_moment_kgm: float


def chassis_of(vehicle: Vehicle, loads: tuple[Load, ...]) -> Chassis:
    """Assemble the equations. Loads may be anywhere; wheels get their places and preloads."""
    elastic = tuple(load for load in loads if load.is_elastic)
    mass = _mass_matrix(vehicle, loads)
    rigid = _masses_and_levers(vehicle, tuple(load for load in loads if not load.is_elastic))
    weight = sum((-STANDARD_GRAVITY_MPS2 * m * lever for m, lever in rigid), np.zeros(3))
    height_moment = vehicle.sprung_kg * vehicle.cog_height_m + sum(load.mass_kg * load.height_m for load in loads)
    inverse = np.linalg.inv(mass).astype(np.float64)
    return Chassis(_corners(vehicle), _elastic(vehicle, elastic), inverse, weight, height_moment)


def _mass_matrix(vehicle: Vehicle, loads: tuple[Load, ...]) -> F64:
    """(3, 3) for heave, pitch, roll. The body turns about the height of the common centre of gravity.

    An elastic load lends the body its inertia about that height but not its vertical mass.
    """
    heights = [(vehicle.sprung_kg, vehicle.cog_height_m), *((load.mass_kg, load.height_m) for load in loads)]
    common = sum(m * h for m, h in heights) / sum(m for m, _ in heights)
    sway = sum(m * (h - common) ** 2 for m, h in heights)
    mass = np.diag(
        [
            0.0,
            vehicle.pitch_inertia_kgm2 + sway + sum(load.pitch_inertia_kgm2 for load in loads),
            vehicle.roll_inertia_kgm2 + sway + sum(load.roll_inertia_kgm2 for load in loads),
        ]
    )
    for m, lever in _masses_and_levers(vehicle, tuple(load for load in loads if not load.is_elastic)):
        mass += m * np.outer(lever, lever)
    return mass


def _masses_and_levers(vehicle: Vehicle, loads: tuple[Load, ...]) -> list[tuple[float, F64]]:
    """Mass and (1, -forward, left) of the body and of each load."""
    at_reference = (vehicle.sprung_kg, np.array([1.0, 0.0, 0.0]))
    behind = [(load.mass_kg, load.position_m - vehicle.cog_position_m, load.left_m) for load in loads]
    return [at_reference, *((m, np.array([1.0, x, y])) for m, x, y in behind)]


def _corners(vehicle: Vehicle) -> Records:
    share = vehicle.empty_front_share_pct / 100.0
    front = _axle_corners(vehicle.front, vehicle.cog_position_m, vehicle.sprung_kg * share)
    rear = _axle_corners(vehicle.rear, vehicle.cog_position_m - vehicle.wheelbase_m, vehicle.sprung_kg * (1.0 - share))
    return np.concatenate((front, rear))


def _axle_corners(axle: Axle, forward_m: float, carried_kg: float) -> Records:
    """Left and right corner of an axle that carries carried_kg of the empty body."""
    spring, damper, wheel = axle.spring, axle.damper, axle.wheel
    preload_n = STANDARD_GRAVITY_MPS2 * carried_kg / 2.0
    corners = np.zeros(2, CORNER)
    for part in (spring, damper, wheel):
        for field in fields(part):
            corners[field.name] = getattr(part, field.name)
    corners["forward_m"] = forward_m
    corners["left_m"] = axle.track_m / 2.0, -axle.track_m / 2.0
    corners["anti_roll_npm"] = axle.anti_roll_npm
    corners["spring_preload_n"] = preload_n
    corners["tyre_preload_n"] = preload_n + STANDARD_GRAVITY_MPS2 * wheel.unsprung_kg
    return corners


def _elastic(vehicle: Vehicle, loads: tuple[Load, ...]) -> Records:
    elastic = np.zeros(len(loads), ELASTIC)
    for row, load in zip(elastic, loads, strict=True):
        omega = 2.0 * math.pi * load.resonance_hz
        row["forward_m"] = vehicle.cog_position_m - load.position_m
        row["left_m"] = load.left_m
        row["mass_kg"] = load.mass_kg
        row["base_npm"] = load.mass_kg * omega**2
        row["base_nspm"] = 2.0 * load.damping_ratio * load.mass_kg * omega
    return elastic
