"""Fit for use or not: rules over the errors; none of them depends on a load's name.

docs/calibration.md lists them. A calibration is as good as its worst rule.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from statistics import fmean
from typing import Final

import numpy as np
from scipy.special import gammainc

from gateway.budget import BudgetLine, typical_budget
from gateway.calibration.calibrate import Outcome
from gateway.calibration.inspection.finding import Kind, RunVerdict, Severity
from gateway.calibration.judgement.assessment import PART_NAMES, Assessment, BatchSet, Judgement
from gateway.calibration.judgement.coverage import PROMISED, coverage_of
from gateway.calibration.judgement.evaluation import TARGETS, Errors, Judged, Target, TargetErrors
from gateway.calibration.plan.plan import Expected, LoadPlan
from gateway.calibration.plan.words import best_next
from gateway.config import ESTIMATOR_NAMES
from gateway.core.vehicle import Vehicle
from gateway.estimate import Z95
from gateway.posterior import FRONT_SHARE, PAYLOAD, Source
from gateway.reasons import REMEDIES, SOURCES
from gateway.words import counted, decimal, estimator_name

FIT_ERROR_PCT: Final = 10.0  # chosen: of the range (12)
MOST_ERROR_PCT: Final = 20.0  # chosen: of the range; a guess at mid-range errs by 25 % over evenly spread loads
FIT_HALF_WIDTH_PCT: Final = 25.0  # chosen: of the range, half a 95 % interval for a mean normal error of FIT_ERROR_PCT
MOST_HALF_WIDTH_PCT: Final = 50.0  # chosen: likewise for MOST_ERROR_PCT, when the interval is as wide as the range
LEAST_COVERAGE: Final = 0.7  # chosen: 95 % intervals with certainly less coverage mislead
TOO_WIDE: Final = 1e-3  # chosen: probability of so small errors with correct intervals (chi-squared over runs)
FEW_REJECTED: Final = 0.2  # chosen: of the batches
MOST_REJECTED: Final = 0.5  # chosen: of the batches
VALIDATION_FACTOR: Final = 2.0  # chosen: largest ratio of validation errors to those of runs left out
VALIDATION_LEAST_PCT: Final = 2.0  # chosen: below this error a ratio is meaningless


class Grade(StrEnum):
    """From good to bad."""

    FIT = "fit"
    RESERVED = "fit_with_reservations"
    UNFIT = "not_fit"

    @property
    def rank(self) -> int:
        """0 is best."""
        return list(Grade).index(self)


GRADE_TEXT: Final[Mapping[Grade, str]] = {
    Grade.FIT: "Fit for use",
    Grade.RESERVED: "Fit for use with reservations",
    Grade.UNFIT: "Not fit for use",
}


@dataclass(frozen=True, slots=True)
class Reason:
    """The result of one rule."""

    rule: str
    grade: Grade
    text: str


@dataclass(frozen=True, slots=True)
class Verdict:
    """One estimator's reasons, one for each applicable rule."""

    estimator: str
    reasons: tuple[Reason, ...]

    @property
    def grade(self) -> Grade:
        """The worst of the reasons."""
        return max((reason.grade for reason in self.reasons), key=lambda grade: grade.rank, default=Grade.RESERVED)


@dataclass(frozen=True, slots=True)
class Width:
    """Mean half-width of 95 % intervals over batches, in ``unit`` and percent of the range; ``cause`` is the largest
    source of the error, None if the estimates have no budget.
    """

    target: Target
    half: float
    unit: str
    percent: float
    cause: BudgetLine | None

    @property
    def is_fit(self) -> bool:
        """Whether intervals are narrow enough to plan with."""
        return self.percent <= FIT_HALF_WIDTH_PCT

    @property
    def is_of_use(self) -> bool:
        """Whether intervals are narrower than the range itself."""
        return self.percent <= MOST_HALF_WIDTH_PCT

    @property
    def judged(self) -> str:
        """The judgement in a word or two."""
        return "fit" if self.is_fit else "wide" if self.is_of_use else "too wide to be of use"

    @property
    def sentence(self) -> str:
        """The judgement with the main cause and its remedy."""
        said = (
            f"95 % intervals of {self.target.replace('_', ' ')} are ± {self.half:.3g} {self.unit} on average, "
            f"{self.percent:.0f} % of the range: {self.judged} (fit to {FIT_HALF_WIDTH_PCT:g} %, no use beyond "
            f"{MOST_HALF_WIDTH_PCT:g} %)."
        )
        if self.cause is None:
            return said
        source = SOURCES.get(self.cause.source, self.cause.source)
        return f"{said} Mostly due to {source}{self._remedy(self.cause)}."

    def _remedy(self, cause: BudgetLine) -> str:
        """What narrows it; how far is known for the payload only."""
        if cause.remedy is None:
            return ""
        after = f" (then ± {Z95 * cause.payload_with_remedy_kg:.0f} kg)" if self.target == "payload" else ""
        return f": {REMEDIES[cause.remedy]}{after}"


def width_of(judged: Sequence[Judged], errors: TargetErrors, target: Target) -> Width | None:
    """None if no batch was answered with an interval."""
    halves = [
        0.5 * (compared.high - compared.low)
        for compared in (one.compared(target) for one in judged)
        if compared.low <= compared.high
    ]
    if not halves or errors.half_width_pct is None:
        return None
    budgets = [one.estimate.error_budget for one in judged if one.estimate.error_budget]
    lines = typical_budget(budgets) if budgets else ()
    cause = max(lines, key=lambda line: line.payload_kg if target == "payload" else line.front_share_pct, default=None)
    return Width(target, float(np.mean(halves)), errors.unit, errors.half_width_pct, cause)


def verdicts_of(assessment: Assessment, expected: Expected | None = None) -> tuple[Verdict, ...]:
    """A verdict for every estimator judged, first that of the one which the service runs by default.

    ``expected`` is the half-car's own prediction over all the loads that the vehicle carries.
    """
    in_order = sorted(assessment.judgements, key=lambda one: ESTIMATOR_NAMES.index(one.estimator))
    return tuple(_verdict(assessment, one, expected) for one in in_order)


@dataclass(frozen=True, slots=True)
class Summary:
    """The verdict for a fitter: how good the estimator is that the service runs, and what would narrow its answers.

    ``next_run`` is None without a plan.
    """

    verdict: Verdict
    accuracy: str
    next_run: str | None

    @property
    def text(self) -> str:
        """A few lines: the grade, the accuracy, the reasons for a grade below fit, and the run to drive next."""
        reasons = [one.text for one in self.verdict.reasons if one.grade is not Grade.FIT]
        return "\n".join(
            [
                f"{GRADE_TEXT[self.verdict.grade]}, by the {estimator_name(self.verdict.estimator)}. {self.accuracy}",
                *(f"    {reason}" for reason in reasons),
                *([f"What to drive next: {self.next_run}"] if self.next_run else []),
            ]
        )


def summary_of(assessment: Assessment, verdicts: Sequence[Verdict], plan: LoadPlan | None) -> Summary:
    """The first of ``verdicts_of`` in short."""
    running = verdicts[0]
    judgement = next(one for one in assessment.judgements if one.estimator == running.estimator)
    return Summary(running, _accuracy(judgement), best_next(plan) if plan else None)


def _accuracy(judgement: Judgement) -> str:
    if judgement.unseen is None:
        return "How well it weighs is not known: no data were kept aside to judge by."
    errors = judgement.tables[judgement.unseen].errors
    payload, share = errors.payload, errors.front_share
    return (
        f"Over the {PART_NAMES[judgement.unseen]} it weighs payloads to {decimal(payload.mean_abs, ' kg', 1)} on "
        f"average and {decimal(payload.max_abs, ' kg', 1)} at worst, front shares to "
        f"{decimal(share.mean_abs, ' pp')} and {decimal(share.max_abs, ' pp')}."
    )


def _verdict(assessment: Assessment, judgement: Judgement, expected: Expected | None) -> Verdict:
    reasons = list(_errors_and_intervals(judgement))
    if expected and judgement.estimator == "cross_spectrum":
        reasons.append(_stated(expected, assessment.vehicle))
    if judgement.estimator == "cross_spectrum":
        reasons += _inherited(assessment)
    if assessment.outcome:
        verdicts = assessment.outcome.inspection.verdicts
        reasons += [*_runs(verdicts), *_labels(verdicts), *_campaign(assessment.outcome)]
        reasons += [Reason("facts", Grade.UNFIT, _sentence(one.sentence)) for one in assessment.outcome.doubts]
    return Verdict(judgement.estimator, (*reasons, *_warnings(assessment, judgement.estimator)))


def _errors_and_intervals(judgement: Judgement) -> Iterator[Reason]:
    part = judgement.unseen
    if part is None:
        text = "No data were kept aside to judge by: fewer than three runs and no validation part."
        yield Reason("unseen", Grade.RESERVED, text)
        return
    table = judgement.tables[part]
    yield from (_error(table.errors, part, target) for target in TARGETS)
    for target in TARGETS:
        yield from _coverage(table.judged, part, target)
        yield from _half_width(width_of(table.judged, table.errors.of(target), target))
        yield from _width(table.judged, part, target)
    yield _answered(table.errors, part)
    if part is BatchSet.LEFT_OUT and BatchSet.VALIDATION in judgement.tables:
        yield from _agreement(table.errors.payload, judgement.tables[BatchSet.VALIDATION].errors.payload)


def _inherited(assessment: Assessment) -> Iterator[Reason]:
    """The loads' effect is inherited from a sister and accepted, but no load of its own has confirmed
    it yet.
    """
    file = assessment.file
    if file.sister_id is None or len({run.payload_kg for run in file.provenance.runs}) > 1:
        return
    text = (
        "Only one load was driven: the effect of others was inherited from a sister. One known load, weighed, confirms "
        "it for this vehicle."
    )
    yield Reason("inherited", Grade.RESERVED, text)


def _graded(figure: float, fit: float, most: float) -> Grade:
    return Grade.FIT if figure <= fit else Grade.RESERVED if figure <= most else Grade.UNFIT


def _error(errors: Errors, part: BatchSet, target: Target) -> Reason:
    rule, name, of_target = f"{target}_error", target.replace("_", " "), errors.of(target)
    percent = of_target.mean_abs_pct_with_misses
    if of_target.mean_abs is None or percent is None:
        grade = Grade.UNFIT if target == "payload" else Grade.RESERVED
        return Reason(rule, grade, f"No {name} was answered over the {PART_NAMES[part]}.")
    missed = ", batches without an answer counted as guesses at mid-range" if errors.n_rejected else ""
    return Reason(
        rule,
        _graded(percent, FIT_ERROR_PCT, MOST_ERROR_PCT),
        f"Mean error of {name} over the {PART_NAMES[part]}: {of_target.mean_abs:.3g} {of_target.unit}, "
        f"{percent:.1f} % of the range{missed} (fit to {FIT_ERROR_PCT:g} %, no use beyond {MOST_ERROR_PCT:g} %).",
    )


def _coverage(judged: Sequence[Judged], part: BatchSet, target: Target) -> Iterator[Reason]:
    """The verdict by the limits of the coverage, because few runs determine it poorly; empty with fewer than two
    runs.
    """
    covered = [(hit, one.run) for one in judged if (hit := one.compared(target).is_covered) is not None]
    if len({run for _, run in covered}) < 2:
        return
    coverage = coverage_of([hit for hit, _ in covered], [run for _, run in covered])
    yield Reason(
        f"{target}_coverage",
        _graded(-coverage.high, -PROMISED[0], -LEAST_COVERAGE),
        f"95 % intervals of {target.replace('_', ' ')} contain the truth in {100.0 * coverage.share:.0f} % of the "
        f"batches of {PART_NAMES[part]}; {coverage.n_clusters} runs determine it to {100.0 * coverage.low:.0f} to "
        f"{100.0 * coverage.high:.0f} %.",
    )


def _half_width(width: Width | None) -> Iterator[Reason]:
    """Intervals that are valid but include nearly every load are of no use."""
    if width is not None:
        grade = Grade.FIT if width.is_fit else Grade.RESERVED if width.is_of_use else Grade.UNFIT
        yield Reason(f"{width.target}_half_width", grade, width.sentence)


def _width(judged: Sequence[Judged], part: BatchSet, target: Target) -> Iterator[Reason]:
    """Errors far smaller than stated. Batches of one run count as one.

    The errors are compared with the variance that a campaign can show: it has one day, one sensor and its own shape of
    load.
    """
    entry = {"payload": PAYLOAD, "front_share": FRONT_SHARE}[target]
    by_run: dict[int, list[float]] = {}
    for one in judged:
        if (stated := one.estimate.posterior) is not None:
            compared = one.compared(target)
            std = stated.without(Source.DAY, Source.SENSOR, Source.GOODS, Source.LOAD_LENGTH).std(entry)
            by_run.setdefault(one.run, []).append(((compared.estimated - compared.true) / std) ** 2)
    if len(by_run) < 2:
        return
    squared = sum(fmean(of_run) for of_run in by_run.values())
    is_wide = gammainc(0.5 * len(by_run), 0.5 * squared) < TOO_WIDE
    yield Reason(
        f"{target}_width",
        Grade.RESERVED if is_wide else Grade.FIT,
        f"Errors of {target.replace('_', ' ')} over the {PART_NAMES[part]} are {math.sqrt(squared / len(by_run)):.2f} "
        "times the standard deviation stated without day, sensor and shape of load; 1 is right"
        + (": intervals are wider than they need be." if is_wide else "."),
    )


def _stated(expected: Expected, vehicle: Vehicle) -> Reason:
    """Accuracy over all possible loads, as those driven may be few and similar. The mean absolute normal error is
    sqrt(2 / pi) sigma.
    """
    low_kg, high_kg = vehicle.payload_range_kg
    percent = 100.0 * math.sqrt(2.0 / math.pi) * expected.payload_std_kg / (high_kg - low_kg)
    return Reason(
        "stated_spread",
        _graded(percent, FIT_ERROR_PCT, MOST_ERROR_PCT),
        f"Over all loads that the vehicle may carry it states ± {Z95 * expected.payload_std_kg:.0f} kg (95 %), "
        f"a mean error of {percent:.1f} % of the range.",
    )


def _answered(errors: Errors, part: BatchSet) -> Reason:
    share = errors.n_rejected / errors.n_batches if errors.n_batches else 1.0
    reasons = "".join(f", {why} {n}" for why, n in errors.rejected_by_reason.items())
    return Reason(
        "answered",
        _graded(share, FEW_REJECTED, MOST_REJECTED),
        f"{errors.n_rejected} of {errors.n_batches} batches of the {PART_NAMES[part]} gave no answer{reasons}.",
    )


def _agreement(left_out: TargetErrors, validation: TargetErrors) -> Iterator[Reason]:
    """Validation knows its loads; if its error exceeds that of runs left out, something other than the load changed."""
    expected, seen = left_out.mean_abs_pct_with_misses, validation.mean_abs_pct_with_misses
    if expected is None or seen is None:
        return
    text = f"Payload errors of the validation part, {seen:.1f} %, against {expected:.1f} % of runs left out"
    if seen > VALIDATION_LEAST_PCT and seen > VALIDATION_FACTOR * expected:
        yield Reason("agreement", Grade.RESERVED, f"{text}: something other than the load changed between the two.")
    else:
        yield Reason("agreement", Grade.FIT, f"{text}: as expected.")


_WARNING_TEXT: Final[Mapping[str, str]] = {
    "springs_from_priors": "Only one load was driven: it sets the zero; the springs are those of a typical vehicle. "
    "Weights away from that load are as uncertain as their intervals say.",
    "intervals_untested": "Fewer than three runs: intervals were widened by a rule of thumb, not tested.",
}


def _warnings(assessment: Assessment, estimator: str) -> Iterator[Reason]:
    """Those of the file, except those of another estimator or found again in the drives themselves."""
    skipped = [f"{name}: " for name in ESTIMATOR_NAMES if name != estimator]
    if assessment.outcome:
        skipped += ["run ", *(f"{finding.kind}: " for finding in assessment.outcome.inspection.findings)]
        skipped += [f"{one.kind}: " for one in assessment.outcome.doubts]
    for warning in assessment.file.warnings:
        if not warning.startswith(tuple(skipped)):
            yield Reason("warning", Grade.RESERVED, _WARNING_TEXT.get(warning, warning))


def _campaign(outcome: Outcome) -> Iterator[Reason]:
    for finding in outcome.inspection.findings:
        if finding.severity is not Severity.NOTE:
            text = f"{finding.kind.replace('_', ' ').capitalize()}: {finding.text}."
            yield Reason(str(finding.kind), Grade.RESERVED, text)


def _runs(verdicts: Sequence[RunVerdict]) -> Iterator[Reason]:
    unusable = [one.number for one in verdicts if not one.is_usable]
    doubtful = [one.number for one in verdicts if any(finding.severity is Severity.WARNING for finding in one.findings)]
    in_all = counted(len(verdicts), "run")
    if unusable:
        grade = Grade.UNFIT if 2 * len(unusable) > len(verdicts) else Grade.RESERVED
        yield Reason("runs", grade, f"{len(unusable)} of {in_all} cannot be used: {_listed(unusable)}.")
    elif doubtful:
        yield Reason("runs", Grade.RESERVED, f"{len(doubtful)} of {in_all} need attention: {_listed(doubtful)}.")
    elif verdicts:
        yield Reason("runs", Grade.FIT, f"Without a fault: {in_all}, all there are.")


def _labels(verdicts: Sequence[RunVerdict]) -> Iterator[Reason]:
    """Runs with a wrong load that took part: they bias every answer and the errors by which it is judged."""
    doubted = [
        one.number
        for one in verdicts
        if one.is_usable and any(finding.kind is Kind.LOAD_DISAGREES for finding in one.findings)
    ]
    if doubted:
        text = (
            f"The other runs find another weight for {_listed(doubted)} than the campaign file says: correct the load,"
        )
        yield Reason("labels", Grade.UNFIT, f"{text} or calibrate without these runs (--runs).")


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _listed(numbers: Sequence[int]) -> str:
    return ", ".join(f"run {number}" for number in numbers)
