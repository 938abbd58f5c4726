"""Coverage over many simulated vans, roads and drives: each van calibrated on known loads, then put to the test.

    coverage(Scope(), seed) -> CoverageTable

The vans, loads, roads and seeds serve this study alone: nothing of the estimators was chosen on them. Sensors sit up
to 0.4 m beside the centre line. Every van is calibrated and judged twice on the same drives: with its roll rate mapped,
and without.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Final

import numpy as np

from benchmarks.accuracy.coverage_drives import (
    AS_CALIBRATED,
    TRIPS,
    Scope,
    draw_sensors,
    draw_van,
    driven,
    known_loads,
    stated,
    unseen_load,
    without_roll_rate,
)
from benchmarks.accuracy.coverage_table import (
    CoverageTable,
    JudgedBatch,
    coverage_table,
    judged_batches,
    roll_in_words,
)
from gateway.calibration.judgement import judge
from gateway.calibration.judgement.learning_curve import calibrated_on
from gateway.config import ESTIMATOR_NAMES
from gateway.errors import CalibrationImpossibleError

SEED: Final = 20261
UNNOTED_EVERY: Final = 2  # of every so many vans nobody noted where the known loads stood sideways
OnVan = Callable[[int, int], None]  # (vans done, vans in all)
Found = tuple[list[JudgedBatch], list[str]]


def coverage(
    scope: Scope, seed: int = SEED, *, workers: int = 1, on_van: OnVan = lambda done, of: None
) -> CoverageTable:
    """Drive, calibrate and judge every van. ``refused`` of the result names calibrations that were impossible."""
    batches: list[JudgedBatch] = []
    refused: list[str] = []
    on_van(0, scope.n_vans)
    for done, (of_van, refused_of_van) in enumerate(_vans(scope, seed, workers), 1):
        batches += of_van
        refused += refused_of_van
        on_van(done, scope.n_vans)
    return coverage_table(batches, seed, refused)


def of_one_van(scope: Scope, seed: int, number: int) -> Found:
    """One van's batches by every estimator, and why an estimator could not be calibrated."""
    van_seed, load_seed, known_seed, test_seed, sensor_seed = np.random.SeedSequence([seed, number]).spawn(5)
    van = draw_van(number, np.random.default_rng(van_seed))
    sensors = draw_sensors(np.random.default_rng(sensor_seed))
    vehicle, rng = stated(van, sensors), np.random.default_rng(load_seed)
    loads = known_loads(van, scope.n_known_loads, rng)
    runs = [
        driven(van, carried, AS_CALIBRATED, scope, one, i, sensors)
        for i, (carried, one) in enumerate(zip(loads, known_seed.spawn(len(loads)), strict=True), 1)
    ]
    asked = [trip for trip in TRIPS.values() for _ in range(scope.n_tests)]
    tested = [
        driven(van, unseen_load(van, rng), trip, scope, one, len(runs) + i, sensors)
        for i, (trip, one) in enumerate(zip(asked, test_seed.spawn(len(asked)), strict=True), 1)
    ]
    if number % UNNOTED_EVERY == UNNOTED_EVERY - 1:
        runs = [replace(run, payload_left_m=None) for run in runs]
    runs_without, tested_without = ([without_roll_rate(run) for run in each] for each in (runs, tested))
    batches: list[JudgedBatch] = []
    refused: list[str] = []
    for estimator, has_roll_rate in product(ESTIMATOR_NAMES, (True, False)):
        seen, to_judge = (runs, tested) if has_roll_rate else (runs_without, tested_without)
        try:
            calibrated = calibrated_on(seen, vehicle, estimator)
        except CalibrationImpossibleError as fault:
            refused.append(f"{vehicle.name}: {estimator}, {roll_in_words(has_roll_rate)}: {fault}")
            continue
        for trip, run in zip(asked, to_judge, strict=True):
            judged = judge([run], calibrated, estimator)
            batches += judged_batches(judged, vehicle, trip.kind, estimator, run, has_roll_rate=has_roll_rate)
    return batches, refused


def _vans(scope: Scope, seed: int, workers: int) -> Iterator[Found]:
    one = partial(of_one_van, scope, seed)
    if workers <= 1:
        yield from map(one, range(scope.n_vans))
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(one, range(scope.n_vans))
