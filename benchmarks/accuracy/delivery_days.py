"""Delivery days of simulated vans: the loads at each of eight stops, and the estimates of the gateway.

A van of the coverage study is calibrated on six known loads, and differs a little on its delivery day (worn, warm,
other tyres). It leaves empty and is loaded at the first stop; then parcels are delivered, one is picked up, and at two
stops nothing happens. Legs last a little over one window, some over two; the bus sleeps while the van stands.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.calibrated import calibrated_on
from benchmarks.accuracy.drives import MAP_NAME, Scope, fresh_van
from benchmarks.accuracy.loads import box
from benchmarks.accuracy.scatter import FROM_DAY_TO_DAY, scattered
from gateway.bus.signals import SHIPPED_PREFIX, Decoder, load_signal_map
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.flow import Flow, Identity
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Carries
from gateway.estimate_json import estimate_to_json
from gateway.sim.drive import Drive, rural, urban
from gateway.sim.obstacles import ObstacleRoad, UnevenRoad
from gateway.sim.road import iso_road
from gateway.sim.scenario import START_NS, simulate_drive
from gateway.sim.vehicle import Load, Vehicle, front_share_pct, payload_kg
from gateway.units import NS_PER_S
from gateway.workbench.wiring import Wiring

ESTIMATOR: Final = "cross_spectrum"
N_STOPS: Final = 8  # chosen
IDLE_STOPS: Final = (3, 6)  # chosen, from 0: a break, and nobody at home
PICK_UP_STOP: Final = 5  # chosen, from 0
LONG_LEGS: Final = (1, 4, 7)  # chosen, from 0
LEG_S: Final = (345.0, 655.0)  # chosen: short and long, one window and two
URBAN_LONGER: Final = 1.35  # chosen: stop and go has less usable driving
STOP_S: Final = 600.0  # chosen
ROAD: Final = ObstacleRoad(UnevenRoad(iso_road("B"), stretch_m=400.0, spread=0.4), potholes_per_km=1.0)
PARCEL_PARTS: Final = (0.08, 0.22)  # chosen: of the rated payload
N_PARCELS: Final = 6  # chosen
FLOOR_PARTS: Final = (0.25, 1.0)  # chosen: of the wheelbase, places of parcels
PARCEL_EXTENT_M: Final = ((0.3, 1.1), (0.2, 0.9))  # chosen: lengths and heights of single parcels


class Said(StrEnum):
    """The campaign's statement of the loads' shape."""

    NOTHING = "nothing"
    CARRIES = "carries"  # parcels


@dataclass(frozen=True, slots=True)
class Day:
    """The payload (kg) and front share (%) of each leg, and the JSON objects of all estimates of that day, by the
    campaign's statement.
    """

    van: str
    rated_kg: float
    payload_kg: tuple[float, ...]
    front_share_pct: tuple[float, ...]
    distance_m: tuple[float, ...]
    leg_start_ns: tuple[int, ...]
    records: dict[str, list[dict[str, Any]]]


def day_of(seed: int, number: int) -> Day:
    """The ``number``-th day of a study with this seed, independent of the others."""
    fresh = fresh_van(Scope(), seed, number)
    calibrated = calibrated_on(fresh.runs, fresh.vehicle, ESTIMATOR)
    plan_seed, day_seed, *leg_seeds = np.random.SeedSequence([seed, number, 1]).spawn(3 + N_STOPS)
    today = scattered(fresh.van, FROM_DAY_TO_DAY, np.random.default_rng(day_seed))
    carried = loads_of_legs(today, np.random.default_rng(plan_seed))
    signal_map = load_signal_map(SHIPPED_PREFIX + MAP_NAME)
    identity = Identity(vehicle_id=f"van-{number}")
    flows = {
        said: Flow(BatchSettings(), signal_map.traits, _with(said, calibrated), ESTIMATOR, identity) for said in Said
    }
    records: dict[str, list[dict[str, Any]]] = {said: [] for said in Said}
    start_ns, starts_ns, distances_m = START_NS + 6 * 3600 * NS_PER_S, [], []
    for i, (loads, leg_seed) in enumerate(zip(carried, leg_seeds, strict=True)):
        drive = _leg(i, np.random.default_rng(leg_seed))
        simulated = simulate_drive(
            today, loads, ROAD, drive, fresh.sensors, int(leg_seed.generate_state(1)[0]), start_ns
        )
        motion = Decoder(signal_map).decode(Wiring(MAP_NAME).frames_of(simulated.recording))
        for said, flow in flows.items():
            found = (*flow.feed(motion), *flow.flush())
            records[said] += [{**estimate_to_json(estimate), "spectra": None} for estimate in found]
        starts_ns.append(start_ns)
        distances_m.append(float(drive.travelled_m[-1]))
        start_ns += round((drive.duration_s + STOP_S) * NS_PER_S)
    return Day(
        van=fresh.van.name,
        rated_kg=fresh.van.rated_payload_kg,
        payload_kg=tuple(map(payload_kg, carried)),
        front_share_pct=tuple(front_share_pct(today, loads) for loads in carried),
        distance_m=tuple(distances_m),
        leg_start_ns=tuple(starts_ns),
        records=records,
    )


def _with(said: Said, calibrated: CalibratedVehicle) -> CalibratedVehicle:
    """The calibration with this statement; known loads are weighed with their own shape either way."""
    if said is Said.NOTHING:
        return calibrated
    return replace(calibrated, vehicle=replace(calibrated.vehicle, carries=Carries.PARCELS))


def loads_of_legs(van: Vehicle, rng: np.random.Generator) -> list[tuple[Load, ...]]:
    """The loads on board on each of the nine legs."""
    parcels = [_parcel(van, rng) for _ in range(N_PARCELS)]
    aboard: list[Load] = []
    legs: list[tuple[Load, ...]] = [()]
    for stop in range(N_STOPS):
        if stop == 0:
            aboard = parcels[:-1]
        elif stop == PICK_UP_STOP:
            aboard = [*aboard, parcels[-1]]
        elif stop not in IDLE_STOPS:
            aboard = aboard[1:]
        legs.append(tuple(aboard))
    return legs


def _parcel(van: Vehicle, rng: np.random.Generator) -> Load:
    mass_kg = float(rng.uniform(*PARCEL_PARTS)) * van.rated_payload_kg
    place_m = float(rng.uniform(*FLOOR_PARTS)) * van.wheelbase_m
    left_m = float(rng.uniform(-0.2, 0.2))
    length_m, tall_m = (float(rng.uniform(*each)) for each in PARCEL_EXTENT_M)
    return replace(box(mass_kg, place_m, length_m, tall_m), left_m=left_m)


def _leg(number: int, rng: np.random.Generator) -> Drive:
    """Town and country in turn, from rest to rest."""
    is_urban = number % 3 == 2
    kind = urban if is_urban else rural
    return kind(LEG_S[number in LONG_LEGS] * (URBAN_LONGER if is_urban else 1.0), rng)
