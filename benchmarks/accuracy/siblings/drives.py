"""Lines of simulated vans: sisters driven with known loads, and siblings driven empty and put to the test."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from benchmarks.accuracy.coverage_drives import (
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
PLACE_STD_M: Final = 0.02  # where the fitter's hand puts the unit, and how well a tape tells it
TURN_STD_DEG: Final = 1.0
SENSOR_OFF_M: Final = 0.3
MIXED: Final = TRIPS["mixed"]
TESTED: Final = (MIXED, TRIPS["mixed, another day"], TRIPS["another speed"])
SCOPE: Final = Scope(n_known_loads=6)


@dataclass(frozen=True, slots=True)
class Line:
    """A van that all others of its line are scattered about, its sensor unit as usually mounted."""

    van: Vehicle
    sensors: Sensors


@dataclass(frozen=True, slots=True)
class Driven:
    """A van as its fitter states it, with its drives: those that calibrate it, and those that judge it."""

    vehicle: StatedVehicle
    runs: tuple[KnownRun, ...]
    tests: tuple[tuple[Trip, KnownRun], ...] = ()


def draw_line(number: int, rng: np.random.Generator) -> Line:
    """The ``number``-th line: about the types of the simulator in turn."""
    mount = replace(REFERENCE.mount, left_m=float(rng.uniform(-SENSOR_OFF_M, SENSOR_OFF_M)))
    return Line(draw_van(number, rng), replace(REFERENCE, mount=mount))


def sister(line: Line, name: str, seeds: np.random.SeedSequence) -> Driven:
    """A van of the line, driven with known loads."""
    van, sensors, vehicle, rng, road_seeds = _drawn(line, name, seeds)
    loads = known_loads(van, SCOPE.n_known_loads, rng)
    return Driven(vehicle, _runs(van, sensors, [(AS_CALIBRATED, load) for load in loads], road_seeds))


def sibling(line: Line, name: str, seeds: np.random.SeedSequence) -> Driven:
    """A van of the line, driven empty twice, steadily and mixed, and then with loads that nobody told."""
    van, sensors, vehicle, rng, road_seeds = _drawn(line, name, seeds)
    empty_seeds, test_seeds = road_seeds.spawn(2)
    empty = _runs(van, sensors, [(AS_CALIBRATED, ()), (MIXED, ())], empty_seeds)
    tests = _runs(van, sensors, [(trip, unseen_load(van, rng)) for trip in TESTED], test_seeds, first=len(empty) + 1)
    return Driven(vehicle, empty, tuple(zip(TESTED, tests, strict=True)))


def _drawn(
    line: Line, name: str, seeds: np.random.SeedSequence
) -> tuple[Vehicle, Sensors, StatedVehicle, np.random.Generator, np.random.SeedSequence]:
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
    return (
        van,
        replace(line.sensors, mount=mount),
        stated(van, line.sensors),
        np.random.default_rng(load_seed),
        road_seeds,
    )


def _runs(
    van: Vehicle,
    sensors: Sensors,
    asked: list[tuple[Trip, tuple[Load, ...]]],
    seeds: np.random.SeedSequence,
    first: int = 1,
) -> tuple[KnownRun, ...]:
    spawned = seeds.spawn(len(asked))
    return tuple(
        driven(van, load, trip, SCOPE, one, number, sensors)
        for number, ((trip, load), one) in enumerate(zip(asked, spawned, strict=True), first)
    )
