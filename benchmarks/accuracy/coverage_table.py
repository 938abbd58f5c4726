"""Batches of many vehicles in one table: errors (12), refusals and coverage, a line per kind of drive."""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from gateway.calibration.judgement.coverage import coverage_of, interval_scores
from gateway.calibration.judgement.evaluation import TARGETS, Judged
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.vehicle import Vehicle, cg_left_m
from gateway.records import Why

ALL_KINDS: Final = "all"
HALF_AN_ANSWER: Final = "no_front_share"  # of an estimator calibrated for the payload alone


@dataclass(frozen=True, slots=True)
class JudgedBatch:
    """One batch: errors in percent of its vehicle's ranges, and whether the 95 % intervals contain the truth.

    For a rejected batch the errors are those of a mid-range answer, no interval covers, and half-widths and interval
    scores are NaN. cg_left_error_m is NaN if the lateral place is unknown.
    """

    van: str
    run: str
    kind: str
    estimator: str
    rejected: tuple[str, ...]
    payload_error_pct: float
    front_share_error_pct: float
    is_payload_covered: bool
    is_front_share_covered: bool
    has_roll_rate: bool = True
    cg_left_error_m: float = math.nan
    is_cg_left_covered: bool = False
    payload_half_width_pct: float = math.nan
    payload_score_pct: float = math.nan
    front_share_half_width_pct: float = math.nan
    front_share_score_pct: float = math.nan
    cg_left_half_width_m: float = math.nan
    cg_left_score_m: float = math.nan


def judged_batches(
    judged: Sequence[Judged],
    vehicle: Vehicle,
    kind: str,
    estimator: str,
    run: StatedDrive,
    *,
    has_roll_rate: bool = True,
) -> list[JudgedBatch]:
    """Complete batches of one run in percent of this vehicle's ranges. Pieces shorter than a window are left out."""
    left_m = run.statement.left_m
    cg_m = math.nan if left_m is None else cg_left_m(vehicle, run.payload_kg, left_m)
    return [
        _judged(one, vehicle, kind, estimator, cg_m, has_roll_rate)
        for one in judged
        if Why.TOO_SHORT not in one.estimate.rejected
    ]


def roll_in_words(has_roll_rate: bool) -> str:
    """The words of the pages."""
    return "with roll rate" if has_roll_rate else "without roll rate"


def coverage_table(batches: Sequence[JudgedBatch], seed: int, refused: Sequence[str] = ()) -> dict[str, Any]:
    """A line for every kind, estimator and map with or without a roll rate, then the same over all kinds.

    Batches with and without a roll rate are never pooled. ``refused`` are the reasons of impossible calibrations.
    """
    kinds = dict.fromkeys((batch.kind, batch.has_roll_rate) for batch in batches)
    everything = dict.fromkeys((ALL_KINDS, batch.has_roll_rate) for batch in batches)
    estimators = dict.fromkeys(batch.estimator for batch in batches)
    return {
        "seed": seed,
        "vans": list(dict.fromkeys(batch.van for batch in batches)),
        "lines": [
            _line(kind, name, has_roll_rate, [b for b in batches if _is_of(b, kind, name, has_roll_rate)])
            for kind, has_roll_rate in (*kinds, *everything)
            for name in estimators
        ],
        "refused": list(refused),
    }


def pooled(seed: int, n: int, vans: Sequence[tuple[list[JudgedBatch], list[str]]]) -> dict[str, Any]:
    """The table of all vans' batches, with the reasons of impossible calibrations."""
    batches = [batch for of_van, _ in vans for batch in of_van]
    return coverage_table(batches, seed, [reason for _, of_van in vans for reason in of_van])


def _is_of(batch: JudgedBatch, kind: str, estimator: str, has_roll_rate: bool) -> bool:
    return (batch.estimator, batch.has_roll_rate) == (estimator, has_roll_rate) and kind in (batch.kind, ALL_KINDS)


def _judged(one: Judged, vehicle: Vehicle, kind: str, estimator: str, cg_m: float, has_roll_rate: bool) -> JudgedBatch:
    found = one.estimate
    rejected = tuple(str(why) for why in found.rejected)
    if not rejected and not (np.isfinite(found.payload.number) and np.isfinite(found.front_share.number)):
        rejected = (HALF_AN_ANSWER,)
    figures: dict[str, Any] = {}
    for target, unit, quantity, true, full_range in (
        ("payload", "pct", found.payload, one.drive.payload_kg, vehicle.payload_range_kg),
        ("front_share", "pct", found.front_share, one.drive.front_share_pct, vehicle.front_share_range_pct),
        ("cg_left", "m", found.cg_left, cg_m, (0.0, 100.0)),
    ):
        (low, high), times = quantity.interval95, 100.0 / (full_range[1] - full_range[0])
        answer = 0.5 * sum(full_range) if rejected and unit == "pct" else quantity.number
        (score,) = interval_scores(np.array([true]), np.array([low]), np.array([high])).tolist()
        figures[f"{target}_error_{unit}"] = times * (answer - true)
        figures[f"is_{target}_covered"] = bool(low <= true <= high)
        figures[f"{target}_half_width_{unit}"] = math.nan if rejected else 0.5 * (high - low) * times
        figures[f"{target}_score_{unit}"] = math.nan if rejected else score * times
    return JudgedBatch(
        vehicle.name,
        f"{vehicle.name} {one.drive.number}",
        kind,
        estimator,
        rejected,
        has_roll_rate=has_roll_rate,
        **figures,
    )


def _line(kind: str, estimator: str, has_roll_rate: bool, batches: Sequence[JudgedBatch]) -> dict[str, Any]:
    """One estimator over one kind of drive. Means are of |error|; None without an answer.

    Coverage is clustered by run, and by van for ``_by_van``: one calibration serves all runs of a van.
    """
    answered = [batch for batch in batches if not batch.rejected]
    placed = [batch for batch in answered if math.isfinite(batch.cg_left_error_m)]
    reasons = [why for batch in batches for why in batch.rejected]
    line: dict[str, Any] = {
        "kind": kind,
        "estimator": estimator,
        "has_roll_rate": has_roll_rate,
        "n_vans": len({batch.van for batch in batches}),
        "n_runs": len({batch.run for batch in batches}),
        "n_batches": len(batches),
        "n_rejected": len(batches) - len(answered),
        "rejected_by_reason": {why: reasons.count(why) for why in sorted({*reasons})},
        **_figures("cg_left", placed, "m", "mm", 1000.0),
    }
    for target in TARGETS:
        line |= _figures(target, answered, "pct", "pct")
        line[f"{target}_mean_abs_pct_with_misses"] = _mean_abs([_of(batch, f"{target}_error_pct") for batch in batches])
        line[f"{target}_coverage_by_van"] = _coverage(answered, target, lambda batch: batch.van)
    return line


def _figures(target: str, answered: Sequence[JudgedBatch], unit: str, shown: str, times: float = 1.0) -> dict[str, Any]:
    """A target's figures in a line; means of ``unit`` times ``times`` are named after the unit ``shown``."""
    line: dict[str, Any] = {f"{target}_coverage": _coverage(answered, target, lambda batch: batch.run)}
    for name, figure in (("mean_abs", "error"), ("half_width", "half_width"), ("interval_score", "score")):
        known = [x for batch in answered if math.isfinite(x := _of(batch, f"{target}_{figure}_{unit}"))]
        line[f"{target}_{name}_{shown}"] = _mean_abs([times * x for x in known])
    return line


def _of(batch: JudgedBatch, name: str) -> float:
    return float(getattr(batch, name))


def _mean_abs(figures: Sequence[float]) -> float | None:
    return float(np.mean(np.abs(figures))) if figures else None


def _coverage(
    answered: Sequence[JudgedBatch], target: str, cluster: Callable[[JudgedBatch], str]
) -> dict[str, Any] | None:
    """None if fewer than two clusters were answered."""
    clusters = [cluster(batch) for batch in answered]
    covered = [bool(getattr(batch, f"is_{target}_covered")) for batch in answered]
    return asdict(coverage_of(covered, clusters)) if len({*clusters}) > 1 else None
