"""Known-load drives of the half-car of support.half_car_road, as calibration reads them."""

from dataclasses import replace

from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.inspection.log import LogFacts, SplitRun
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.half_car import HalfCar
from gateway.core.vehicle import front_share_pct
from support.half_car_road import CAR, VAN, batch_over_road
from support.kept import kept

LOADS = ((0.0, None), (200.0, 0.5), (300.0, 1.4), (400.0, 2.6))  # payload, metres behind the front axle
SIBLING = replace(
    CAR,
    front=replace(CAR.front, spring_npm=0.97 * CAR.front.spring_npm, damper_nspm=1.1 * CAR.front.damper_nspm),
    rear=replace(CAR.rear, spring_npm=1.03 * CAR.rear.spring_npm, tyre_npm=0.96 * CAR.rear.tyre_npm),
)


def known_run(
    number: int,
    payload_kg: float,
    position_m: float | None,
    seed: int,
    n_batches: int = 1,
    duration_s: float = 200.0,
    car: HalfCar = CAR,
) -> KnownRun:
    """One drive at 14 m/s."""
    share_pct = front_share_pct(VAN, payload_kg, position_m)
    batches = tuple(
        batch_over_road(payload_kg, share_pct, 1000 * seed + 10 * number + i, duration_s, car=car)
        for i in range(n_batches)
    )
    return KnownRun(number, f"{number}.log", payload_kg, share_pct, batches)


def split_run(number: int, payload_kg: float, position_m: float | None, seed: int = 1) -> SplitRun:
    """One batch to identify and one to validate."""
    both = known_run(number, payload_kg, position_m, seed, n_batches=2)
    identification, validation = (
        KnownRun(number, both.name, both.payload_kg, both.front_share_pct, (batch,)) for batch in both.batches
    )
    return SplitRun(identification, validation, log=LogFacts(sha256="0" * 64))


def campaign(seed: int = 1) -> tuple[SplitRun, ...]:
    """A drive with each of LOADS, numbered from 1."""
    return tuple(split_run(number, *load, seed=seed) for number, load in enumerate(LOADS, 1))


@kept
def calibrated_on_loads(seed: int, car: HalfCar = CAR) -> CrossSpectrumCalibration:
    """One drive with each of LOADS."""
    return calibrate_cross_spectrum([known_run(i, *load, seed=seed, car=car) for i, load in enumerate(LOADS)], VAN)
