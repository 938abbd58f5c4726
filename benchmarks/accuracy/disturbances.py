"""What disturbed sensors and stamps do to a calibrated van: every disturbance on the same fresh drives.

    disturbances(Scope(), seed) -> CoverageTable

The vans serve this study alone. A drive as calibrated and a mixed one carry loads within what was calibrated; the
last line carries half as much again as the van may.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Final

import numpy as np

from benchmarks.accuracy.coverage_drives import (
    AS_CALIBRATED,
    TRIPS,
    Scope,
    draw_van,
    driven,
    known_loads,
    known_run,
    rows_of,
    stated,
)
from benchmarks.accuracy.coverage_table import CoverageTable, JudgedBatch, coverage_table, judged_batches
from benchmarks.accuracy.disturbed import DISTURBANCES, Disturbance
from gateway.calibration.judgement import judge
from gateway.calibration.judgement.learning_curve import calibrated_on
from gateway.records import Motion
from gateway.sim.sensors import REFERENCE, Sensors
from gateway.sim.vehicle import Load, Vehicle

ESTIMATOR: Final = "cross_spectrum"
SEED: Final = 20_270
WITHIN_PARTS: Final = (0.3, 0.9)  # of the rated payload
WITHIN_PLACES: Final = (0.3, 0.9)  # of the wheelbase
OVERLOAD: Final = 1.5  # times the rated payload
OnVan = Callable[[int, int], None]


def disturbances(
    scope: Scope, seed: int = SEED, *, workers: int = 1, on_van: OnVan = lambda done, of: None
) -> CoverageTable:
    """Calibrate every van, drive it, disturb what was recorded, and judge; a line for every disturbance."""
    batches: list[JudgedBatch] = []
    on_van(0, scope.n_vans)
    for done, of_van in enumerate(_vans(scope, seed, workers), 1):
        batches += of_van
        on_van(done, scope.n_vans)
    return coverage_table(batches, seed)


def of_one_van(scope: Scope, seed: int, number: int) -> list[JudgedBatch]:
    """One van's batches under every disturbance."""
    van_seed, load_seed, known_seed, test_seed = np.random.SeedSequence([seed, number]).spawn(4)
    van, rng = draw_van(number, np.random.default_rng(van_seed)), np.random.default_rng(load_seed)
    vehicle = stated(van)
    loads = known_loads(van, scope.n_known_loads, rng)
    runs = [
        driven(van, carried, AS_CALIBRATED, scope, one, i)
        for i, (carried, one) in enumerate(zip(loads, known_seed.spawn(len(loads)), strict=True), 1)
    ]
    calibrated = calibrated_on(runs, vehicle, ESTIMATOR)
    batches: list[JudgedBatch] = []
    for trip, seeds in zip((AS_CALIBRATED, TRIPS["mixed"]), test_seed.spawn(2), strict=True):
        place_m = float(rng.uniform(*WITHIN_PLACES)) * van.wheelbase_m
        within = (Load(float(rng.uniform(*WITHIN_PARTS)) * van.rated_payload_kg, place_m),)
        drives: dict[tuple[tuple[Load, ...], Sensors], tuple[Motion, Vehicle, tuple[Load, ...]]] = {}
        for name, one in DISTURBANCES.items():
            carried = (Load(OVERLOAD * van.rated_payload_kg, place_m),) if one.is_overloaded else within
            if (carried, one.sensors) not in drives:
                drives[carried, one.sensors] = rows_of(van, carried, trip, scope, seeds, one.sensors)
            rows, today, on_board = drives[carried, one.sensors]
            run = known_run(_disturbed(rows, one, seed), len(batches), trip.kind, today, on_board)
            batches += judged_batches(judge([run], calibrated, ESTIMATOR), vehicle, name, ESTIMATOR)
            if one.sensors is not REFERENCE:
                del drives[carried, one.sensors]
    return batches


def _disturbed(rows: Motion, by: Disturbance, seed: int) -> Motion:
    return by.rows(rows, np.random.default_rng(seed))


def _vans(scope: Scope, seed: int, workers: int) -> Iterator[list[JudgedBatch]]:
    one = partial(of_one_van, scope, seed)
    if workers <= 1:
        yield from map(one, range(scope.n_vans))
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(one, range(scope.n_vans))
