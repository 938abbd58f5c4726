"""Which load to put to one side, where a roll rate is mapped and no run has shown what such a load does."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from gateway.calibration.known_run import KnownRun
from gateway.calibration.plan.loads import PlacedLoad, drivable_loads
from gateway.core.vehicle import Vehicle, cg_left_m
from gateway.core.weights import weights_of
from gateway.estimate import Quantity
from gateway.posterior import exactly

LEAST_CG_LEFT_M: Final = 0.03  # of the sprung mass: what a load somewhere near the middle may do by chance
TRACK_PART: Final = 0.25  # of the track width: as far to one side as a heavy load mostly goes between wheel arches
USUAL_TRACK_M: Final = 1.5
PLACE_STEP_M: Final = 0.05
EVEN: Final = 0.5  # part of a sideways moment that the front axle takes, where nobody knows it


@dataclass(frozen=True, slots=True)
class SidewaysLoad:
    """A load with its centre payload_left_m left of the centre line."""

    load: PlacedLoad
    payload_left_m: float


def sideways_load(runs: Sequence[KnownRun], vehicle: Vehicle) -> SidewaysLoad | None:
    """The heaviest load that may be driven well to one side, near the middle lengthwise.

    None without a roll rate, where a run has carried such a load, or where limits allow none.
    """
    if all(batch.roll_rate_radps is None for run in runs for batch in run.batches) or _has_sideways(runs, vehicle):
        return None
    left_m = round(round(TRACK_PART * (vehicle.track_width_m or USUAL_TRACK_M) / PLACE_STEP_M) * PLACE_STEP_M, 6)
    placed = [SidewaysLoad(load, left_m) for load in drivable_loads(vehicle) if load.payload_kg > 0.0]
    allowed = [one for one in placed if _is_allowed(vehicle, one)]
    middle_pct = vehicle.empty_front_share_pct
    return max(
        allowed, key=lambda one: (one.load.payload_kg, -abs(one.load.front_share_pct - middle_pct)), default=None
    )


def _has_sideways(runs: Sequence[KnownRun], vehicle: Vehicle) -> bool:
    noted_m = [cg_left_m(vehicle, run.payload_kg, run.payload_left_m) for run in runs if run.payload_left_m is not None]
    return any(abs(left_m - vehicle.empty_cg_left_m) >= LEAST_CG_LEFT_M for left_m in noted_m)


def _is_allowed(vehicle: Vehicle, placed: SidewaysLoad) -> bool:
    """Limits of single wheels; those of axles and gross weight hold already."""
    at_m = cg_left_m(vehicle, placed.load.payload_kg, placed.payload_left_m)
    load = exactly(placed.load.payload_kg, placed.load.front_share_pct, at_m)
    weights = weights_of(vehicle, load, Quantity(EVEN, 0.0))
    return not any(weight.is_over_limit for _, weight in weights.items())
