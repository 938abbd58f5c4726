"""Fit for use or not: rules over the errors found, none of them looking at a load's name.

docs/calibration.md lists them. A calibration is as good as the worst rule says of it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from gateway.calibration.calibrate import Outcome
from gateway.calibration.inspection.finding import RunVerdict, Severity
from gateway.calibration.judgement.coverage import PROMISED, coverage_of
from gateway.calibration.judgement.evaluation import Judged
from gateway.calibration.judgement.evidence import PART_NAMES, Evidence, Judgement, Part
from gateway.calibration.plan.plan import Expected
from gateway.config import ESTIMATOR_NAMES
from gateway.core.vehicle import Vehicle
from gateway.words import counted

FIT_ERROR_PCT: Final = 10.0  # of the range (12)
MOST_ERROR_PCT: Final = 20.0  # a guess at mid-range errs by 25 % over evenly spread loads
LEAST_COVERAGE: Final = 0.7  # intervals of 95 % that surely hold the truth less often mislead
FEW_REJECTED: Final = 0.2
MOST_REJECTED: Final = 0.5
VALIDATION_FACTOR: Final = 2.0  # validation errors beyond this many times those of runs left out
VALIDATION_LEAST_PCT: Final = 2.0  # below this, a factor says nothing


class Grade(StrEnum):
    """From good to bad."""

    FIT = "fit"
    RESERVED = "fit_with_reservations"
    UNFIT = "not_fit"

    @property
    def rank(self) -> int:
        """0 is best."""
        return list(Grade).index(self)


@dataclass(frozen=True, slots=True)
class Reason:
    """What one rule says."""

    rule: str
    grade: Grade
    text: str


@dataclass(frozen=True, slots=True)
class Verdict:
    """One estimator's reasons, as many as there are rules that apply."""

    estimator: str
    reasons: tuple[Reason, ...]

    @property
    def grade(self) -> Grade:
        """The worst of the reasons."""
        return max((reason.grade for reason in self.reasons), key=lambda grade: grade.rank, default=Grade.RESERVED)


def verdicts_of(evidence: Evidence, expected: Expected | None = None) -> tuple[Verdict, ...]:
    """A verdict for every estimator judged, the best first: by grade, then by payload error.

    ``expected`` is what the half-car states of itself over all the loads that the vehicle carries.
    """
    found = [
        (_verdict(evidence, judgement, expected), _unseen_error_pct(judgement)) for judgement in evidence.judgements
    ]
    return tuple(verdict for verdict, _ in sorted(found, key=lambda each: (each[0].grade.rank, each[1])))


def _unseen_error_pct(judgement: Judgement) -> float:
    error = judgement.tables[judgement.unseen]["payload"]["mean_abs_pct_with_misses"] if judgement.unseen else None
    return float("inf") if error is None else float(error)


def _verdict(evidence: Evidence, judgement: Judgement, expected: Expected | None) -> Verdict:
    driven = [_runs(evidence.outcome.verdicts), *_campaign(evidence.outcome)] if evidence.outcome else []
    stated = _stated(expected, evidence.vehicle) if expected and judgement.estimator == "cross_spectrum" else None
    reasons = [*_errors_and_intervals(judgement), stated, *driven, *_warnings(evidence, judgement.estimator)]
    return Verdict(judgement.estimator, tuple(reason for reason in reasons if reason is not None))


def _errors_and_intervals(judgement: Judgement) -> list[Reason | None]:
    part = judgement.unseen
    if part is None:
        return [_nothing_unseen()]
    table, judged = judgement.tables[part], judgement.judged[part]
    return [
        *(_error(table, part, quantity) for quantity in _NAMES),
        *(_coverage(judged, part, quantity) for quantity in _NAMES),
        _answered(table, part),
        _agreement(table, judgement.tables[Part.VALIDATION])
        if part is Part.LEFT_OUT and Part.VALIDATION in judgement.tables
        else None,
    ]


def _nothing_unseen() -> Reason:
    return Reason(
        "unseen", Grade.RESERVED, "Nothing was held back to judge by: fewer than three runs and no validation part."
    )


def _graded(figure: float, fit: float, most: float) -> Grade:
    return Grade.FIT if figure <= fit else Grade.RESERVED if figure <= most else Grade.UNFIT


def _error(table: Mapping[str, Any], part: Part, quantity: str) -> Reason:
    errors, name, unit = table[quantity], *_NAMES[quantity]
    if errors["mean_abs_pct"] is None:
        grade = Grade.UNFIT if quantity == "payload" else Grade.RESERVED
        return Reason(f"{quantity}_error", grade, f"No {name} was answered over the {PART_NAMES[part]}.")
    percent = float(errors["mean_abs_pct_with_misses"])
    missed = ", batches without an answer counted as guesses at mid-range" if table["n_rejected"] else ""
    return Reason(
        f"{quantity}_error",
        _graded(percent, FIT_ERROR_PCT, MOST_ERROR_PCT),
        f"Mean error of {name} over the {PART_NAMES[part]}: {errors[f'mean_abs_{unit}']:.3g} {unit}, {percent:.1f} % "
        f"of the range{missed} (fit to {FIT_ERROR_PCT:g} %, no use beyond {MOST_ERROR_PCT:g} %).",
    )


_NAMES: Final = {"payload": ("payload", "kg"), "front_share": ("front share", "pp")}


def _coverage(judged: Sequence[Judged], part: Part, quantity: str) -> Reason | None:
    """By the limits of the coverage, for a few runs tell little; None where there are fewer than two."""
    covered = [(hit, one.run) for one in judged if (hit := is_covered(one, quantity)) is not None]
    if len({run for _, run in covered}) < 2:
        return None
    found = coverage_of([hit for hit, _ in covered], [run for _, run in covered])
    return Reason(
        f"{quantity}_coverage",
        _graded(-found.high, -PROMISED[0], -LEAST_COVERAGE),
        f"95 % intervals of {_NAMES[quantity][0]} hold the truth in {100.0 * found.share:.0f} % of the batches of "
        f"{PART_NAMES[part]}; what {found.n_clusters} runs can tell of it is {100.0 * found.low:.0f} to "
        f"{100.0 * found.high:.0f} %.",
    )


def is_covered(one: Judged, quantity: str) -> bool | None:
    """Whether the 95 % interval of "payload" or "front_share" holds the truth; None where there is none."""
    is_payload = quantity == "payload"
    truth = one.payload_kg if is_payload else one.front_share_pct
    low, high = one.estimate.payload_interval95_kg if is_payload else one.estimate.front_share_interval95_pct
    return low <= truth <= high if low <= high else None  # NaN is no interval


def _stated(expected: Expected, vehicle: Vehicle) -> Reason:
    """The loads driven may be few and near; this is of all. A normal error is sqrt(2 / pi) sigma on average."""
    low_kg, high_kg = vehicle.payload_range_kg
    percent = 100.0 * math.sqrt(2.0 / math.pi) * expected.payload_std_kg / (high_kg - low_kg)
    return Reason(
        "stated_spread",
        _graded(percent, FIT_ERROR_PCT, MOST_ERROR_PCT),
        f"Over all loads that the vehicle may carry it states ± {expected.payload_std_kg:.0f} kg (standard deviation), "
        f"a mean error of {percent:.1f} % of the range.",
    )


def _answered(table: Mapping[str, Any], part: Part) -> Reason:
    share = table["n_rejected"] / table["n_batches"] if table["n_batches"] else 1.0
    return Reason(
        "answered",
        _graded(share, FEW_REJECTED, MOST_REJECTED),
        f"{table['n_rejected']} of {table['n_batches']} batches of the {PART_NAMES[part]} gave no answer"
        + "".join(f", {why} {n}" for why, n in table["rejected_by_reason"].items()) + ".",
    )  # fmt: skip


def _agreement(left_out: Mapping[str, Any], validation: Mapping[str, Any]) -> Reason | None:
    """Validation knows its loads; if it errs more than runs left out do, something other than the load changed."""
    expected, found = (table["payload"]["mean_abs_pct_with_misses"] for table in (left_out, validation))
    if expected is None or found is None:
        return None
    is_worse = found > VALIDATION_LEAST_PCT and found > VALIDATION_FACTOR * expected
    text = f"Payload errors of the validation part, {found:.1f} %, against {expected:.1f} % of runs left out"
    if not is_worse:
        return Reason("agreement", Grade.FIT, f"{text}: as expected.")
    return Reason("agreement", Grade.RESERVED, f"{text}: something other than the load changed between the two.")


_WARNING_TEXT: Final[Mapping[str, str]] = {
    "springs_from_priors": "Only one load was driven: it sets the zero, and springs are taken from what vehicles "
    "usually have. Weights away from that load are as uncertain as their intervals say.",
    "intervals_untested": "Fewer than three runs: intervals were widened by a rule of thumb, not tested.",
}


def _warnings(evidence: Evidence, estimator: str) -> list[Reason]:
    """Those of the file, but for what was said of another estimator or is told from the drives themselves."""
    others = tuple(f"{name}: " for name in ESTIMATOR_NAMES if name != estimator)
    findings = evidence.outcome.campaign_findings if evidence.outcome else ()
    told = tuple(f"{finding.kind}: " for finding in findings) + (("run ",) if evidence.outcome else ())
    left_over = [one for one in evidence.file.warnings if not one.startswith((*others, *told))]
    return [Reason("warning", Grade.RESERVED, _WARNING_TEXT.get(one, one)) for one in left_over]


def _campaign(outcome: Outcome) -> list[Reason]:
    return [
        Reason(str(finding.kind), Grade.RESERVED, f"{finding.kind.replace('_', ' ').capitalize()}: {finding.text}.")
        for finding in outcome.campaign_findings
        if finding.severity is not Severity.NOTE
    ]


def _runs(verdicts: Sequence[RunVerdict]) -> Reason | None:
    if not verdicts:
        return None
    unusable = [one.number for one in verdicts if not one.is_usable]
    doubtful = [one.number for one in verdicts if one.is_usable and _has_warning(one)]
    if unusable:
        grade = Grade.UNFIT if 2 * len(unusable) > len(verdicts) else Grade.RESERVED
        return Reason("runs", grade, f"Of {counted(len(verdicts), 'run')} cannot be used: {_listed(unusable)}.")
    if doubtful:
        return Reason("runs", Grade.RESERVED, f"Of {counted(len(verdicts), 'run')} want a look: {_listed(doubtful)}.")
    return Reason("runs", Grade.FIT, f"Without a fault: {counted(len(verdicts), 'run')}, all there are.")


def _has_warning(verdict: RunVerdict) -> bool:
    return any(finding.severity is Severity.WARNING for finding in verdict.findings)


def _listed(numbers: Sequence[int]) -> str:
    return ", ".join(f"run {number}" for number in numbers)
