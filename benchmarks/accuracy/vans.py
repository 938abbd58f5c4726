"""Fresh simulated vans, each with its calibration drives."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.coverage_drives import (
    AS_CALIBRATED,
    Scope,
    draw_sensors,
    draw_van,
    driven,
    known_loads,
    stated,
)
from gateway.calibration.known_run import KnownRun
from gateway.core.vehicle import Vehicle as StatedVehicle
from gateway.sim.sensors import Sensors
from gateway.sim.vehicle import Vehicle


@dataclass(frozen=True, slots=True)
class FreshVan:
    """A van and its sensors, simulated and as a fitter states them, its known drives, and the generators of its
    tests.
    """

    van: Vehicle
    sensors: Sensors
    vehicle: StatedVehicle
    runs: list[KnownRun]
    rng: np.random.Generator
    test_seed: np.random.SeedSequence


def van_of(seed: int, number: int) -> Vehicle:
    """The ``number``-th van of a study with this seed, without its drives."""
    van_seed, *_ = np.random.SeedSequence([seed, number]).spawn(5)
    return draw_van(number, np.random.default_rng(van_seed))


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
