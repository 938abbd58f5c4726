"""All sources at once: vans that differ from their calibration in everything that the estimator allows for.

The fitter's empty share is wrong, springs, tyres and dampers are those of another day, the sensors have another
temperature, loads have every length and height and any place across the floor.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.budget.nature import (
    amplified,
    as_stated,
    drawn_day,
    drawn_gains,
    drawn_share_pct,
    on_that_day,
    place_std_m,
    to_one_side,
)
from benchmarks.accuracy.calibrated import calibrated_on
from benchmarks.accuracy.drives import (
    EMPTY_SHARE,
    TRIPS,
    USUAL,
    FreshVan,
    Scope,
    fresh_van,
    known_run,
    rows_of,
    without_roll_rate,
)
from benchmarks.accuracy.loads import SAYS, Shape, shaped_load
from gateway.calibration.judgement.coverage import coverage_of, interval_scores
from gateway.calibration.known_run import KnownRun
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum.drift import MOST_TENSION
from gateway.core.estimator import estimate
from gateway.core.vehicle import cg_left_m
from gateway.estimate import Estimate
from gateway.records import Why

ESTIMATOR: Final = "cross_spectrum"
MIXED: Final = TRIPS["mixed"]
QUANTITIES: Final = ("payload", "front_share", "cg_left")
WATCHED: Final = ("misfit", "tension", "sensor_position_score", "sensor_noise_score")
INSTRUMENTAL: Final = frozenset({Why.MODEL_MISFIT, Why.SENSOR_CHANGED, Why.SENSOR_DISAGREEMENT, Why.WRONG_SIGN})
PERCENT_OF_M: Final = 100.0  # lateral places are in metres, and in centimetres on the page


@dataclass(frozen=True, slots=True)
class Weighing:
    """One batch: its run, whether a roll rate was used and the shape stated, and for each answered quantity the error,
    half-width and interval score (percent of the range; cm for places) and the error squared over its variance.
    """

    van: str
    run: str
    has_roll_rate: bool
    is_shape_said: bool
    rejected: tuple[str, ...]
    judged: dict[str, tuple[float, float, float, float]]
    watched: dict[str, float]  # figures with a limit for refusal, over that limit


def rows_of_weighings(weighings: Sequence[Weighing]) -> list[dict[str, Any]]:
    """A row for each of the four cases."""
    rows = []
    for has_roll_rate, is_said in product((True, False), repeat=2):
        some = [one for one in weighings if (one.has_roll_rate, one.is_shape_said) == (has_roll_rate, is_said)]
        reasons = [why for one in some for why in one.rejected]
        rows.append(
            {
                "has_roll_rate": has_roll_rate,
                "is_shape_said": is_said,
                "n_batches": len(some),
                "n_rejected": sum(bool(one.rejected) for one in some),
                "rejected_by_reason": {why: reasons.count(why) for why in sorted({*reasons})},
                **{name: figures_of(name, some) for name in QUANTITIES},
                "refusals": refusals_of(some),
            }
        )
    return rows


def figures_of(quantity: str, weighings: Iterable[Weighing]) -> dict[str, Any]:
    """The figures of one quantity over answered batches; None if too few were answered."""
    answered = [one for one in weighings if quantity in one.judged]
    judged = np.array([one.judged[quantity] for one in answered]).reshape(-1, 4).T
    error, half_width, score, z2 = judged
    means = {"mean_abs": np.abs(error), "z2": z2, "half_width": half_width, "interval_score": score}
    held = (score <= 2.0 * half_width * (1.0 + 1e-9)).tolist()
    clusters = {"coverage": [one.run for one in answered], "coverage_by_van": [one.van for one in answered]}
    return {
        "n": len(answered),
        **{name: float(np.mean(each)) if answered else None for name, each in means.items()},
        **{name: asdict(coverage_of(held, of)) if len({*of}) > 1 else None for name, of in clusters.items()},
    }


def refusals_of(weighings: Sequence[Weighing]) -> dict[str, Any]:
    """Quantiles of each watched figure over its limit, and the share of batches refused because of the instrument, with
    its 95 % limits by van. Nothing is wrong with these vans.
    """
    refused = [any(Why(why) in INSTRUMENTAL for why in one.rejected) for one in weighings]
    rate = coverage_of(refused, [one.van for one in weighings]) if len({one.van for one in weighings}) > 1 else None
    watched = {}
    for name in WATCHED:
        ratios = [one.watched[name] for one in weighings if math.isfinite(one.watched.get(name, math.nan))]
        if ratios:
            p50, p99, most = np.quantile(ratios, (0.5, 0.99, 1.0)).tolist()
            watched[name] = {"p50": p50, "p99": p99, "most": most}
    return {"rate": asdict(rate) if rate else None, "watched": watched}


def of_one_van(seed: int, number: int, scope: Scope = USUAL) -> list[Weighing]:
    """One van, calibrated with and without its roll rate, on the same drives."""
    fresh = fresh_van(scope, seed, number)
    vehicle, runs = as_stated(fresh.vehicle, fresh.runs, drawn_share_pct(fresh.vehicle, fresh.rng))
    drives = [_driven(fresh, scope, one, i) for i, one in enumerate(fresh.test_seed.spawn(2 * scope.n_tests), 1)]
    found: list[Weighing] = []
    for has_roll_rate in (True, False):
        seen = runs if has_roll_rate else [without_roll_rate(run) for run in runs]
        calibrated = calibrated_on(seen, vehicle, ESTIMATOR)
        for run, shape in drives:
            heard = run if has_roll_rate else without_roll_rate(run)
            for is_said in (False, True):
                ready = _saying(calibrated, shape) if is_said else calibrated
                found += _weighed(heard, ready, fresh, has_roll_rate=has_roll_rate, is_said=is_said)
    return found


def _driven(fresh: FreshVan, scope: Scope, seeds: np.random.SeedSequence, number: int) -> tuple[KnownRun, Shape]:
    """A drive on another day with a load of any shape, sometimes with none; its front share is the true one."""
    rng, van = fresh.rng, fresh.van
    today, gains = on_that_day(van, drawn_day(rng)), drawn_gains(rng)
    shape = list(Shape)[int(rng.integers(len(Shape)))]
    mass_kg, place_m = float(rng.uniform(0.05, 1.0)) * van.rated_payload_kg, float(rng.uniform(0.15, 1.0))
    loads = shaped_load(shape, van, mass_kg, place_m * van.wheelbase_m, rng)
    left_m = place_std_m(fresh.vehicle) * float(rng.standard_normal())
    carried = () if rng.random() < EMPTY_SHARE else loads
    rows, driven, on_board = rows_of(today, carried, to_one_side(MIXED, left_m), scope, seeds, fresh.sensors)
    return known_run(amplified(rows, gains), number, MIXED.kind, driven, on_board), shape


def _saying(calibrated: CalibratedVehicle, shape: Shape) -> CalibratedVehicle:
    vehicle = replace(calibrated.vehicle, carries=SAYS[shape], roof_rack=shape is Shape.ROOF)
    return replace(calibrated, vehicle=vehicle)


def _weighed(
    run: KnownRun, calibrated: CalibratedVehicle, fresh: FreshVan, *, has_roll_rate: bool, is_said: bool
) -> Iterator[Weighing]:
    vehicle = fresh.vehicle
    truths = {
        "payload": (run.payload_kg, 100.0 / (vehicle.payload_range_kg[1] - vehicle.payload_range_kg[0])),
        "front_share": (
            run.front_share_pct, 100.0 / (vehicle.front_share_range_pct[1] - vehicle.front_share_range_pct[0]),
        ),
        "cg_left": (cg_left_m(vehicle, run.payload_kg, run.payload_left_m or 0.0), PERCENT_OF_M),
    }  # fmt: skip
    for batch in run.batches:
        found = estimate(batch, calibrated, ESTIMATOR)
        if Why.TOO_SHORT not in found.rejected:
            judged = {name: _judged(found, name, *truth) for name, truth in truths.items()} if found.counted else {}
            known = {name: row for name, row in judged.items() if math.isfinite(row[0])}
            rejected = tuple(map(str, found.rejected))
            yield Weighing(
                vehicle.name,
                f"{vehicle.name} {run.number}",
                has_roll_rate,
                is_said,
                rejected,
                known,
                _watched(found, calibrated),
            )


def _watched(found: Estimate, calibrated: CalibratedVehicle) -> dict[str, float]:
    """Each figure with a limit for refusal, over that limit; a noise score below zero counts as zero."""
    limits, seen = calibrated.cross_spectrum, found.diagnostics
    if limits is None or "misfit" not in seen:
        return {}
    return {
        "misfit": seen["misfit"] / limits.misfit_limit,
        "tension": seen["tension"] / MOST_TENSION,
        "sensor_position_score": abs(seen["sensor_position_score"]) / limits.most_position_score,
        "sensor_noise_score": max(seen["sensor_noise_score"], 0.0) / limits.most_noise_score,
    }


def _judged(found: Estimate, quantity: str, true: float, scale: float) -> tuple[float, float, float, float]:
    answer = getattr(found, quantity)
    low, high = answer.interval95
    (score,) = interval_scores(np.array([true]), np.array([low]), np.array([high])).tolist()
    error = answer.number - true
    return scale * error, scale * 0.5 * (high - low), scale * score, (error / answer.std) ** 2
