"""The error table of equation (12): estimates against what was weighed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gateway.calibration.known_run import KnownRun
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.estimator import estimate
from gateway.core.vehicle import Vehicle
from gateway.records import F64, Estimate, Why, estimate_to_json


@dataclass(frozen=True, slots=True)
class Judged:
    """One batch of a known run: what was estimated, and what was true."""

    run: int
    name: str
    payload_kg: float
    front_share_pct: float
    estimate: Estimate


def error_table(judged: Sequence[Judged], vehicle: Vehicle, estimator: str) -> dict[str, Any]:
    """(12) over all complete batches: mean |e|, bias, std, max and 95 % coverage, in percent of the ranges.

    Pieces shorter than a window at the end of a run are no batches and are left out. In
    ``mean_abs_pct_with_misses`` a rejected batch scores as if it had answered mid-range. ``runs`` holds
    the same figures of each run by itself, ``batches`` every estimate beside the truth.
    """
    by_run: dict[int, list[Judged]] = {}
    for one in judged:
        by_run.setdefault(one.run, []).append(one)
    return {
        "estimator": estimator,
        **_figures(judged, vehicle),
        "runs": [_run_row(of_run, vehicle) for of_run in by_run.values()],
        "batches": [_batch_row(one) for one in judged],
    }


def _run_row(of_run: Sequence[Judged], vehicle: Vehicle) -> dict[str, Any]:
    return {**_truth(of_run[0]), **_figures(of_run, vehicle)}


def _truth(one: Judged) -> dict[str, Any]:
    return {
        "run": one.run,
        "log": one.name,
        "true_payload_kg": one.payload_kg,
        "true_front_share_pct": one.front_share_pct,
    }


def _figures(judged: Sequence[Judged], vehicle: Vehicle) -> dict[str, Any]:
    whole = [one for one in judged if Why.TOO_SHORT not in one.estimate.rejected]
    counted = [one for one in whole if one.estimate.counted]
    return {
        "n_batches": len(whole),
        "n_rejected": len(whole) - len(counted),
        "rejected_by_reason": _reasons(whole),
        "payload": _errors(
            whole,
            vehicle.payload_range_kg,
            [(j.estimate.payload_kg, j.payload_kg, *j.estimate.payload_interval95_kg) for j in whole],
            "kg",
            vehicle,
        ),
        "front_share": _errors(
            whole,
            vehicle.front_share_range_pct,
            [(j.estimate.front_share_pct, j.front_share_pct, *j.estimate.front_share_interval95_pct) for j in whole],
            "pp",
            vehicle,
        ),
    }


def _reasons(whole: Sequence[Judged]) -> dict[str, int]:
    reasons = [str(why) for one in whole for why in one.estimate.rejected]
    return {why: reasons.count(why) for why in sorted(set(reasons))}


def _errors(
    whole: Sequence[Judged],
    full_range: tuple[float, float],
    rows: list[tuple[float, float, float, float]],
    unit: str,
    vehicle: Vehicle,
) -> dict[str, Any]:
    """One half of the table; null where nothing counted."""
    low, high = full_range
    found = np.array(rows, dtype=float).reshape(-1, 4)
    answered = np.isfinite(found[:, 0])
    error = found[answered, 0] - found[answered, 1]
    missed = 0.5 * (low + high) - found[~answered, 1]
    percent = 100.0 / (high - low)
    covered = (found[answered, 2] <= found[answered, 1]) & (found[answered, 1] <= found[answered, 3])
    table: dict[str, Any] = {
        "mean_abs_pct": _mean(np.abs(error) * percent),
        "mean_abs_pct_with_misses": _mean(np.abs(np.r_[error, missed]) * percent),
        "bias_pct": _mean(error * percent),
        "std_pct": float(np.std(error * percent)) if error.size else None,
        "max_abs_pct": float(np.max(np.abs(error) * percent)) if error.size else None,
        f"mean_abs_{unit}": _mean(np.abs(error)),
        f"bias_{unit}": _mean(error),
        f"std_{unit}": float(np.std(error)) if error.size else None,
        f"max_abs_{unit}": float(np.max(np.abs(error))) if error.size else None,
        "coverage95": _mean(covered.astype(float)),
    }
    if unit == "kg":
        unloaded_kg = vehicle.empty_mass_kg + (vehicle.unsprung_front_kg or 0.0) + (vehicle.unsprung_rear_kg or 0.0)
        gross = np.array([unloaded_kg + one.payload_kg for one in whole])[answered]
        table["mean_abs_pct_of_gross"] = _mean(100.0 * np.abs(error) / gross)
    return table


def _mean(x: F64) -> float | None:
    return float(np.mean(x)) if x.size else None


def _batch_row(one: Judged) -> dict[str, Any]:
    shown = estimate_to_json(one.estimate)
    shown.pop("spectra", None)
    return {**_truth(one), **shown}


def judge(run: KnownRun, calibrated: CalibratedVehicle, estimator: str) -> list[Judged]:
    """Every batch of a known run with its estimate."""
    return [
        Judged(run.number, run.name, run.payload_kg, run.front_share_pct, estimate(batch, calibrated, estimator))
        for batch in run.batches
    ]
