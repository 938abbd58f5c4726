"""The table of load shapes: how long and how high loads are, by the goods that a vehicle carries.

A long or high load is harder to pitch than a compact one of the same weight at the same place. The half-car sees of its
shape only the squared radius of gyration in pitch, about the front-to-rear line through the body's centre of gravity:

    s = (length^2 + height^2) / 12 + k (height of the load's centre - height of the body's centre)^2,

with k = M / (M + L) the empty vehicle's part of the mass (parallel axis theorem: both turn about their common centre).
A part f of the load that is far from the rest, on the roof or on a tow bar, adds f (1 - f) times the squared distance.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from math import log
from types import MappingProxyType
from typing import Final

import numpy as np

from gateway.core.vehicle import Carries, Vehicle


@dataclass(frozen=True, slots=True)
class LoadExtent:
    """Medians of a load's length and height (m) and the standard deviations of their logarithms.

    ``is_of_floor``: the length is a fraction of the load floor's length.
    """

    length_m: float
    length_scatter: float
    height_m: float
    height_scatter: float
    is_of_floor: bool = False


FLOOR_PER_WHEELBASE: Final = 0.8
"""Load floors of vans are 0.65 (small ones) to 0.93 (large ones) of their wheelbase long, by their makers' figures."""
USUAL_HEIGHT_M: Final = (0.7, 0.4)  # chosen: median and scatter for a load of which only the length is stated
LENGTH_SCATTER: Final = 0.2  # of loads about the stated length; chosen
FLOOR_BELOW_BODY_M: Final = 0.15  # load floor below the body's centre of gravity: 0.6 m against 0.75 m above the road
BODY_MASS_PART: Final = 0.8  # k above at half the payload of a van; it varies from 0.7 to 1
COMPACT_SCATTER: Final = 0.4  # chosen: of log s, for loads like the known ones
SPREAD_PART: Final = 0.5  # chosen: share of undeclared loads that are spread out; the others are like the known loads
ROOF_ABOVE_FLOOR_LOAD_M: Final = 1.1  # roof loads of vans: 1.9 m above the road against 0.8 to 0.9 m
TOW_BAR_BEHIND_AXLE_M: Final = 0.9  # of the rear axle to the coupling; chosen: vans have 0.8 to 1.1 m
TOW_BAR_BEHIND_LOAD_M: Final = 1.7  # the same, and loads lie about 0.8 m ahead of that axle
OUTLYING_PARTS: Final = (0.1, 0.2, 0.3, 0.4)  # chosen: part of a load on the roof rack or tow bar, if there is one
SMOOTHING: Final = 0.15  # chosen: kernel width in log s, about the resolution of the table


CARRIED: Final[Mapping[Carries, LoadExtent]] = MappingProxyType(
    {
        Carries.PALLETS: LoadExtent(1.5, 0.35, 1.1, 0.3),  # one or two, 1.2 m long (ISO 6780), as they are stacked
        Carries.PARCELS: LoadExtent(0.9, 0.25, 1.0, 0.3, is_of_floor=True),
        Carries.LONG_GOODS: LoadExtent(3.0, 0.3, 0.4, 0.5),
        Carries.TOOLS: LoadExtent(0.8, 0.25, 1.1, 0.3, is_of_floor=True),  # racks along the walls
        Carries.MIXED: LoadExtent(0.9, 0.3, 0.9, 0.35, is_of_floor=True),  # and as many compact loads
    }
)
"""Chosen from the dimensions of such goods; `benchmarks.accuracy budget` measures the effect of each row."""

HABIT_PART: Final = 0.5  # chosen: part of the variance of log s that all loads of one vehicle share


@dataclass(frozen=True, slots=True)
class ShapeHypothesis:
    """A kind of load shapes: normally distributed logarithm of s (m2), and the probability of the kind."""

    name: str
    log_s: float
    std: float
    probability: float


def shape_hypotheses(vehicle: Vehicle, known_s_m2: float, known_std: float) -> tuple[ShapeHypothesis, ...]:
    """The kinds of shape that the vehicle's loads may have: compact like known loads, or spread out.

    ``known_s_m2`` is s of the known loads as calibrated, ``known_std`` the standard deviation of its logarithm. If the
    fitter stated what is carried, there is one kind.
    """
    s_m2, weights = np.array(list(_points(vehicle))).T
    logs, weights = np.log(s_m2), weights / weights.sum()
    mean = float(weights @ logs)
    std = float(np.sqrt(weights @ (logs - mean) ** 2 + SMOOTHING**2))
    if is_said(vehicle):
        return (ShapeHypothesis("stated", mean, std, 1.0),)
    compact_std = float(np.hypot(COMPACT_SCATTER, known_std))
    return (
        ShapeHypothesis("compact", log(known_s_m2), compact_std, 1.0 - SPREAD_PART),
        ShapeHypothesis("spread", mean, std, SPREAD_PART),
    )


def known_shape(known_s_m2: float, known_std: float) -> tuple[ShapeHypothesis, ...]:
    """The load has the shape of the known loads."""
    return (ShapeHypothesis("known", log(known_s_m2), known_std, 1.0),)


def is_said(vehicle: Vehicle) -> bool:
    """Whether the fitter stated anything about the shape of loads."""
    return vehicle.payload_length_m is not None or vehicle.carries not in (None, Carries.MIXED)


def _points(vehicle: Vehicle) -> Iterator[tuple[float, float]]:
    """s (m2) with its weight, over the lengths, heights and outlying parts that the vehicle's loads may have."""
    extent = _extent(vehicle)
    normal, weights = np.polynomial.hermite_e.hermegauss(7)
    for (x, wx), (y, wy) in product(zip(normal, weights, strict=True), repeat=2):
        length_m = extent.length_m * np.exp(extent.length_scatter * x)
        height_m = extent.height_m * np.exp(extent.height_scatter * y)
        own = (length_m**2 + height_m**2) / 12.0
        for part, behind_m, above_m, weight in _outlying(vehicle):
            apart = part * (1.0 - part) * (behind_m**2 + above_m**2)
            lifted_m = 0.5 * height_m - FLOOR_BELOW_BODY_M + part * above_m
            yield float(own + apart + BODY_MASS_PART * lifted_m**2), float(wx * wy * weight)


def _extent(vehicle: Vehicle) -> LoadExtent:
    if vehicle.payload_length_m is not None:
        height_m, height_scatter = USUAL_HEIGHT_M
        if vehicle.payload_height_m is not None:
            height_m, height_scatter = vehicle.payload_height_m, LENGTH_SCATTER
        return LoadExtent(vehicle.payload_length_m, LENGTH_SCATTER, height_m, height_scatter)
    extent = CARRIED[Carries(vehicle.carries or Carries.MIXED)]
    floor_m = FLOOR_PER_WHEELBASE * vehicle.wheelbase_m if extent.is_of_floor else 1.0
    height_m = extent.height_m if vehicle.payload_height_m is None else vehicle.payload_height_m
    return LoadExtent(extent.length_m * floor_m, extent.length_scatter, height_m, extent.height_scatter)


def _outlying(vehicle: Vehicle) -> list[tuple[float, float, float, float]]:
    """The part of a load that is away from the rest, its distance behind and above (m), and the weight of each case.
    Half of all loads have such a part if the vehicle has a roof rack or a tow bar.
    """
    places = [(0.0, ROOF_ABOVE_FLOOR_LOAD_M)] * vehicle.roof_rack + [(TOW_BAR_BEHIND_LOAD_M, 0.0)] * vehicle.tow_bar
    if not places:
        return [(0.0, 0.0, 0.0, 1.0)]
    weight = 0.5 / (len(places) * len(OUTLYING_PARTS))
    return [(0.0, 0.0, 0.0, 0.5), *((part, *place, weight) for place in places for part in OUTLYING_PARTS)]
