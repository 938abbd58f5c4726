"""The effect of disturbed sensors and stamps on a calibrated van: every disturbance on the same fresh drives.

    disturbances(Scope(), seed) -> CoverageTable

The vans serve this study alone; their sensors are up to 0.4 m off the centre line, with a roll rate unless a line says
otherwise. A drive as calibrated and a mixed one carry loads within the calibrated range and near the centre line, or
0.15 to 0.35 m off it in lines with sideways loads; the last line carries 1.5 times the rated payload.
"""

from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from benchmarks.accuracy.coverage_drives import (
    AS_CALIBRATED,
    SIDEWAYS_M,
    TRIPS,
    Scope,
    known_run,
    rows_of,
    without_roll_rate,
)
from benchmarks.accuracy.coverage_table import CoverageTable, JudgedBatch, coverage_table, judged_batches
from benchmarks.accuracy.disturbed import DISTURBANCES, Disturbance
from benchmarks.accuracy.runner import OnDone, run_each
from benchmarks.accuracy.vans import fresh_van
from gateway.calibration.judgement import judge
from gateway.calibration.judgement.learning_curve import calibrated_on
from gateway.records import Motion
from gateway.sim.sensors import Sensors
from gateway.sim.vehicle import Load, Vehicle

ESTIMATOR: Final = "cross_spectrum"
SEED: Final = 20_270  # arbitrary, of this study alone
WITHIN_PARTS: Final = (0.3, 0.9)  # chosen: of the rated payload
WITHIN_PLACES: Final = (0.3, 0.9)  # chosen: of the wheelbase
OVERLOAD: Final = 1.5  # chosen: times the rated payload


def disturbances(
    scope: Scope, seed: int = SEED, *, workers: int = 1, on_van: OnDone = lambda done, of: None
) -> CoverageTable:
    """Calibrate every van, drive it, disturb the recording, and judge; a line for every disturbance."""
    batches: list[JudgedBatch] = []
    for of_van in run_each(partial(of_one_van, scope, seed), scope.n_vans, workers, on_van):
        batches += of_van
    return coverage_table(batches, seed)


def of_one_van(scope: Scope, seed: int, number: int) -> list[JudgedBatch]:
    """One van's batches under every disturbance."""
    fresh = fresh_van(scope, seed, number)
    van, mounted, vehicle, runs, rng = fresh.van, fresh.sensors, fresh.vehicle, fresh.runs, fresh.rng
    with_roll_rate = calibrated_on(runs, vehicle, ESTIMATOR)
    without = calibrated_on([without_roll_rate(run) for run in runs], vehicle, ESTIMATOR)
    batches: list[JudgedBatch] = []
    for trip, seeds in zip((AS_CALIBRATED, TRIPS["mixed"]), fresh.test_seed.spawn(2), strict=True):
        place_m = float(rng.uniform(*WITHIN_PLACES)) * van.wheelbase_m
        within = (Load(float(rng.uniform(*WITHIN_PARTS)) * van.rated_payload_kg, place_m),)
        drives: dict[tuple[Vehicle, tuple[Load, ...], Sensors, bool], tuple[Motion, Vehicle, tuple[Load, ...]]] = {}
        for name, one in DISTURBANCES.items():
            loads = (Load(OVERLOAD * van.rated_payload_kg, place_m),) if one.is_overloaded else within
            sensors = one.sensors(mounted)
            taking, carried = one.world(van, loads)
            key = (taking, carried, sensors, one.is_sideways)
            if key not in drives:
                taken = replace(trip, off_m=SIDEWAYS_M) if one.is_sideways else trip
                drives[key] = rows_of(taking, carried, taken, scope, seeds, sensors)
            rows, today, on_board = drives[key]
            run = known_run(_disturbed(rows, one, seed), len(batches), trip.kind, today, on_board)
            run, calibrated = (run, with_roll_rate) if one.has_roll_rate else (without_roll_rate(run), without)
            judged = judge([run], calibrated, ESTIMATOR)
            batches += judged_batches(judged, vehicle, name, ESTIMATOR, run, has_roll_rate=one.has_roll_rate)
            if (taking, sensors) != (van, mounted):
                del drives[key]
    return batches


def _disturbed(rows: Motion, by: Disturbance, seed: int) -> Motion:
    return by.rows(rows, np.random.default_rng(seed))
