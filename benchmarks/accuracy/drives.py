"""The vans of the studies, which no setting was chosen with, their calibration drives and their test drives."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Final

import numpy as np

from benchmarks.accuracy.loads import drawn_load
from benchmarks.accuracy.scatter import FROM_DAY_TO_DAY, OF_TYPES, scattered
from gateway.bus.signals import SHIPPED_PREFIX, Decoder, SignalMap, load_signal_map
from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.core.batch_settings import BatchSettings
from gateway.core.vehicle import MEASURED_OFFSET_STD_M
from gateway.core.vehicle import Vehicle as StatedVehicle
from gateway.offline.campaigns import batches_of_motion
from gateway.records import Motion
from gateway.sim.instruments import REFERENCE, Sensors
from gateway.sim.obstacles import ObstacleRoad, UnevenRoad
from gateway.sim.parameters import Load, Vehicle, front_share_pct, payload_kg, payload_left_m
from gateway.sim.road import RoadRecipe, iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.speed_profile import Drive, constant, motorway, rural, urban
from gateway.sim.vans import VANS
from gateway.workbench.simulated_campaigns import ON_PALLETS, PAPER_SPEED_MPS, share_range_pct
from gateway.workbench.wiring import Wiring

MAP_NAME: Final = "reference"
CALIBRATED_PARTS: Final = (0.25, 0.6, 0.95)  # chosen: of the rated payload
CALIBRATED_PLACES: Final = (0.2, 0.5, 1.0)  # chosen: of the wheelbase
EMPTY_SHARE: Final = 0.15  # chosen: of the test drives
OTHER_SPEEDS_KMH: Final = (30.0, 110.0)  # chosen: town to motorway
SENSOR_OFF_M: Final = 0.4  # chosen: at most, on either side of the centre line
NEAR_M: Final = (0.0, 0.1)  # chosen: from the centre line, of a load placed in the middle
SIDEWAYS_M: Final = (0.15, 0.35)  # chosen: from the centre line, of a load placed off it


@dataclass(frozen=True, slots=True)
class Scope:
    """The amount of driving: known loads per van, and test drives of each kind."""

    n_known_loads: int = 6
    n_tests: int = 2
    steady_s: float = 620.0
    mixed_s: float = 1260.0


USUAL: Final = Scope()


@dataclass(frozen=True, slots=True)
class Trip:
    """A kind of drive: its name, how and where it is driven, and changes since calibration.

    Loads are off_m (least, most) from the centre line, on either side.
    """

    kind: str
    drive: Callable[[Scope, np.random.Generator], Drive]
    road: RoadRecipe
    is_changed: bool = False
    is_on_pallets: bool = False
    off_m: tuple[float, float] = NEAR_M


def draw_van(number: int, rng: np.random.Generator) -> Vehicle:
    """The ``number``-th van: of the types in turn, with scattered masses, springs, dampers, tyres and places."""
    kinds = list(VANS.values())
    van = scattered(kinds[number % len(kinds)], OF_TYPES, rng)
    return replace(van, name=f"{van.name}_{number}")


def draw_sensors(rng: np.random.Generator) -> Sensors:
    """The reference unit at a random distance from the centre line."""
    left_m = float(rng.uniform(-SENSOR_OFF_M, SENSOR_OFF_M))
    return replace(REFERENCE, mount=replace(REFERENCE.mount, left_m=left_m))


def stated(van: Vehicle, sensors: Sensors = REFERENCE) -> StatedVehicle:
    """The vehicle as a fitter states it in the campaign file: weights and places, but no springs."""
    return StatedVehicle(
        name=van.name,
        empty_mass_kg=van.sprung_kg,
        wheelbase_m=van.wheelbase_m,
        empty_front_share_pct=van.empty_front_share_pct,
        sensor_position_m=sensors.mount.position_m,
        sensor_offset_left_m=sensors.mount.left_m,
        sensor_offset_left_std_m=MEASURED_OFFSET_STD_M,
        track_width_m=(van.front.track_m + van.rear.track_m) / 2.0,
        payload_range_kg=(0.0, van.rated_payload_kg),
        front_share_range_pct=share_range_pct(van),
    )


def known_loads(van: Vehicle, n_loads: int, rng: np.random.Generator) -> list[tuple[Load, ...]]:
    """Empty, and loads drawn from a grid of three masses at three places."""
    grid = [(part, place) for part in CALIBRATED_PARTS for place in CALIBRATED_PLACES]
    drawn = rng.choice(len(grid), min(n_loads - 1, len(grid)), replace=False)
    return [(), *((_load(van, *grid[i]),) for i in sorted(drawn.tolist()))]


def unseen_load(van: Vehicle, rng: np.random.Generator) -> tuple[Load, ...]:
    """A load of any shape at any place from the driver's back to the rear axle; sometimes none."""
    if rng.random() < EMPTY_SHARE:
        return ()
    mass_kg, position_m = float(rng.uniform(0.05, 1.0)) * van.rated_payload_kg, float(rng.uniform(0.15, 1.0))
    return drawn_load(van, mass_kg, position_m * van.wheelbase_m, rng)


def driven(
    van: Vehicle,
    loads: tuple[Load, ...],
    trip: Trip,
    scope: Scope,
    seeds: np.random.SeedSequence,
    number: int,
    sensors: Sensors = REFERENCE,
) -> StatedDrive:
    """One drive through sensors, frames and decoder, as batches with their truth."""
    rows, today, carried = rows_of(van, loads, trip, scope, seeds, sensors)
    return known_run(rows, number, trip.kind, today, carried)


def rows_of(
    van: Vehicle,
    loads: tuple[Load, ...],
    trip: Trip,
    scope: Scope,
    seeds: np.random.SeedSequence,
    sensors: Sensors = REFERENCE,
) -> tuple[Motion, Vehicle, tuple[Load, ...]]:
    """One drive through sensors, frames and decoder; with the vehicle of that day and its loads.

    The same seeds give the same road and drive with any sensors.
    """
    plan_seed, day_seed, side_seed = np.random.SeedSequence(seeds.entropy, spawn_key=seeds.spawn_key).spawn(3)
    plan_rng, day_rng = np.random.default_rng(plan_seed), np.random.default_rng(day_seed)
    today = scattered(van, FROM_DAY_TO_DAY, day_rng) if trip.is_changed else van
    carried = tuple(replace(load, **ON_PALLETS) for load in loads) if trip.is_on_pallets else loads
    carried = beside(carried, trip.off_m, np.random.default_rng(side_seed))
    seed = int(seeds.generate_state(1)[0])
    simulated = simulate_drive(today, carried, trip.road, trip.drive(scope, plan_rng), sensors, seed)
    return Decoder(_map()).decode(Wiring(MAP_NAME).frames_of(simulated.recording)), today, carried


def beside(loads: tuple[Load, ...], off_m: tuple[float, float], rng: np.random.Generator) -> tuple[Load, ...]:
    """The same loads, all on one side of the centre line, off_m (least, most) from it."""
    left_m = float(rng.uniform(*off_m)) * float(rng.choice([-1.0, 1.0]))
    return tuple(replace(load, left_m=left_m) for load in loads)


def without_roll_rate(run: StatedDrive) -> StatedDrive:
    """The same run through a signal map without a roll rate: no other number of a batch changes."""
    return replace(run, batches=tuple(replace(batch, roll_rate_radps=None) for batch in run.batches))


def known_run(rows: Motion, number: int, name: str, van: Vehicle, carried: tuple[Load, ...]) -> StatedDrive:
    """Decoded rows as batches with their truth."""
    batches = batches_of_motion(rows, _map(), BatchSettings())
    return known_drive(
        number, name, payload_kg(carried), front_share_pct(van, carried), batches, payload_left_m(carried)
    )


@lru_cache(maxsize=1)
def _map() -> SignalMap:
    return load_signal_map(SHIPPED_PREFIX + MAP_NAME)


def _load(van: Vehicle, part: float, place: float) -> Load:
    return Load(part * van.rated_payload_kg, place * van.wheelbase_m)


def _as_calibrated(scope: Scope, rng: np.random.Generator) -> Drive:
    return constant(PAPER_SPEED_MPS, scope.steady_s, rng, jitter_std_mps=0.4)


def _at_another_speed(scope: Scope, rng: np.random.Generator) -> Drive:
    return constant(float(rng.uniform(*OTHER_SPEEDS_KMH)) / 3.6, scope.steady_s, rng, jitter_std_mps=0.4)


def _mixed(scope: Scope, rng: np.random.Generator) -> Drive:
    """Town, country and motorway in any order."""
    kinds: list[Callable[[float, np.random.Generator], Drive]] = [urban, rural, motorway]
    rng.shuffle(kinds)
    first, second, third = (kind(scope.mixed_s / 3.0, rng) for kind in kinds)
    return first.then(second).then(third)


_SMOOTH_AND_ROUGH: Final = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)
_CHANGING: Final = ObstacleRoad(UnevenRoad(iso_road("B"), stretch_m=400.0, spread=0.4), potholes_per_km=1.0)

AS_CALIBRATED: Final = Trip("as calibrated", _as_calibrated, _SMOOTH_AND_ROUGH)
TRIPS: Final[Mapping[str, Trip]] = MappingProxyType(
    {
        trip.kind: trip
        for trip in (
            AS_CALIBRATED,
            Trip("another speed", _at_another_speed, _SMOOTH_AND_ROUGH),
            Trip("mixed", _mixed, _CHANGING),
            Trip("mixed, another day", _mixed, _CHANGING, is_changed=True),
            Trip("mixed, on pallets", _mixed, _CHANGING, is_on_pallets=True),
            Trip("as calibrated, load sideways", _as_calibrated, _SMOOTH_AND_ROUGH, off_m=SIDEWAYS_M),
            Trip("mixed, load sideways", _mixed, _CHANGING, off_m=SIDEWAYS_M),
        )
    }
)


@dataclass(frozen=True, slots=True)
class FreshVan:
    """A van and its sensors, simulated and as a fitter states them, its known drives, and the generators of its
    tests.
    """

    van: Vehicle
    sensors: Sensors
    vehicle: StatedVehicle
    runs: list[StatedDrive]
    rng: np.random.Generator
    test_seed: np.random.SeedSequence


def fresh_van(
    scope: Scope, seed: int, number: int, sensors_of: Callable[[Sensors], Sensors] = lambda mounted: mounted
) -> FreshVan:
    """The ``number``-th van of a study with this seed, independent of the others.

    ``sensors_of`` replaces the reference unit at its mount: van, loads, roads and drives stay the same.
    """
    van_seed, load_seed, known_seed, test_seed, sensor_seed = np.random.SeedSequence([seed, number]).spawn(5)
    van, rng = draw_van(number, np.random.default_rng(van_seed)), np.random.default_rng(load_seed)
    sensors = sensors_of(draw_sensors(np.random.default_rng(sensor_seed)))
    loads = known_loads(van, scope.n_known_loads, rng)
    runs = [
        driven(van, carried, AS_CALIBRATED, scope, one, i, sensors)
        for i, (carried, one) in enumerate(zip(loads, known_seed.spawn(len(loads)), strict=True), 1)
    ]
    return FreshVan(van, sensors, stated(van, sensors), runs, rng, test_seed)
