"""The loads that a vehicle may carry: those to drive next, and those it will weigh."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.calibrated import RANGE_MARGIN
from gateway.core.vehicle import Load, Vehicle, cg_left_m, front_share_pct
from gateway.core.weights.on_the_road import weights_of
from gateway.estimate import Quantity
from gateway.posterior import exactly

DRIVEN_PARTS: Final = (0.25, 0.5, 0.75, 1.0)  # chosen: of the largest payload
DRIVEN_PLACES: Final = (0.15, 0.35, 0.55, 0.75, 1.0)  # chosen: of the wheelbase, behind the front axle
# chosen: an even grid of loads and places over the vehicle's range
WEIGHED_PARTS: Final = tuple(np.linspace(0.05, 1.0, 6).tolist())
WEIGHED_PLACES: Final = tuple(np.linspace(0.1, 1.0, 7).tolist())
PAYLOAD_STEP_KG: Final = 10.0  # chosen: round numbers for people
POSITION_STEP_M: Final = 0.1  # chosen: round numbers for people
EVEN: Final = 0.5  # chosen: front axle's part of a roll moment, if unknown


@dataclass(frozen=True, slots=True)
class PlacedLoad:
    """A payload with its centre position_m behind the front axle; None for the empty vehicle."""

    payload_kg: float
    position_m: float | None
    front_share_pct: float

    @property
    def load(self) -> Load:
        """The load without its place."""
        return Load(self.payload_kg, self.front_share_pct)


def empty(vehicle: Vehicle) -> PlacedLoad:
    """The empty vehicle."""
    return PlacedLoad(0.0, None, vehicle.empty_front_share_pct)


def drivable_loads(vehicle: Vehicle) -> tuple[PlacedLoad, ...]:
    """The empty vehicle, then loads that a fitter can prepare, in round numbers, within the vehicle's limits."""
    most_kg = vehicle.payload_range_kg[1]
    return _within_limits(
        vehicle,
        (
            (max(_rounded(part * most_kg, PAYLOAD_STEP_KG), PAYLOAD_STEP_KG), _rounded(place, POSITION_STEP_M))
            for part in DRIVEN_PARTS
            for place in np.multiply(DRIVEN_PLACES, vehicle.wheelbase_m).tolist()
        ),
    )


def weighed_loads(vehicle: Vehicle) -> tuple[PlacedLoad, ...]:
    """A grid of the loads that the vehicle will carry: payload_range_kg over the wheelbase, within its limits."""
    most_kg = vehicle.payload_range_kg[1]
    return _within_limits(
        vehicle,
        ((part * most_kg, place * vehicle.wheelbase_m) for part in WEIGHED_PARTS for place in WEIGHED_PLACES),
    )


def share_within_reach(targets: Sequence[PlacedLoad], driven: Sequence[PlacedLoad]) -> float | None:
    """Share (0..1) of ``targets`` within the loads and shares of ``driven``, plus the margin of ``out_of_range``.

    A calibration answers ``out_of_range`` beyond it. None if ``driven`` has no span and so sets no limit.
    """
    payloads_kg = [load.payload_kg for load in driven]
    shares_pct = [load.front_share_pct for load in driven]
    if not min(payloads_kg) < max(payloads_kg) or not min(shares_pct) < max(shares_pct):
        return None
    inside = [
        _is_near(target.payload_kg, payloads_kg) and _is_near(target.front_share_pct, shares_pct) for target in targets
    ]
    return float(np.mean(inside))


def _is_near(x: float, seen: Sequence[float]) -> bool:
    margin = RANGE_MARGIN * (max(seen) - min(seen))
    return min(seen) - margin <= x <= max(seen) + margin


def _within_limits(vehicle: Vehicle, loads: Iterable[tuple[float, float]]) -> tuple[PlacedLoad, ...]:
    placed = (PlacedLoad(kg, m, front_share_pct(vehicle, kg, m)) for kg, m in dict.fromkeys(loads))
    return (empty(vehicle), *(load for load in placed if is_allowed(vehicle, load)))


def is_allowed(vehicle: Vehicle, load: PlacedLoad, payload_left_m: float | None = None) -> bool:
    """Whether the load is within the limits, those of single wheels too if its lateral place is given; unknown weights
    are not checked.
    """
    place = () if payload_left_m is None else (cg_left_m(vehicle, load.payload_kg, payload_left_m),)
    weights = weights_of(vehicle, exactly(load.payload_kg, load.front_share_pct, *place), Quantity(EVEN, 0.0))
    return not any(weight.is_over_limit for _, weight in weights.items())


def _rounded(x: float, step: float) -> float:
    return round(round(x / step) * step, 6)
