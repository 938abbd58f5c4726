"""Known-load drives of the half-car of support.half_car_road, as calibration reads them."""

from dataclasses import replace

from gateway.calibration.inspection.facts import InspectedRun, LogFacts
from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.core.vehicle import front_share_pct
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64
from support.half_car_road import CAR, VAN, batch_over_road, taught_by
from support.kept import kept
from support.model_road import times

LOADS = ((0.0, None), (200.0, 0.5), (300.0, 1.4), (400.0, 2.6))  # payload, metres behind the front axle
SIBLING = times(CAR, spring_front_npm=0.97, damper_front_nspm=1.1, spring_rear_npm=1.03, tyre_rear_npm=0.96)


def known_run(
    number: int,
    payload_kg: float,
    position_m: float | None,
    seed: int,
    n_batches: int = 1,
    duration_s: float = 200.0,
    car: F64 = CAR,
) -> StatedDrive:
    """One drive at 14 m/s."""
    share_pct = front_share_pct(VAN, payload_kg, position_m)
    batches = tuple(
        batch_over_road(payload_kg, share_pct, 1000 * seed + 10 * number + i, duration_s, car=car)
        for i in range(n_batches)
    )
    return known_drive(number, f"{number}.log", payload_kg, share_pct, batches)


def split_run(number: int, payload_kg: float, position_m: float | None, seed: int = 1) -> InspectedRun:
    """One batch to identify and one to validate."""
    both = known_run(number, payload_kg, position_m, seed, n_batches=2)
    first, last = both.batches
    return InspectedRun(replace(both, batches=(first,)), (last,), log=LogFacts(sha256="0" * 64))


def campaign(seed: int = 1) -> tuple[InspectedRun, ...]:
    """A drive with each of LOADS, numbered from 1."""
    return tuple(split_run(number, *load, seed=seed) for number, load in enumerate(LOADS, 1))


@kept
def calibrated_on_loads(seed: int) -> VehicleModel:
    """One drive with each of LOADS."""
    return taught_by([known_run(i, *load, seed=seed) for i, load in enumerate(LOADS)])
