"""Coverage over many simulated vans, roads and drives: each van calibrated on known loads, then put to the test.

    coverage(Scope(), seed) -> CoverageTable

The vans, loads, roads and seeds serve this study alone: nothing of the estimators was chosen on them.
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
    stated,
    unseen_load,
)
from benchmarks.accuracy.coverage_table import CoverageTable, JudgedBatch, coverage_table, judged_batches
from gateway.calibration.judgement import judge
from gateway.calibration.judgement.learning_curve import calibrated_on
from gateway.config import ESTIMATOR_NAMES
from gateway.errors import CalibrationImpossibleError

SEED: Final = 20261
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
    van_seed, load_seed, known_seed, test_seed = np.random.SeedSequence([seed, number]).spawn(4)
    van = draw_van(number, np.random.default_rng(van_seed))
    vehicle, rng = stated(van), np.random.default_rng(load_seed)
    loads = known_loads(van, scope.n_known_loads, rng)
    runs = [
        driven(van, carried, AS_CALIBRATED, scope, one, i)
        for i, (carried, one) in enumerate(zip(loads, known_seed.spawn(len(loads)), strict=True), 1)
    ]
    asked = [trip for trip in TRIPS.values() for _ in range(scope.n_tests)]
    tested = [
        (trip.kind, driven(van, unseen_load(van, rng), trip, scope, one, len(runs) + i))
        for i, (trip, one) in enumerate(zip(asked, test_seed.spawn(len(asked)), strict=True), 1)
    ]
    batches: list[JudgedBatch] = []
    refused: list[str] = []
    for estimator in ESTIMATOR_NAMES:
        try:
            calibrated = calibrated_on(runs, vehicle, estimator)
        except CalibrationImpossibleError as fault:
            refused.append(f"{vehicle.name}: {estimator}: {fault}")
            continue
        for kind, run in tested:
            batches += judged_batches(judge([run], calibrated, estimator), vehicle, kind, estimator)
    return batches, refused


def _vans(scope: Scope, seed: int, workers: int) -> Iterator[Found]:
    one = partial(of_one_van, scope, seed)
    if workers <= 1:
        yield from map(one, range(scope.n_vans))
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(one, range(scope.n_vans))
