"""Fit for use or not, and what to do next: a table of rules over the errors, and what inspection and facts say.

    verdicts_of(assessment) -> a verdict an estimator, first that of the one which the service runs

A calibration is as good as its worst rule. docs/calibration.md lists them.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from gateway.calibration.ahead import Step, next_steps
from gateway.calibration.fitter_answers import doubts_of_vehicle
from gateway.calibration.from_drives import Outcome
from gateway.calibration.judgement.assessment import PART_NAMES, Assessment, Judgement
from gateway.calibration.judgement.coverage import PROMISED, coverage_of
from gateway.calibration.judgement.evaluation import ErrorTable, Target
from gateway.config import ESTIMATOR_NAMES
from gateway.core.vehicle import USEFUL_SHARE, Vehicle
from gateway.stated.doubt import Doubt, DoubtKind
from gateway.words import decimal, estimator_name


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
    """One estimator's accuracy in a sentence, a reason for each rule that applies, and what to state or drive next."""

    estimator: str
    accuracy: str
    reasons: tuple[Reason, ...]
    steps: tuple[Step, ...] = ()

    @property
    def grade(self) -> Grade:
        """The worst of the reasons."""
        return max((reason.grade for reason in self.reasons), key=lambda grade: grade.rank, default=Grade.RESERVED)

    @property
    def advice(self) -> str:
        """What to state or drive next; empty if the steps are not known."""
        if not self.steps:
            return ""
        best = self.steps[0]
        if best.then_kg > (1.0 - WORTH_SAYING) * best.now_kg:
            return "No single further drive or statement would narrow the intervals by a tenth."
        return f"Next: {best.text}."

    @property
    def text(self) -> str:
        """The grade, the accuracy, the reasons for a grade below fit, and the advice."""
        below = [f"    {one.text}" for one in self.reasons if one.grade is not Grade.FIT]
        head = f"{GRADE_TEXT[self.grade]}, by the {estimator_name(self.estimator)}. {self.accuracy}"
        return "\n".join([head, *below, *([f"    {self.advice}"] if self.advice else [])])

    def to_json(self) -> dict[str, Any]:
        """The same for programs."""
        return {
            "grade": str(self.grade),
            "accuracy": self.accuracy,
            "reasons": [{"rule": one.rule, "grade": str(one.grade), "text": one.text} for one in self.reasons],
            "advice": self.advice,
        }


def _share_rejected(table: ErrorTable) -> float:
    errors = table.errors
    return 100.0 * errors.n_rejected / errors.n_batches if errors.n_batches else 100.0


def _error(target: Target) -> Callable[[ErrorTable], float | None]:
    """The mean error with a guess at mid-range for a batch without an answer; None if none was answered."""

    def figure(table: ErrorTable) -> float | None:
        errors = table.errors.of(target)
        return None if errors.mean_abs is None else errors.mean_abs_pct_with_misses

    return figure


def _uncovered(target: Target) -> Callable[[ErrorTable], float | None]:
    """The least share of intervals that may miss the truth, as few runs determine it; None with fewer than two runs."""

    def figure(table: ErrorTable) -> float | None:
        covered = [(hit, one.drive.number) for one in table.judged if (hit := one.is_covered(target)) is not None]
        if len({run for _, run in covered}) < 2:
            return None
        return 100.0 * (1.0 - coverage_of([hit for hit, _ in covered], [run for _, run in covered]).high)

    return figure


@dataclass(frozen=True, slots=True)
class Rule:
    """A figure in percent that is fit up to ``fit``, and of no use beyond ``most``.

    ``missing`` is the grade if there is no figure; None: then the rule does not apply.
    """

    name: str
    what: str
    figure: Callable[[ErrorTable], float | None]
    fit: float
    most: float
    missing: Grade | None = None

    def judged(self, table: ErrorTable, part: str) -> Reason | None:
        """The rule applied to the errors of one part of the campaign."""
        figure = self.figure(table)
        if figure is None:
            text = f"{self.what} over the {part}: none was answered."
            return None if self.missing is None else Reason(self.name, self.missing, text)
        grade = Grade.FIT if figure <= self.fit else Grade.RESERVED if figure <= self.most else Grade.UNFIT
        limits = f"fit to {self.fit:g} %, no use beyond {self.most:g} %"
        return Reason(self.name, grade, f"{self.what} over the {part}: {figure:.1f} % ({limits}).")


WORTH_SAYING: Final = 0.1  # chosen: relative gain of a step that is advised
FIT_HALF_WIDTH_PCT, MOST_HALF_WIDTH_PCT = 100.0 * USEFUL_SHARE, 50.0  # chosen: of the range

# All limits are chosen. A guess at mid-range errs by 25 % over evenly spread loads; an interval is half as wide as the
# range for a mean normal error of 20 %; 95 % intervals with certainly less than 70 % coverage mislead.
RULES: Final = (
    Rule(
        "payload_error",
        "Mean error of payload, in percent of the range, with a guess at mid-range for a batch without an answer,",
        _error("payload"), 10.0, 20.0, missing=Grade.UNFIT,
    ),
    Rule(
        "front_share_error",
        "Mean error of front share, in percent of the range, with a guess at mid-range for a batch without an answer,",
        _error("front_share"), 10.0, 20.0, missing=Grade.RESERVED,
    ),
    Rule(
        "payload_half_width", "Half of the 95 % interval of payload, in percent of the range,",
        lambda table: table.errors.payload.half_width_pct, FIT_HALF_WIDTH_PCT, MOST_HALF_WIDTH_PCT,
    ),
    Rule(
        "front_share_half_width", "Half of the 95 % interval of front share, in percent of the range,",
        lambda table: table.errors.front_share.half_width_pct, 25.0, 50.0,
    ),
    Rule(
        "payload_coverage", "95 % intervals of payload that miss the truth, at least,",
        _uncovered("payload"), 100.0 * (1.0 - PROMISED[0]), 30.0,
    ),
    Rule(
        "front_share_coverage", "95 % intervals of front share that miss the truth, at least,",
        _uncovered("front_share"), 100.0 * (1.0 - PROMISED[0]), 30.0,
    ),
    Rule("answered", "Batches without an answer", _share_rejected, 20.0, 50.0),
)  # fmt: skip


def verdicts_of(assessment: Assessment) -> tuple[Verdict, ...]:
    """A verdict for every estimator judged, first that of the one which the service runs by default."""
    in_order = sorted(assessment.judgements, key=lambda one: ESTIMATOR_NAMES.index(one.estimator))
    return tuple(_verdict(assessment, one) for one in in_order)


def _verdict(assessment: Assessment, judgement: Judgement) -> Verdict:
    steps = _steps(assessment, judgement.estimator)
    reasons = [*_of_errors(judgement, assessment.vehicle, steps), *_of_one_load(assessment, judgement.estimator)]
    if assessment.outcome:
        reasons += _of_runs(assessment.outcome)
    return Verdict(judgement.estimator, _accuracy(judgement, steps), tuple(reasons), steps)


def _steps(assessment: Assessment, estimator: str) -> tuple[Step, ...]:
    """What further drives and statements would gain, the most useful first; none if they cannot be computed."""
    model = assessment.file.cross_spectrum
    if estimator != "cross_spectrum" or model is None or assessment.outcome is None:
        return ()
    return next_steps(model, assessment.vehicle)


def _accuracy(judgement: Judgement, steps: Sequence[Step]) -> str:
    if judgement.unseen is None:
        ahead = f"By the model a middling payload is weighed to ± {steps[0].now_kg:.0f} kg. " if steps else ""
        return f"{ahead}How well it weighs is not tested: no drive was kept aside to judge by."
    errors = judgement.tables[judgement.unseen].errors
    payload, share = errors.payload, errors.front_share
    if payload.mean_abs is None:
        return f"Over the {PART_NAMES[judgement.unseen]} it weighs nothing: no batch has an answer."
    return (
        f"Over the {PART_NAMES[judgement.unseen]} it weighs payloads to {decimal(payload.mean_abs, ' kg', 1)} on "
        f"average and {decimal(payload.max_abs, ' kg', 1)} at worst, front shares to "
        f"{decimal(share.mean_abs, ' pp')} and {decimal(share.max_abs, ' pp')}."
    )


def _of_errors(judgement: Judgement, vehicle: Vehicle, steps: Sequence[Step]) -> Iterator[Reason]:
    part = judgement.unseen
    if part is None:
        text = "No data were kept aside to judge by: fewer than three drives of known payload and no validation part."
        yield Reason("unseen", Grade.RESERVED, text)
        if steps:
            low_kg, high_kg = vehicle.payload_range_kg
            half_pct = 100.0 * steps[0].now_kg / (high_kg - low_kg)
            text = (
                f"Half of the 95 % interval of a middling payload, by the model: {half_pct:.1f} % of the range (no use "
                f"beyond {MOST_HALF_WIDTH_PCT:g} %)."
            )
            yield Reason("payload_ahead", Grade.RESERVED if half_pct <= MOST_HALF_WIDTH_PCT else Grade.UNFIT, text)
        return
    judged = (rule.judged(judgement.tables[part], PART_NAMES[part]) for rule in RULES)
    yield from (reason for reason in judged if reason is not None)


_WARNINGS: Final[Mapping[str, str]] = {
    "springs_from_priors": "Only one load was driven: it sets the zero; the springs are those of a typical vehicle. "
    "Weights away from that load are as uncertain as their intervals say.",
    "intervals_untested": "Fewer than three drives of known load: intervals rest on the errors of other vehicles, not "
    "on this one's.",
}


def _of_one_load(assessment: Assessment, estimator: str) -> Iterator[Reason]:
    """What a fit on few loads takes from elsewhere."""
    file = assessment.file
    if estimator == "cross_spectrum":
        yield from (Reason(name, Grade.RESERVED, text) for name, text in _WARNINGS.items() if name in file.warnings)
        if file.sister_id is not None and len({one.statement.payload_kg for one in file.provenance.drives}) == 1:
            text = (
                "Only one load was driven: the effect of others was inherited from a sister. One known load, weighed, "
                "confirms it for this vehicle."
            )
            yield Reason("inherited", Grade.RESERVED, text)


def _of_runs(outcome: Outcome) -> Iterator[Reason]:
    runs = outcome.inspection.runs
    unusable = [one.run.number for one in runs if not one.is_usable]
    if unusable:
        grade = Grade.UNFIT if 2 * len(unusable) > len(runs) else Grade.RESERVED
        yield Reason("runs", grade, f"{len(unusable)} of {len(runs)} drives cannot be used: {_listed(unusable)}.")
    drives = [one for one in outcome.file.provenance.drives if one.statement.is_of_payload]
    held = [one.number for one in drives if one.found is not None and one.found.is_held]
    if held:
        text = (
            f"The drives contradict what is stated of {_listed(held)}: nothing was learnt from it. Correct the load, "
            "or leave it out."
        )
        yield Reason("labels", Grade.UNFIT if 2 * len(held) > len(drives) else Grade.RESERVED, text)
    for doubt in outcome.doubts:
        yield _of_doubt(doubt, Grade.UNFIT)
    for doubt in doubts_of_vehicle(outcome.file.vehicle):
        if doubt.kind not in _OF_PAYLOAD_RANGE:
            yield _of_doubt(doubt, Grade.RESERVED)


_OF_PAYLOAD_RANGE: Final = (DoubtKind.PAYLOAD, DoubtKind.PAYLOAD_LIMIT)  # percentages refer to it, and no weight


def _of_doubt(doubt: Doubt, grade: Grade) -> Reason:
    return Reason("facts", grade, f"{doubt.sentence[:1].upper()}{doubt.sentence[1:]}.")


def _listed(numbers: Sequence[int]) -> str:
    return f"drive{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"
