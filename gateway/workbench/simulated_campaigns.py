"""The campaigns that can be simulated: roads, speeds and loads of each drive.

Loads and places are the paper's for its van (450 kg rated, 2.8 m wheelbase) and scaled to other vehicles.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np

from gateway.sim.obstacles import ObstacleRoad, UnevenRoad
from gateway.sim.parameters import Load, Vehicle, front_share_pct, load_for_share
from gateway.sim.road import (
    PAPER_CORNER_RADPM,
    PAPER_SIGMA_M,
    PaperRoad,
    RoadRecipe,
    SpectralRoad,
    iso_road,
)
from gateway.sim.scenario import LoadStep
from gateway.sim.speed_profile import Drive, Leg, constant, drive_of, motorway, rural, standstill, urban

PAPER_PAYLOAD_KG: Final = 450.0  # of the paper, section 4
PAPER_WHEELBASE_M: Final = 2.8  # likewise
PAPER_SPEED_MPS: Final = 50.0 / 3.6  # likewise
PAPER_ROUGHNESS_M3: Final = (
    2.0 * PAPER_CORNER_RADPM * PAPER_SIGMA_M**2 / math.pi
)  # (1) at short waves, as C of ISO 8608
ON_PALLETS: Final = {"resonance_hz": 15.0, "damping_ratio": 0.15, "left_m": 0.1}  # not welded, nor in the middle
CHANGE_S: Final = 90.0  # standing still while the load changes: longer than what ends a drive


@dataclass(frozen=True, slots=True)
class Carried:
    """One load on board during part of a drive; times in seconds from the start of the drive."""

    loads: tuple[Load, ...]
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class PlannedDrive:
    """One log to simulate: its route and its loads. ``carried`` covers only the times that are to be judged."""

    name: str
    drive: Drive
    road: RoadRecipe
    carried: tuple[Carried, ...]
    steps: tuple[LoadStep, ...]


@dataclass(frozen=True, slots=True)
class Plan:
    """A campaign to simulate. ``split``, if given, is the split (identification or validation) of every run."""

    drives: tuple[PlannedDrive, ...]
    identification_fraction: float = 0.667
    split: str | None = None

    @property
    def rolls(self) -> bool:
        """Whether any road excites roll; the paper's road has the same profile under both wheels."""
        return not all(isinstance(planned.road, PaperRoad) for planned in self.drives)


def ident(vehicle: Vehicle, rng: np.random.Generator, longest_s: float) -> Plan:
    """The paper's identification: 0 to the rated payload and 40 to 60 % wherever both are feasible, 50 km/h, IRI 4."""
    pairs = [(0.0, None)]
    for mass_kg in np.linspace(0.2, 1.0, 5) * vehicle.rated_payload_kg:
        pairs += [(float(mass_kg), share) for share in np.linspace(-10.0, 10.0, 6) + _middle_share_pct(vehicle)]
    return _paper_grid(vehicle, [_placed(vehicle, mass_kg, share) for mass_kg, share in pairs], rng, longest_s)


def load_sweep(vehicle: Vehicle, rng: np.random.Generator, longest_s: float) -> Plan:
    """The paper's Fig. 3: 0 to the rated payload at the centre of gravity."""
    masses = np.linspace(0.0, 1.0, 10) * vehicle.rated_payload_kg
    loads = [(Load(float(mass_kg), vehicle.cog_position_m),) if mass_kg > 0.0 else () for mass_kg in masses]
    return _paper_grid(vehicle, loads, rng, longest_s)


def share_sweep(vehicle: Vehicle, rng: np.random.Generator, longest_s: float) -> Plan:
    """The paper's Fig. 4: eight ninths of the rated payload moved from 40 to 60 %."""
    mass_kg = 8.0 / 9.0 * vehicle.rated_payload_kg
    loads = [_placed(vehicle, mass_kg, share) for share in np.linspace(-10.0, 10.0, 9) + _middle_share_pct(vehicle)]
    return _paper_grid(vehicle, loads, rng, longest_s)


def load_step(vehicle: Vehicle, rng: np.random.Generator, longest_s: float) -> Plan:
    """The paper's test 1: 50 % always, the payload steps from 0 to 300 kg."""
    mass_kg = 300.0 / PAPER_PAYLOAD_KG * vehicle.rated_payload_kg
    loads: list[tuple[Load, ...]] = [(), (Load(mass_kg, vehicle.cog_position_m),)]
    return _with_changes("test1", loads, min(1800.0, longest_s), rng)


def share_step(vehicle: Vehicle, rng: np.random.Generator, longest_s: float) -> Plan:
    """The paper's test 2: 400 kg, its share steps from 40 to 60 % after 30 minutes."""
    mass_kg = 400.0 / PAPER_PAYLOAD_KG * vehicle.rated_payload_kg
    middle = _middle_share_pct(vehicle)
    loads = [(load_for_share(vehicle, mass_kg, middle + by),) for by in (-10.0, 10.0)]
    return _with_changes("test2", loads, min(1800.0, longest_s), rng)


def random_pairs(vehicle: Vehicle, rng: np.random.Generator, longest_s: float) -> Plan:
    """The paper's test 3: ten random feasible pairs of payload and share, ten minutes each."""
    loads: list[tuple[Load, ...]] = []
    while len(loads) < 10:
        mass_kg = float(rng.uniform(0.0, vehicle.rated_payload_kg))
        placed = _placed(vehicle, mass_kg, _middle_share_pct(vehicle) + float(rng.uniform(-10.0, 10.0)))
        if placed is not None:
            loads.append(placed)
    return _with_changes("test3", loads, min(600.0, longest_s), rng)


def experiment(vehicle: Vehicle, rng: np.random.Generator, longest_s: float) -> Plan:
    """The paper's experiment: ten loads of 0, 120, 270, 420 kg at 0.5, 1.3, 2.8 m, 15 minutes near 50 km/h each."""
    road = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)
    return Plan(
        tuple(
            _steady(vehicle, carried, min(900.0, longest_s), road, rng, jitter_mps=0.4)
            for carried in _experiment_loads(vehicle)
        )
    )


def speeds(vehicle: Vehicle, rng: np.random.Generator, longest_s: float) -> Plan:
    """30 to 110 km/h with nothing, three fifths and nearly all of the rated payload; for validation only."""
    masses = [part / PAPER_PAYLOAD_KG * vehicle.rated_payload_kg for part in (0.0, 270.0, 420.0)]
    middle_m = 0.55 * vehicle.wheelbase_m
    road = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)
    drives = [
        _steady(
            vehicle,
            (Load(mass_kg, middle_m),) if mass_kg else (),
            min(480.0, longest_s),
            road,
            rng,
            speed_mps=kmh / 3.6,
        )
        for kmh in (30.0, 50.0, 70.0, 90.0, 110.0)
        for mass_kg in masses
    ]
    return Plan(tuple(drives), identification_fraction=0.0, split="validation")


def sensitivity(vehicle: Vehicle, rng: np.random.Generator, longest_s: float) -> Plan:
    """Drives with half the rated payload at the centre of gravity, at other speeds and roads than the paper's."""
    loads = (Load(vehicle.rated_payload_kg / 2.0, vehicle.cog_position_m),)
    each_s = min(600.0, longest_s)
    by_speed = [
        _steady(vehicle, loads, each_s, PaperRoad(), rng, speed_mps=kmh / 3.6) for kmh in (30, 40, 50, 60, 70, 90, 130)
    ]
    roads: dict[str, RoadRecipe] = {
        "iri2": PaperRoad(sigma_m=0.5 * PAPER_SIGMA_M),
        "iri8": PaperRoad(sigma_m=2.0 * PAPER_SIGMA_M),
        "waviness1.8": SpectralRoad(PAPER_ROUGHNESS_M3, 1.8),
        "waviness2.2": SpectralRoad(PAPER_ROUGHNESS_M3, 2.2),
    }
    by_road = [_steady(vehicle, loads, each_s, road, rng, label=f"_{name}") for name, road in roads.items()]
    return Plan((*by_speed, *by_road), identification_fraction=0.0, split="validation")


def mixed(vehicle: Vehicle, rng: np.random.Generator, longest_s: float) -> Plan:
    """One drive per load over town, country and motorway, on changing roads with potholes; the load is on pallets."""
    road = ObstacleRoad(UnevenRoad(iso_road("B"), stretch_m=400.0, spread=0.4), potholes_per_km=1.0)
    drives = []
    for welded in _experiment_loads(vehicle):
        carried = tuple(replace(load, **ON_PALLETS) for load in welded)
        kinds: list[Callable[[float, np.random.Generator], Drive]] = [urban, rural, motorway]
        rng.shuffle(kinds)
        third_s = min(1260.0, longest_s) / 3.0
        whole = kinds[0](third_s, rng).then(kinds[1](third_s, rng)).then(kinds[2](third_s, rng))
        drives.append(_whole(_name(vehicle, carried), whole, road, carried))
    return Plan(tuple(drives))


PLANS: Final[Mapping[str, Callable[[Vehicle, np.random.Generator, float], Plan]]] = MappingProxyType(
    {
        "ident": ident,
        "load-sweep": load_sweep,
        "share-sweep": share_sweep,
        "test1": load_step,
        "test2": share_step,
        "test3": random_pairs,
        "experiment": experiment,
        "speeds": speeds,
        "sensitivity": sensitivity,
        "mixed": mixed,
    }
)


def plan_of(kind: str, vehicle: Vehicle, seed: int, longest_s: float = math.inf) -> Plan:
    """The plan of a kind. The seed sets speeds, roads and random loads; each load is driven for at most longest_s.

    Raises KeyError for a kind that is not in PLANS.
    """
    return PLANS[kind](vehicle, np.random.default_rng(seed), longest_s)


def share_range_pct(vehicle: Vehicle) -> tuple[float, float]:
    """The range of shares [%] that (12) normalises by: the plans' middle +- 10 points, 40 to 60 for the paper's van."""
    middle = _middle_share_pct(vehicle)
    return middle - 10.0, middle + 10.0


def _middle_share_pct(vehicle: Vehicle) -> float:
    """The share [%, rounded] with half the rated payload at the middle of the wheelbase."""
    half = (Load(vehicle.rated_payload_kg / 2.0, vehicle.wheelbase_m / 2.0),)
    return round(front_share_pct(vehicle, half))


def _placed(vehicle: Vehicle, mass_kg: float, share_pct: float | None) -> tuple[Load, ...] | None:
    """The load placed so that it gives this share; None if its centre would be outside the axles (not feasible)."""
    if mass_kg == 0.0 or share_pct is None:
        return ()
    try:
        load = load_for_share(vehicle, mass_kg, share_pct)
    except ValueError:
        return None
    return (load,) if 0.0 <= load.position_m <= vehicle.wheelbase_m else None


def _experiment_loads(vehicle: Vehicle) -> list[tuple[Load, ...]]:
    by_mass, by_length = vehicle.rated_payload_kg / PAPER_PAYLOAD_KG, vehicle.wheelbase_m / PAPER_WHEELBASE_M
    loaded = [(Load(m * by_mass, d * by_length),) for m in (120.0, 270.0, 420.0) for d in (0.5, 1.3, 2.8)]
    return [(), *loaded]


def _paper_grid(
    vehicle: Vehicle, loads: Sequence[tuple[Load, ...] | None], rng: np.random.Generator, longest_s: float
) -> Plan:
    """Ten minutes with each feasible load on the paper's road, all for identification."""
    feasible = [placed for placed in loads if placed is not None]
    drives = [_steady(vehicle, placed, min(600.0, longest_s), PaperRoad(), rng) for placed in feasible]
    return Plan(tuple(drives), identification_fraction=1.0)


def _steady(
    vehicle: Vehicle,
    loads: tuple[Load, ...],
    duration_s: float,
    road: RoadRecipe,
    rng: np.random.Generator,
    speed_mps: float = PAPER_SPEED_MPS,
    jitter_mps: float = 0.3,
    label: str = "",
) -> PlannedDrive:
    name = f"{_name(vehicle, loads)}_{speed_mps * 3.6:.0f}kmh{label}"
    return _whole(name, constant(speed_mps, duration_s, rng, jitter_mps), road, loads)


def _whole(name: str, drive: Drive, road: RoadRecipe, loads: tuple[Load, ...]) -> PlannedDrive:
    return PlannedDrive(name, drive, road, (Carried(loads, 0.0, drive.duration_s),), (LoadStep(0.0, loads),))


def _name(vehicle: Vehicle, loads: tuple[Load, ...]) -> str:
    """L270_D47.5"""
    return f"L{sum(load.mass_kg for load in loads):03.0f}_D{front_share_pct(vehicle, loads):.1f}"


def _with_changes(name: str, loads: Sequence[tuple[Load, ...]], each_s: float, rng: np.random.Generator) -> Plan:
    """One drive at 50 km/h on IRI 4 with a stop at each change of load."""
    whole: Drive | None = None
    carried, steps = [], []
    for on_board in loads:
        ride, starts_s, ends_s = _from_rest_to_rest(each_s, rng)
        begin_s = 0.0 if whole is None else whole.duration_s
        carried.append(Carried(on_board, begin_s + starts_s, begin_s + ends_s))
        steps.append(LoadStep(begin_s, on_board))
        whole = ride if whole is None else whole.then(ride)
    if whole is None:
        raise ValueError("a plan needs at least one load")
    drive = PlannedDrive(name, whole, PaperRoad(), tuple(carried), tuple(steps))
    return Plan((drive,), identification_fraction=0.0, split="validation")


def _from_rest_to_rest(duration_s: float, rng: np.random.Generator) -> tuple[Drive, float, float]:
    """Stop, 50 km/h for slightly more than duration_s, stop; also returns when the constant speed begins and ends."""
    ramp = drive_of([Leg(PAPER_SPEED_MPS, duration_s + 5.0), Leg(0.0, 1.0)])
    at_speed_s = CHANGE_S + np.flatnonzero(ramp.speed_mps > 0.999 * PAPER_SPEED_MPS) * ramp.step_s
    wandering = constant(PAPER_SPEED_MPS, ramp.duration_s + 1.0, rng).speed_mps[: len(ramp.speed_mps)]
    scaled = ramp.speed_mps * wandering / PAPER_SPEED_MPS
    whole = standstill(CHANGE_S).then(Drive(scaled, ramp.lateral_mps2, ramp.step_s))
    return whole, float(at_speed_s[0]), float(at_speed_s[-1])
