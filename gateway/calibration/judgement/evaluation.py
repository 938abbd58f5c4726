"""The error table of equation (12): estimates compared with weighed loads; what is unknown is left out."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from math import hypot, isfinite, nan
from typing import Any, Final, Literal, NamedTuple, get_args

import numpy as np

from gateway.calibration.judgement.coverage import interval_scores
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.cargo import is_said
from gateway.core.vehicle import Vehicle, cg_left_m
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung, weighed, weights_of
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate, Quantity
from gateway.estimates.budget import budget_of
from gateway.estimates.posterior import Source, exactly
from gateway.records import F64, Batch, Why
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.weighing.estimator import estimate

Target = Literal["payload", "front_share"]
TARGETS: Final[tuple[Target, ...]] = get_args(Target)
WHEELS: Final = ("front_left", "front_right", "rear_left", "rear_right")


class Comparison(NamedTuple):
    """A quantity's truth, its estimate and the 95 % interval [low, high]: kg or percent, NaN if unknown."""

    true: float
    estimated: float
    low: float
    high: float

    def is_covered(self, doubt: float = 0.0) -> bool | None:
        """Whether the interval contains the truth, which is known to within ``doubt`` (half a 95 % interval); None if
        either is unknown.
        """
        if not (self.low <= self.high and isfinite(self.true)):
            return None
        below, above = hypot(self.estimated - self.low, doubt), hypot(self.high - self.estimated, doubt)
        return self.estimated - below <= self.true <= self.estimated + above


@dataclass(frozen=True, slots=True)
class Judged:
    """One batch of a drive: what was estimated, and what was true.

    cg_left_m is the sprung mass's centre of gravity left of the centre line, NaN if not stated; unsprung is what
    calibration found.
    """

    drive: StatedDrive
    estimate: Estimate
    cg_left_m: float = nan
    unsprung: Unsprung = NOT_CALIBRATED

    def is_covered(self, target: Target) -> bool | None:
        """Whether the interval of one quantity contains the truth; None if either is unknown."""
        doubt_kg = self.drive.statement.payload_plus_minus_kg
        return self.compared(target).is_covered(doubt_kg if target == "payload" else 0.0)

    def compared(self, target: Target) -> Comparison:
        """Truth and estimate of one of the two quantities."""
        told = self.estimate
        if target == "payload":
            return Comparison(self.drive.payload_kg, told.payload.number, *told.payload.interval95)
        return Comparison(self.drive.front_share_pct, told.front_share.number, *told.front_share.interval95)

    @property
    def cg_left(self) -> Comparison:
        """The centre of gravity's lateral position in m, truth and estimate."""
        return Comparison(self.cg_left_m, self.estimate.cg_left.number, *self.estimate.cg_left.interval95)

    def wheels_off_pct(self, vehicle: Vehicle) -> F64:
        """(4,) errors of the wheels' loads in percent of the gross weight; NaN where either is unknown.

        A campaign does not state how the axles divide a sideways moment, and some do not state the unsprung masses: the
        truth takes both from the estimate, so their errors are in neither.
        """
        roll_share = Quantity(self.estimate.roll_share_front, 0.0)
        truth = exactly(self.drive.payload_kg, self.drive.front_share_pct, self.cg_left_m)
        true = weights_of(vehicle, truth, roll_share, self.unsprung)
        off_kg = [getattr(self.estimate.weights, wheel).kg - getattr(true, wheel).kg for wheel in WHEELS]
        return np.array(off_kg) / true.gross.kg * 100.0


@dataclass(frozen=True, slots=True)
class TargetErrors:
    """(12) for one quantity: in percent of its range, and in ``unit``. None without an estimate.

    In ``mean_abs_pct_with_misses`` a rejected batch scores as if it had answered mid-range; ``mean_abs_pct_of_gross``
    is of payload alone, in percent of the loaded vehicle's mass. ``half_width_pct`` is the mean of half the 95 %
    intervals, ``interval_score_pct`` that of their scores (judgement.coverage).
    """

    unit: Literal["kg", "pp"]
    mean_abs_pct: float | None
    mean_abs_pct_with_misses: float | None
    bias_pct: float | None
    std_pct: float | None
    max_abs_pct: float | None
    mean_abs: float | None
    bias: float | None
    std: float | None
    max_abs: float | None
    coverage95: float | None
    half_width_pct: float | None = None
    interval_score_pct: float | None = None
    mean_abs_pct_of_gross: float | None = None

    def to_json(self) -> dict[str, float | None]:
        """The object that ``evaluate --json`` prints for one quantity: names without a unit get this one."""
        figures = {name: figure for name, figure in asdict(self).items() if name != "unit"}
        if self.unit != "kg":
            del figures["mean_abs_pct_of_gross"]
        in_unit = ("mean_abs", "bias", "std", "max_abs")
        return {f"{name}_{self.unit}" if name in in_unit else name: figure for name, figure in figures.items()}


@dataclass(frozen=True, slots=True)
class CgLeftErrors:
    """Errors of the centre of gravity's lateral position, in m. None without an estimate."""

    mean_abs_m: float | None
    bias_m: float | None
    std_m: float | None
    max_abs_m: float | None
    coverage95: float | None
    half_width_m: float | None = None
    interval_score_m: float | None = None


@dataclass(frozen=True, slots=True)
class WheelErrors:
    """Errors of the four wheels' loads in percent of the gross weight. None if they are not known."""

    mean_abs_pct_of_gross: float | None
    max_abs_pct_of_gross: float | None


@dataclass(frozen=True, slots=True)
class Errors:
    """(12) over complete batches: pieces shorter than a window at the end of a run are no batches and not counted.

    cg_left is None if no lateral position was stated, wheels if their loads are not known.
    """

    n_batches: int
    n_rejected: int
    rejected_by_reason: dict[str, int]
    payload: TargetErrors
    front_share: TargetErrors
    cg_left: CgLeftErrors | None = None
    wheels: WheelErrors | None = None

    @property
    def answered(self) -> str:
        """The number of answered batches for people: "7 of 9"."""
        return f"{self.n_batches - self.n_rejected} of {self.n_batches}"

    def of(self, target: Target) -> TargetErrors:
        """The errors of one quantity."""
        return self.payload if target == "payload" else self.front_share

    def to_json(self) -> dict[str, Any]:
        """Figures that ``evaluate --json`` prints of all batches, and of each run."""
        return {
            "n_batches": self.n_batches,
            "n_rejected": self.n_rejected,
            "rejected_by_reason": self.rejected_by_reason,
            "payload": self.payload.to_json(),
            "front_share": self.front_share.to_json(),
            "cg_left": asdict(self.cg_left) if self.cg_left else None,
            "wheels": asdict(self.wheels) if self.wheels else None,
        }


@dataclass(frozen=True, slots=True)
class ErrorTable:
    """Errors of one estimator over all batches and, in ``runs``, of each run beside one batch that tells its truth."""

    estimator: str
    judged: tuple[Judged, ...]
    errors: Errors
    runs: tuple[tuple[Judged, Errors], ...]

    def to_json(self) -> dict[str, Any]:
        """The object that ``evaluate --json`` prints."""
        batches = [{**_truth(one), **estimate_to_json(one.estimate)} for one in self.judged]
        for record in batches:
            record.pop("spectra", None)
        return {
            "estimator": self.estimator,
            **self.errors.to_json(),
            "runs": [{**_truth(first), **errors.to_json()} for first, errors in self.runs],
            "batches": batches,
        }


def error_table(judged: Sequence[Judged], vehicle: Vehicle, estimator: str) -> ErrorTable:
    """(12) over everything judged and run by run."""
    by_run: dict[int, list[Judged]] = {}
    for one in judged:
        by_run.setdefault(one.drive.number, []).append(one)
    runs = tuple((of_run[0], errors_of(of_run, vehicle)) for of_run in by_run.values())
    return ErrorTable(estimator, tuple(judged), errors_of(judged, vehicle), runs)


def errors_of(judged: Sequence[Judged], vehicle: Vehicle) -> Errors:
    """(12) in percent of the vehicle's ranges: mean |e|, bias, std, max and 95 % coverage."""
    whole = [one for one in judged if Why.TOO_SHORT not in one.estimate.rejected]
    reasons = [str(why) for one in whole for why in one.estimate.rejected]
    payload = np.array([one.compared("payload") for one in whole], dtype=float).reshape(-1, 4)
    share = np.array([one.compared("front_share") for one in whole], dtype=float).reshape(-1, 4)
    cg_left = np.array([one.cg_left for one in whole], dtype=float).reshape(-1, 4)
    wheels_pct = np.array([one.wheels_off_pct(vehicle) for one in whole]).reshape(-1, len(WHEELS))
    wheels_pct = np.abs(wheels_pct[np.isfinite(wheels_pct).all(axis=1)])
    unloaded_kg = vehicle.empty_mass_kg + (vehicle.unsprung_front_kg or 0.0) + (vehicle.unsprung_rear_kg or 0.0)
    return Errors(
        n_batches=len(whole),
        n_rejected=sum(not one.estimate.counted for one in whole),
        rejected_by_reason={why: reasons.count(why) for why in sorted(set(reasons))},
        payload=_target_errors(payload, vehicle.payload_range_kg, "kg", unloaded_kg=unloaded_kg),
        front_share=_target_errors(share, vehicle.front_share_range_pct, "pp"),
        cg_left=_cg_left_errors(cg_left),
        wheels=WheelErrors(float(np.mean(wheels_pct)), float(np.max(wheels_pct))) if wheels_pct.size else None,
    )


def _target_errors(
    compared: F64, full_range: tuple[float, float], unit: Literal["kg", "pp"], unloaded_kg: float | None = None
) -> TargetErrors:
    """The errors of the rows (n, 4) of Comparison whose truth is known."""
    low, high = full_range
    compared = compared[np.isfinite(compared[:, 0])]
    answered = np.isfinite(compared[:, 1])
    true, estimated, lower, upper = compared[answered].T
    error = estimated - true
    missed = 0.5 * (low + high) - compared[~answered, 0]
    percent = 100.0 / (high - low)
    return TargetErrors(
        unit,
        **_spread(error * percent, "_pct"),
        **_spread(error),
        mean_abs_pct_with_misses=_mean(np.abs(np.r_[error, missed]) * percent),
        coverage95=_mean(((lower <= true) & (true <= upper)).astype(float)),
        mean_abs_pct_of_gross=None if unloaded_kg is None else _mean(100.0 * np.abs(error) / (unloaded_kg + true)),
        half_width_pct=_mean(0.5 * (upper - lower) * percent),
        interval_score_pct=_mean(interval_scores(true, lower, upper) * percent),
    )


def _cg_left_errors(compared: F64) -> CgLeftErrors | None:
    """The errors of the rows (n, 4) of Comparison; None if no truth is known."""
    known = compared[np.isfinite(compared[:, 0])]
    if not len(known):
        return None
    true, estimated, low, high = known[np.isfinite(known[:, 1])].T
    return CgLeftErrors(
        **_spread(estimated - true, "_m"),
        coverage95=_mean(((low <= true) & (true <= high)).astype(float)),
        half_width_m=_mean(0.5 * (high - low)),
        interval_score_m=_mean(interval_scores(true, low, high)),
    )


def _spread(error: F64, unit: str = "") -> dict[str, float | None]:
    """Statistics of errors (n,), their names ending in ``unit``; None without any."""
    size = np.abs(error)
    found = {
        "mean_abs": _mean(size),
        "bias": _mean(error),
        "std": float(np.std(error)) if error.size else None,
        "max_abs": float(np.max(size)) if error.size else None,
    }
    return {f"{name}{unit}": figure for name, figure in found.items()}


def _mean(x: F64) -> float | None:
    return float(np.mean(x)) if x.size else None


def _truth(one: Judged) -> dict[str, int | float | str | None]:
    return {
        "run": one.drive.number,
        "log": one.drive.log,
        "true_payload_kg": _known(one.drive.payload_kg),
        "true_front_share_pct": _known(one.drive.front_share_pct),
        "true_cg_left_m": _known(one.cg_left_m),
    }


def _known(number: float) -> float | None:
    return number if isfinite(number) else None


def judge(runs: Iterable[StatedDrive], calibrated: CalibratedVehicle, estimator: str) -> list[Judged]:
    """Every batch of every run with its estimate."""
    return [
        Judged(
            run,
            weighed(_budgeted(batch, calibrated, estimator), calibrated.vehicle, calibrated.unsprung),
            _noted_cg_left_m(run, calibrated.vehicle),
            calibrated.unsprung,
        )
        for run in runs
        for batch in run.batches
    ]


def _budgeted(batch: Batch, calibrated: CalibratedVehicle, estimator: str) -> Estimate:
    """The estimate with its error budget. Known loads are placed by the stated front share of the empty vehicle: its
    error is in both and cancels.
    """
    found = estimate(batch, calibrated, estimator)
    if found.posterior is None:
        return found
    beside_known = found.posterior.without(Source.EMPTY_SHARE)
    budget = budget_of(beside_known, is_shape_said=is_said(calibrated.vehicle))
    return replace(found.answered(beside_known), error_budget=budget)


def _noted_cg_left_m(run: StatedDrive, vehicle: Vehicle) -> float:
    """An empty vehicle's is the one that the campaign states; NaN for a load without a stated position."""
    left_m = run.statement.left_m
    if run.payload_kg > 0.0 and left_m is None:
        return nan
    return cg_left_m(vehicle, run.payload_kg, left_m or 0.0)
