"""Batches of many vehicles in one table: errors (12), refusals and coverage, a line per kind of drive."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from gateway.calibration.judgement.coverage import Coverage, coverage_of, interval_scores
from gateway.calibration.judgement.evaluation import Judged
from gateway.calibration.known_run import KnownRun
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

    @property
    def is_rejected(self) -> bool:
        """Whether the batch has no answer."""
        return bool(self.rejected)


@dataclass(frozen=True, slots=True)
class Line:
    """One estimator over one kind of drive. Means are of |error| in percent; None without an answer.

    Coverage is clustered by run, and by van for ``_by_van``: one calibration serves all runs of a van.
    """

    kind: str
    estimator: str
    has_roll_rate: bool
    n_vans: int
    n_runs: int
    n_batches: int
    n_rejected: int
    rejected_by_reason: Mapping[str, int]
    payload_mean_abs_pct: float | None
    payload_mean_abs_pct_with_misses: float
    payload_coverage: Coverage | None
    payload_coverage_by_van: Coverage | None
    front_share_mean_abs_pct: float | None
    front_share_mean_abs_pct_with_misses: float
    front_share_coverage: Coverage | None
    front_share_coverage_by_van: Coverage | None
    cg_left_mean_abs_mm: float | None
    cg_left_coverage: Coverage | None
    payload_half_width_pct: float | None
    payload_interval_score_pct: float | None
    front_share_half_width_pct: float | None
    front_share_interval_score_pct: float | None
    cg_left_half_width_mm: float | None
    cg_left_interval_score_mm: float | None


@dataclass(frozen=True, slots=True)
class CoverageTable:
    """The result of a study of coverage, line by line; the lines of all kinds together come last.

    Batches with and without a roll rate are never pooled.
    """

    seed: int
    vans: tuple[str, ...]
    lines: tuple[Line, ...]
    refused: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The figures for a file or a page."""
        return asdict(self)


def judged_batches(
    judged: Sequence[Judged], vehicle: Vehicle, kind: str, estimator: str, run: KnownRun, *, has_roll_rate: bool = True
) -> list[JudgedBatch]:
    """Complete batches of one run in percent of this vehicle's ranges. Pieces shorter than a window are left out."""
    cg_m = math.nan if run.payload_left_m is None else cg_left_m(vehicle, run.payload_kg, run.payload_left_m)
    return [
        _judged(one, vehicle, kind, estimator, cg_m, has_roll_rate)
        for one in judged
        if Why.TOO_SHORT not in one.estimate.rejected
    ]


def roll_in_words(has_roll_rate: bool) -> str:
    """The words of the pages."""
    return "with roll rate" if has_roll_rate else "without roll rate"


def coverage_table(batches: Sequence[JudgedBatch], seed: int, refused: Sequence[str] = ()) -> CoverageTable:
    """A line for every kind, estimator and map with or without a roll rate, then the same over all kinds."""
    kinds = dict.fromkeys((batch.kind, batch.has_roll_rate) for batch in batches)
    pooled = dict.fromkeys((ALL_KINDS, batch.has_roll_rate) for batch in batches)
    estimators = dict.fromkeys(batch.estimator for batch in batches)
    lines = [
        _line(kind, name, has_roll_rate, [b for b in batches if _is_of(b, kind, name, has_roll_rate)])
        for kind, has_roll_rate in (*kinds, *pooled)
        for name in estimators
    ]
    vans = tuple(dict.fromkeys(batch.van for batch in batches))
    return CoverageTable(seed, vans, tuple(lines), tuple(refused))


def pooled(vans: Sequence[tuple[Sequence[JudgedBatch], Sequence[str]]], seed: int) -> dict[str, Any]:
    """The table of all vans' batches, with the reasons of impossible calibrations."""
    batches = [batch for of_van, _ in vans for batch in of_van]
    return coverage_table(batches, seed, [reason for _, of_van in vans for reason in of_van]).to_json()


def _is_of(batch: JudgedBatch, kind: str, estimator: str, has_roll_rate: bool) -> bool:
    return (batch.estimator, batch.has_roll_rate) == (estimator, has_roll_rate) and kind in (batch.kind, ALL_KINDS)


def _judged(one: Judged, vehicle: Vehicle, kind: str, estimator: str, cg_m: float, has_roll_rate: bool) -> JudgedBatch:
    found = one.estimate
    payload_kg, share_pct = found.payload.number, found.front_share.number
    rejected = tuple(str(why) for why in found.rejected)
    if not rejected and not (np.isfinite(payload_kg) and np.isfinite(share_pct)):
        rejected = (HALF_AN_ANSWER,)
    is_rejected = bool(rejected)
    payload_width, payload_score = _interval(
        found.payload.interval95, one.payload_kg, vehicle.payload_range_kg, is_rejected
    )
    share_width, share_score = _interval(
        found.front_share.interval95, one.front_share_pct, vehicle.front_share_range_pct, is_rejected
    )
    cg_width_m, cg_score_m = _interval(found.cg_left.interval95, cg_m, (0.0, 100.0), is_rejected)
    return JudgedBatch(
        van=vehicle.name,
        run=f"{vehicle.name} {one.run}",
        kind=kind,
        estimator=estimator,
        rejected=rejected,
        payload_error_pct=_percent(payload_kg, one.payload_kg, vehicle.payload_range_kg, is_rejected),
        front_share_error_pct=_percent(share_pct, one.front_share_pct, vehicle.front_share_range_pct, is_rejected),
        is_payload_covered=_holds(found.payload.interval95, one.payload_kg),
        is_front_share_covered=_holds(found.front_share.interval95, one.front_share_pct),
        has_roll_rate=has_roll_rate,
        cg_left_error_m=found.cg_left.number - cg_m,
        is_cg_left_covered=_holds(found.cg_left.interval95, cg_m),
        payload_half_width_pct=payload_width,
        payload_score_pct=payload_score,
        front_share_half_width_pct=share_width,
        front_share_score_pct=share_score,
        cg_left_half_width_m=cg_width_m,
        cg_left_score_m=cg_score_m,
    )


def _interval(
    interval: tuple[float, float], true: float, full_range: tuple[float, float], is_rejected: bool
) -> tuple[float, float]:
    """Half-width and score in percent of the range; NaN for a rejected batch."""
    if is_rejected:
        return math.nan, math.nan
    percent = 100.0 / (full_range[1] - full_range[0])
    (score,) = interval_scores(np.array([true]), np.array(interval[:1]), np.array(interval[1:]))
    return 0.5 * (interval[1] - interval[0]) * percent, float(score) * percent


def _percent(found: float, true: float, full_range: tuple[float, float], is_rejected: bool) -> float:
    low, high = full_range
    answer = 0.5 * (low + high) if is_rejected else found
    return 100.0 * (answer - true) / (high - low)


def _holds(interval: tuple[float, float], true: float) -> bool:
    return bool(interval[0] <= true <= interval[1])


def _line(kind: str, estimator: str, has_roll_rate: bool, batches: Sequence[JudgedBatch]) -> Line:
    answered = [batch for batch in batches if not batch.is_rejected]
    placed = [batch for batch in answered if math.isfinite(batch.cg_left_error_m)]
    payload, share = (lambda b: b.is_payload_covered), (lambda b: b.is_front_share_covered)
    return Line(
        kind=kind,
        estimator=estimator,
        has_roll_rate=has_roll_rate,
        n_vans=len({batch.van for batch in batches}),
        n_runs=len({batch.run for batch in batches}),
        n_batches=len(batches),
        n_rejected=len(batches) - len(answered),
        rejected_by_reason=_counted([why for batch in batches for why in batch.rejected]),
        payload_mean_abs_pct=_mean_abs([batch.payload_error_pct for batch in answered]),
        payload_mean_abs_pct_with_misses=float(np.mean(np.abs([batch.payload_error_pct for batch in batches]))),
        payload_coverage=_coverage(answered, payload, lambda b: b.run),
        payload_coverage_by_van=_coverage(answered, payload, lambda b: b.van),
        front_share_mean_abs_pct=_mean_abs([batch.front_share_error_pct for batch in answered]),
        front_share_mean_abs_pct_with_misses=float(np.mean(np.abs([batch.front_share_error_pct for batch in batches]))),
        front_share_coverage=_coverage(answered, share, lambda b: b.run),
        front_share_coverage_by_van=_coverage(answered, share, lambda b: b.van),
        cg_left_mean_abs_mm=_mean_abs([1000.0 * batch.cg_left_error_m for batch in placed]),
        cg_left_coverage=_coverage(placed, lambda b: b.is_cg_left_covered, lambda b: b.run),
        payload_half_width_pct=_mean_known([batch.payload_half_width_pct for batch in answered]),
        payload_interval_score_pct=_mean_known([batch.payload_score_pct for batch in answered]),
        front_share_half_width_pct=_mean_known([batch.front_share_half_width_pct for batch in answered]),
        front_share_interval_score_pct=_mean_known([batch.front_share_score_pct for batch in answered]),
        cg_left_half_width_mm=_mean_known([1000.0 * batch.cg_left_half_width_m for batch in placed]),
        cg_left_interval_score_mm=_mean_known([1000.0 * batch.cg_left_score_m for batch in placed]),
    )


def _counted(reasons: Sequence[str]) -> dict[str, int]:
    return {why: reasons.count(why) for why in sorted({*reasons})}


def _mean_abs(errors_pct: Sequence[float]) -> float | None:
    return float(np.mean(np.abs(errors_pct))) if errors_pct else None


def _mean_known(numbers: Sequence[float]) -> float | None:
    """Mean over the known numbers; an answer without an interval has no width."""
    return _mean_abs([x for x in numbers if math.isfinite(x)])


def _coverage(
    answered: Sequence[JudgedBatch], is_covered: Callable[[JudgedBatch], bool], cluster: Callable[[JudgedBatch], str]
) -> Coverage | None:
    """None if fewer than two clusters were answered."""
    clusters = [cluster(batch) for batch in answered]
    return coverage_of([is_covered(batch) for batch in answered], clusters) if len({*clusters}) > 1 else None
