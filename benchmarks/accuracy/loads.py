"""Loads of every length and height: usual goods of vans, drawn at random, by kind.

Calibration drives carry boxes. Other loads have the pitch inertia of their length and height (gateway.sim.parameters: a
homogeneous box), their centre at half their height above the floor, and some have a part on the roof. Lengths are parts
of the wheelbase, like floors.
"""

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from typing import Final

import numpy as np

from gateway.sim.parameters import Load, Vehicle

FLOOR_M: Final = 0.6  # chosen: above the road, of the vans' load floors
ROOF_M: Final = 1.9  # chosen: above the road
ROOF_PARTS: Final = (0.15, 0.35)  # chosen: of the load
FLOOR_PART: Final = 0.85  # chosen: length of the floor, of the wheelbase


class Shape(StrEnum):
    """Kinds of load, by shape."""

    BOX = "box"  # as calibrations know it: a pallet
    PARCELS = "parcels"  # all over the floor, a metre high
    BAY = "bay"  # filled to the roof from end to end
    TALL = "tall"  # one high crate
    LONG = "long"  # boards, a machine
    PIPES = "pipes"  # long and flat, out over the rear
    ROOF = "roof"  # parcels, and some of it on the roof


def box(mass_kg: float, position_m: float, length_m: float, tall_m: float) -> Load:
    """A box on the floor, its centre at half its height."""
    return Load(mass_kg, position_m, height_m=FLOOR_M + 0.5 * tall_m, length_m=length_m, tall_m=tall_m)


def drawn_load(van: Vehicle, mass_kg: float, position_m: float, rng: np.random.Generator) -> tuple[Load, ...]:
    """A load of any shape with its centre at ``position_m``, or as near to it as it fits."""
    shape = list(Shape)[int(rng.integers(len(Shape)))]
    return shaped_load(shape, van, mass_kg, position_m, rng)


def shaped_load(
    shape: Shape, van: Vehicle, mass_kg: float, position_m: float, rng: np.random.Generator
) -> tuple[Load, ...]:
    """A load of this shape; it takes the same numbers from ``rng`` for any shape."""
    one, other = rng.uniform(size=2).tolist()
    floor_m = FLOOR_PART * van.wheelbase_m
    length_m, tall_m = _EXTENTS[shape](one, other, floor_m)
    low_m = 0.5 * length_m + 0.15 * van.wheelbase_m
    high_m = max(low_m, van.wheelbase_m + (1.2 if shape is Shape.PIPES else 0.3) - 0.5 * length_m)
    load = box(mass_kg, float(np.clip(position_m, low_m, high_m)), length_m, tall_m)
    if shape is not Shape.ROOF:
        return (load,)
    part = ROOF_PARTS[0] + (ROOF_PARTS[1] - ROOF_PARTS[0]) * one
    on_roof = replace(load, mass_kg=part * mass_kg, height_m=ROOF_M, length_m=1.5, tall_m=0.3)
    return replace(load, mass_kg=(1.0 - part) * mass_kg), on_roof


_EXTENTS: Final[dict[Shape, Callable[[float, float, float], tuple[float, float]]]] = {
    Shape.BOX: lambda one, other, floor_m: (0.8 + 0.4 * one, 0.5 + 0.5 * other),
    Shape.PARCELS: lambda one, other, floor_m: ((0.7 + 0.3 * one) * floor_m, 0.6 + 0.6 * other),
    Shape.BAY: lambda one, other, floor_m: (floor_m, 1.2 + 0.4 * other),
    Shape.TALL: lambda one, other, floor_m: (0.8 + 0.4 * one, 1.2 + 0.5 * other),
    Shape.LONG: lambda one, other, floor_m: ((0.6 + 0.4 * one) * floor_m, 0.3 + 0.4 * other),
    Shape.PIPES: lambda one, other, floor_m: (2.5 + 1.0 * one, 0.15 + 0.2 * other),
    Shape.ROOF: lambda one, other, floor_m: ((0.5 + 0.4 * one) * floor_m, 0.5 + 0.4 * other),
}
"""Length and height (m) from two numbers between 0 and 1 and the floor's length."""
