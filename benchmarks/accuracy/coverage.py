"""Coverage over many simulated vans, roads and drives: each van is calibrated on known loads, then tested.

    coverage(Scope(), seed) -> CoverageTable

Vans, loads, roads and seeds serve this study alone: no setting of the estimators was chosen with them. Sensors are up
to 0.4 m off the centre line. Every van is calibrated and judged twice on the same drives: with its roll rate mapped,
and without.
"""

from dataclasses import replace
from functools import partial
from itertools import product
from typing import Final

from benchmarks.accuracy.coverage_drives import TRIPS, Scope, driven, unseen_load, without_roll_rate
from benchmarks.accuracy.coverage_table import (
    CoverageTable,
    JudgedBatch,
    coverage_table,
    judged_batches,
    roll_in_words,
)
from benchmarks.accuracy.runner import OnDone, run_each
from benchmarks.accuracy.vans import fresh_van
from gateway.calibration.judgement import judge
from gateway.calibration.judgement.learning_curve import calibrated_on
from gateway.config import ESTIMATOR_NAMES
from gateway.errors import CalibrationImpossibleError

SEED: Final = 20261  # arbitrary, of this study alone
UNNOTED_EVERY: Final = 2  # chosen: every second van lacks the lateral places of its known loads
Found = tuple[list[JudgedBatch], list[str]]


def coverage(
    scope: Scope, seed: int = SEED, *, workers: int = 1, on_van: OnDone = lambda done, of: None
) -> CoverageTable:
    """Drive, calibrate and judge every van. ``refused`` of the result lists impossible calibrations."""
    batches: list[JudgedBatch] = []
    refused: list[str] = []
    for of_van, refused_of_van in run_each(partial(of_one_van, scope, seed), scope.n_vans, workers, on_van):
        batches += of_van
        refused += refused_of_van
    return coverage_table(batches, seed, refused)


def of_one_van(scope: Scope, seed: int, number: int) -> Found:
    """One van's batches by every estimator, and the reasons of impossible calibrations."""
    fresh = fresh_van(scope, seed, number)
    van, vehicle, runs = fresh.van, fresh.vehicle, fresh.runs
    asked = [trip for trip in TRIPS.values() for _ in range(scope.n_tests)]
    tested = [
        driven(van, unseen_load(van, fresh.rng), trip, scope, one, len(runs) + i, fresh.sensors)
        for i, (trip, one) in enumerate(zip(asked, fresh.test_seed.spawn(len(asked)), strict=True), 1)
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
