"""Coverage over many simulated vans, roads and drives: each van is calibrated on known loads, then tested.

Vans, loads, roads and seeds serve this study alone: no setting of the estimators was chosen with them. Sensors are up
to 0.4 m off the centre line. Every van is calibrated and judged twice on the same drives: with its roll rate mapped,
and without.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any, Final

from benchmarks.accuracy.calibrated import calibrated_on
from benchmarks.accuracy.coverage_table import ALL_KINDS, JudgedBatch, judged_batches, pooled, roll_in_words
from benchmarks.accuracy.drives import TRIPS, USUAL, Scope, driven, fresh_van, unseen_load, without_roll_rate
from benchmarks.accuracy.markdown import (
    Column,
    number,
    page,
    rejected_cell,
    share,
    share_cell,
    table_of,
    target_columns,
    text,
    width_and_score,
)
from benchmarks.accuracy.study import Study
from gateway.calibration.judgement.coverage import PROMISED
from gateway.calibration.judgement.evaluation import judge
from gateway.config import ESTIMATOR_NAMES
from gateway.errors import CalibrationImpossibleError

SEED: Final = 20261  # arbitrary, of this study alone
UNNOTED_EVERY: Final = 2  # chosen: every second van lacks the lateral places of its known loads
Found = tuple[list[JudgedBatch], list[str]]


def of_one_van(seed: int, number: int, scope: Scope = USUAL) -> Found:
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


def _name(line: Mapping[str, Any]) -> str:
    return str(line["estimator"]).replace("_", " ")


_CG_WIDTH, _CG_SCORE = width_and_score("cg_left", "mm")
COLUMNS: Final[tuple[Column, ...]] = (
    ("Drive", text("kind")),
    ("Roll rate", lambda line: "yes" if line["has_roll_rate"] else "no"),
    ("Estimator", _name),
    ("Runs", text("n_runs")),
    ("Batches", text("n_batches")),
    ("Rejected", rejected_cell),
    *target_columns("payload", "Payload", by_van=True),
    *target_columns("front_share", "Share", by_van=True),
    ("Centre of gravity sideways, mean abs. error mm", number("cg_left_mean_abs_mm")),
    ("95 % covers", share("cg_left_coverage")),
    ("+- mm", _CG_WIDTH),
    ("score mm (ideal)", _CG_SCORE),
)


def coverage_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown."""
    refused = [f"- {text}" for text in found["refused"]]
    return page(
        "Coverage, and mixed driving",
        f"coverage --output DIR --vans {len(found['vans'])} --seed {found['seed']}",
        _protocol(found),
        "",
        *table_of(COLUMNS, found["lines"]),
        "",
        *_verdicts(found),
        "",
        *(["Calibrations that were impossible:", "", *refused, ""] if refused else []),
    )


def _protocol(found: Mapping[str, Any]) -> str:
    return (
        f"{len(found['vans'])} vans, random variations of the simulator's three types in masses, wheelbases, "
        "springs, dampers, friction, tyres and places. Each is calibrated on six known loads of ten minutes near "
        "50 km/h, the loads fixed to the floor, then driven with loads it has not seen: as calibrated; at another "
        "steady speed between 30 and 110 km/h; mixed: town, country and motorway in one drive, on roads whose "
        "roughness changes, with potholes; mixed on another day: springs changed by 1.5 %, dampers and tyres by 5 % "
        "(standard deviations, each axle its own); mixed with the load on pallets that ring at 15 Hz, as no "
        "calibration saw it; as calibrated and mixed with the load 0.15 to 0.35 m to one side (0 to 0.1 m else). The "
        "sensor sits up to 0.4 m beside the centre line, its place measured; of every other van nobody noted where the "
        "known loads stood sideways. Every van is calibrated and judged twice on the same drives: with its roll rate "
        "mapped, and without. No setting of either estimator was chosen with these vans, roads or seeds. "
        "Batches of 300 s; errors are percent of the payload each van is rated for and of 20 percentage points; with "
        "misses, a rejected batch counts as a mid-range answer. Coverage is the share of 95 % intervals that held the "
        "truth, with its own 95 % limits: batches of one run (of one van) are alike, so the limits are those of as "
        "many independent batches as scatter like the runs (the vans) do. +- is the mean of half the 95 % intervals. "
        "The interval score is their width and 40 times what the truth lies outside; in brackets what it would be, "
        "were errors normal and intervals as wide as they should be. Loads are of every length and height: boxes, "
        "parcels all over the floor, a filled bay, tall and long ones, pipes, and some with a part on the roof; nobody "
        "says which."
    )


def _verdicts(found: Mapping[str, Any]) -> list[str]:
    """A line for every estimator: does the pooled coverage fall short?"""
    return [
        f"- {_name(line)}, {roll_in_words(line['has_roll_rate'])}, all drives, {what}: {_verdict(line[key])}"
        for line in found["lines"]
        if line["kind"] == ALL_KINDS
        for what, key in (("payload", "payload_coverage"), ("share", "front_share_coverage"))
    ]


def _verdict(coverage: Mapping[str, Any] | None) -> str:
    if coverage is None:
        return "too few answers to tell."
    low, high = coverage["low"], coverage["high"]
    promised = f"{100 * PROMISED[0]:.0f} to {100 * PROMISED[1]:.0f} %"
    if high < PROMISED[0]:
        return f"{share_cell(coverage)}: too narrow, the limits lie below {promised}."
    if low > PROMISED[1]:
        return f"{share_cell(coverage)}: too wide, the limits lie above {promised}."
    return f"{share_cell(coverage)}: agrees with {promised}."


STUDY: Final = Study(
    name="coverage",
    does="Do 95 % intervals contain the truth? Simulated vans, each calibrated and then driven elsewhere; ~40 s a van.",
    doing="calibrating and driving vans",
    of_case=of_one_van,
    numbers=pooled,
    page=coverage_page,
    seed=SEED,
    n=12,
)
