"""Lines of simulated vans: sisters driven with known loads, and siblings driven empty and then tested."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from benchmarks.accuracy.drives import (
    AS_CALIBRATED,
    TRIPS,
    Scope,
    Trip,
    draw_van,
    driven,
    known_loads,
    stated,
    unseen_load,
)
from benchmarks.accuracy.scatter import Scatter, scattered
from gateway.calibration.known_run import KnownRun
from gateway.core.vehicle import Vehicle as StatedVehicle
from gateway.sim.sensors import REFERENCE, Sensors
from gateway.sim.vehicle import Load, Vehicle

OF_A_LINE: Final = Scatter(
    spring=0.03, progression=0.1, damper=0.10, friction=0.3, tyre=0.04, unsprung=0.03,
    sprung=0.015, cog_position=0.015, inertia=0.015,
)  # fmt: skip
PLACE_STD_M: Final = 0.02  # chosen: mounting and tape measure
TURN_STD_DEG: Final = 1.0  # chosen: of the mounting
SENSOR_OFF_M: Final = 0.3  # chosen: at most, from the centre line
MIXED: Final = TRIPS["mixed"]
TESTED: Final = (MIXED, TRIPS["mixed, another day"], TRIPS["another speed"])
SCOPE: Final = Scope(n_known_loads=6)


@dataclass(frozen=True, slots=True)
class Line:
    """A van about which all others of its line are scattered, and its usual sensor unit."""

    van: Vehicle
    sensors: Sensors


@dataclass(frozen=True, slots=True)
class Driven:
    """A van as its fitter states it, with its calibration and test drives."""

    vehicle: StatedVehicle
    runs: tuple[KnownRun, ...]
    tests: tuple[tuple[Trip, KnownRun], ...] = ()


def draw_line(number: int, rng: np.random.Generator) -> Line:
    """The ``number``-th line, about the simulator's types in turn."""
    mount = replace(REFERENCE.mount, left_m=float(rng.uniform(-SENSOR_OFF_M, SENSOR_OFF_M)))
    return Line(draw_van(number, rng), replace(REFERENCE, mount=mount))


@dataclass(frozen=True, slots=True)
class Drawn:
    """A van of a line with its sensors, its fitter's statements, and the generators of its loads and roads."""

    van: Vehicle
    sensors: Sensors
    vehicle: StatedVehicle
    rng: np.random.Generator
    road_seeds: np.random.SeedSequence


def drawn_van(line: Line, name: str, seeds: np.random.SeedSequence) -> Drawn:
    """A van scattered about the line, its unit mounted near the stated place."""
    van_seed, load_seed, road_seeds = seeds.spawn(3)
    rng = np.random.default_rng(van_seed)
    van = replace(scattered(line.van, OF_A_LINE, rng), name=name)
    usual = line.sensors.mount
    ahead_m, left_m = (PLACE_STD_M * rng.standard_normal(2)).tolist()
    roll_deg, pitch_deg, yaw_deg = (TURN_STD_DEG * rng.standard_normal(3)).tolist()
    mount = replace(
        usual,
        position_m=usual.position_m - ahead_m,
        left_m=usual.left_m + left_m,
        roll_deg=usual.roll_deg + roll_deg,
        pitch_deg=usual.pitch_deg + pitch_deg,
        yaw_deg=usual.yaw_deg + yaw_deg,
    )
    sensors = replace(line.sensors, mount=mount)
    return Drawn(van, sensors, stated(van, line.sensors), np.random.default_rng(load_seed), road_seeds)


def sister(line: Line, name: str, seeds: np.random.SeedSequence) -> Driven:
    """A van of the line, driven with known loads."""
    drawn = drawn_van(line, name, seeds)
    loads = known_loads(drawn.van, SCOPE.n_known_loads, drawn.rng)
    return Driven(drawn.vehicle, _runs(drawn, [(AS_CALIBRATED, load) for load in loads], drawn.road_seeds))


def sibling(line: Line, name: str, seeds: np.random.SeedSequence) -> Driven:
    """A van of the line, driven empty twice, steadily and mixed, and then with unknown loads."""
    drawn = drawn_van(line, name, seeds)
    empty_seeds, test_seeds = drawn.road_seeds.spawn(2)
    empty = _runs(drawn, [(AS_CALIBRATED, ()), (MIXED, ())], empty_seeds)
    asked = [(trip, unseen_load(drawn.van, drawn.rng)) for trip in TESTED]
    tests = _runs(drawn, asked, test_seeds, first=len(empty) + 1)
    return Driven(drawn.vehicle, empty, tuple(zip(TESTED, tests, strict=True)))


def _runs(
    drawn: Drawn,
    asked: list[tuple[Trip, tuple[Load, ...]]],
    seeds: np.random.SeedSequence,
    first: int = 1,
) -> tuple[KnownRun, ...]:
    spawned = seeds.spawn(len(asked))
    return tuple(
        driven(drawn.van, load, trip, SCOPE, one, number, drawn.sensors)
        for number, ((trip, load), one) in enumerate(zip(asked, spawned, strict=True), first)
    )
