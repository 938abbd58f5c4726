"""The effect of disturbed sensors and stamps on a calibrated van: every disturbance on the same fresh drives.

The vans serve this study alone; their sensors are up to 0.4 m off the centre line, with a roll rate unless a line says
otherwise. A drive as calibrated and a mixed one carry loads within the calibrated range and near the centre line, or
0.15 to 0.35 m off it in lines with sideways loads; the last line carries 1.5 times the rated payload.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.calibrated import calibrated_on
from benchmarks.accuracy.coverage_table import ALL_KINDS, JudgedBatch, coverage_table, judged_batches
from benchmarks.accuracy.disturbed import DISTURBANCES, UNDISTURBED, Disturbance
from benchmarks.accuracy.drives import (
    AS_CALIBRATED,
    SIDEWAYS_M,
    TRIPS,
    USUAL,
    Scope,
    fresh_van,
    known_run,
    rows_of,
    without_roll_rate,
)
from benchmarks.accuracy.markdown import (
    Column,
    Row,
    all_but,
    number,
    refused_cell,
    table_of,
    text,
    width_and_score,
)
from benchmarks.accuracy.study import Study
from gateway.calibration.judgement.evaluation import judge
from gateway.records import Motion, Why
from gateway.sim.instruments import Sensors
from gateway.sim.parameters import Load, Vehicle

ESTIMATOR: Final = "cross_spectrum"
SEED: Final = 20_270  # arbitrary, of this study alone
WITHIN_PARTS: Final = (0.3, 0.9)  # chosen: of the rated payload
WITHIN_PLACES: Final = (0.3, 0.9)  # chosen: of the wheelbase
OVERLOAD: Final = 1.5  # chosen: times the rated payload


def of_one_van(seed: int, number: int, scope: Scope = USUAL) -> list[JudgedBatch]:
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


def numbers(seed: int, n: int, vans: Sequence[list[JudgedBatch]]) -> dict[str, Any]:
    """A line for every disturbance."""
    return coverage_table([batch for of_van in vans for batch in of_van], seed)


WELL: Final = 0.9  # chosen: of the batches; covered by their 95 % intervals, or refused for a right reason
OF_ANY_DRIVE: Final = (Why.TOO_SLOW, Why.SPEED_SPREAD, Why.SPEED_MISSING, Why.NOT_ENOUGH_EXCITATION)
MENDED_WITHIN: Final = 1.25  # chosen: of the undisturbed error


def section(found: Mapping[str, Any]) -> str:
    """A row for every disturbance that has an effect, the names of the others, and a verdict."""
    lines = [line for line in found["lines"] if line["kind"] != ALL_KINDS]
    undisturbed = next(line for line in lines if line["kind"] == UNDISTURBED.name)
    harmless = [line for line in lines if line is not undisturbed and _is_harmless(line, undisturbed)]
    shown = [line for line in lines if line not in harmless]
    names = ", ".join(line["kind"] for line in harmless) or "none"
    told = f"- No more refused, every interval held, errors within {MENDED_WITHIN:g} times those as recorded: {names}."
    return "\n".join([*table_of(COLUMNS, shown), "", told, *_verdicts(lines), ""])


def _is_harmless(line: Mapping[str, Any], undisturbed: Mapping[str, Any]) -> bool:
    is_held = all(held_or_refused(line, quantity) == 1.0 for quantity in ("payload", "front_share"))
    return is_held and line["n_rejected"] == undisturbed["n_rejected"] and is_mended(line, undisturbed)


def held_or_refused(line: Mapping[str, Any], quantity: str) -> float:
    """The share (0..1) of a line's batches that do not mislead: covered, or refused for a right reason."""
    coverage, answered = line[f"{quantity}_coverage"], line["n_batches"] - line["n_rejected"]
    held = coverage["share"] * answered if coverage else 0.0
    right = {str(why) for why in (*DISTURBANCES[line["kind"]].reasons, *OF_ANY_DRIVE)}
    wrong = sum(n for why, n in line["rejected_by_reason"].items() if why not in right)
    return float((held + line["n_rejected"] - wrong) / line["n_batches"])


def is_mended(line: Mapping[str, Any], undisturbed: Mapping[str, Any]) -> bool:
    """Whether both errors are within 1.25 times the undisturbed ones, or nothing was answered."""
    names = ("payload_mean_abs_pct", "front_share_mean_abs_pct")
    return all(line[name] is None or line[name] <= MENDED_WITHIN * undisturbed[name] for name in names)


def _held(quantity: str) -> Callable[[Row], str]:
    return lambda line: f"{100.0 * held_or_refused(line, quantity):.0f} %"


_WIDTH = [width_and_score(quantity)[0] for quantity in ("payload", "front_share")]
COLUMNS: Final[tuple[Column, ...]] = (
    ("Disturbance", text("kind")),
    ("Refused, and why", lambda line: refused_cell(line["n_rejected"], line["rejected_by_reason"])),
    ("Payload, mean abs. error %", number("payload_mean_abs_pct", 1, unknown="–")),
    ("Share, mean abs. error %", number("front_share_mean_abs_pct", 1, unknown="–")),
    ("Payload held or refused", _held("payload")),
    ("Share held or refused", _held("front_share")),
    ("Payload, +- %", _WIDTH[0]),
    ("Share, +- %", _WIDTH[1]),
)


def _verdicts(lines: list[Mapping[str, Any]]) -> list[str]:
    undisturbed = next(line for line in lines if line["kind"] == UNDISTURBED.name)
    misled = [
        line["kind"]
        for line in lines
        if min(held_or_refused(line, quantity) for quantity in ("payload", "front_share")) < WELL
    ]
    unmended = [one["kind"] for one in lines if DISTURBANCES[one["kind"]].is_mended and not is_mended(one, undisturbed)]
    return [
        f"- Held or refused in at least {100 * WELL:.0f} % of the batches: {all_but(misled)}",
        f"- Time stamps, losses and lags within {MENDED_WITHIN:g} times the undisturbed errors: {all_but(unmended)}",
    ]


STUDY: Final = Study(
    name="disturbances",
    does="The effect of jitter, losses, lags and moved sensors on calibrated vans; ~2 min a van.",
    doing="calibrating, driving and disturbing vans",
    of_case=of_one_van,
    numbers=numbers,
    section=section,
    seed=SEED,
    n=12,
)
