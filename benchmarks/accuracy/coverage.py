"""Coverage over many simulated vans, roads and drives: each van is calibrated on known loads, then tested.

Vans, loads, roads and seeds serve this study alone: no setting of the estimators was chosen with them. Sensors are up
to 0.4 m off the centre line. Every van is calibrated and judged twice on the same drives: with its roll rate mapped,
and without.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, Final

from benchmarks.accuracy.calibrated import calibrated_on
from benchmarks.accuracy.coverage_table import ALL_KINDS, JudgedBatch, judged_batches, pooled, roll_in_words
from benchmarks.accuracy.drives import TRIPS, USUAL, Scope, driven, fresh_van, unseen_load, without_roll_rate
from benchmarks.accuracy.markdown import share_cell
from benchmarks.accuracy.study import Study
from gateway.calibration.judgement.coverage import IDEAL_SCORE, PROMISED
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
        runs = [replace(run, statement=replace(run.statement, left_m=None)) for run in runs]
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


def section(found: Mapping[str, Any]) -> str:
    """The errors of every kind of drive, and whether the intervals hold."""
    return "\n".join([HEAD, *rows(found["lines"]).values(), "", *_verdicts(found), ""])


HEAD: Final = (
    "| percent, payload / front share | error, ratio index | error, cross spectrum | its 95 % intervals held "
    "| half as wide as | score (ideal) | refused |\n|---|---|---|---|---|---|---|"
)


def rows(lines: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """A row for each kind of drive, by its title."""
    kinds = dict.fromkeys((line["kind"], line["has_roll_rate"]) for line in lines if line["kind"] != ALL_KINDS)
    of = {(line["kind"], line["has_roll_rate"], line["estimator"]): line for line in lines}
    return dict(_row(of[*kind, "ratio_index"], of[*kind, "cross_spectrum"]) for kind in kinds)


def _row(other: Mapping[str, Any], ours: Mapping[str, Any]) -> tuple[str, str]:
    title = f"{ours['kind']}{', with roll rate' if ours['has_roll_rate'] else ''}"
    held = " / ".join(_percent(100.0 * one["share"] if one else None, 0) for one in _both(ours, "coverage"))
    widths = " / ".join(_percent(half) for half in _both(ours, "half_width_pct"))
    scores = " / ".join(
        "none" if score is None or mean is None else f"{score:.0f} ({IDEAL_SCORE * mean:.0f})"
        for score, mean in zip(_both(ours, "interval_score_pct"), _both(ours, "mean_abs_pct"), strict=True)
    )
    errors, others = (" / ".join(map(_percent, _both(line, "mean_abs_pct"))) for line in (ours, other))
    refused = f"{ours['n_rejected']} of {ours['n_batches']}"
    return title, f"| {title} | {others} | **{errors}** | {held} | {widths} | {scores} | {refused} |"


def _both(line: Mapping[str, Any], ending: str) -> list[Any]:
    return [line[f"{what}_{ending}"] for what in ("payload", "front_share")]


def _percent(number: float | None, digits: int = 1) -> str:
    return "none" if number is None else f"{number:.{digits}f}"


def _verdicts(found: Mapping[str, Any]) -> list[str]:
    """Does the pooled coverage of the half-car's intervals fall short?"""
    return [
        f"- {line['estimator'].replace('_', ' ')}, {roll_in_words(line['has_roll_rate'])}, all drives, {what}: "
        f"{_verdict(line[key])}"
        for line in found["lines"]
        if line["kind"] == ALL_KINDS and line["estimator"] == "cross_spectrum"
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
    section=section,
    seed=SEED,
    n=12,
)
