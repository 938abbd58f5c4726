"""The report of a calibration, or of an evaluation alone: report.html with its figures, and report.json.

    write_report_of(DIR, assessment)      springscale calibrate, learn and evaluate ... --report DIR

It raises ConfigurationError if the directory cannot be created. The page is self-contained: it loads nothing
from elsewhere, and reads without scripts.
"""

from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Any, Final

from gateway.calibration.from_drives import Outcome
from gateway.calibration.judgement.advice import GRADE_TEXT, Grade, Verdict, verdicts_of
from gateway.calibration.judgement.assessment import Assessment, stated_budget
from gateway.estimates.field_kinds import BUDGET
from gateway.reports.calibration.accuracy import accuracy_section
from gateway.reports.calibration.fitted_vehicle import fitted_vehicle_section
from gateway.reports.calibration.runs import provenance_section, runs_section
from gateway.reports.charts import Section
from gateway.reports.charts.html import (
    OnChart,
    Page,
    made_folder,
    prose,
    write_report,
)
from gateway.words import counted, estimator_name, span


def write_report_of(directory: Path, assessment: Assessment, on_chart: OnChart = lambda done, of: None) -> Path:
    """Writes how a calibration weighs, and how it was made if this is known; returns the path of report.html."""
    made = list(_calibration_sections(assessment.outcome)) if assessment.outcome else []
    accuracy = [accuracy_section(one, stated_budget(one)) for one in assessment.judgements]
    sections = [*made, *accuracy, provenance_section(assessment)]
    made_folder(directory)
    verdicts = verdicts_of(assessment)
    header = f"<p>{prose(_subtitle(assessment))}</p>"
    page = Page(assessment.title, header, skip_to="verdict", summary=_verdict_html(verdicts))
    return write_report(directory, page, sections, report_json(assessment, verdicts), on_chart)


def _calibration_sections(outcome: Outcome) -> Iterator[Section]:
    yield runs_section(outcome)
    if outcome.cross_spectrum is not None:
        identification = [one.identification for one in outcome.inspection.usable]
        yield fitted_vehicle_section(identification, outcome.cross_spectrum, outcome.file.vehicle)


def _subtitle(assessment: Assessment) -> str:
    seen = assessment.file.seen
    speeds = span(3.6 * seen.speed_mps[0], 3.6 * seen.speed_mps[1], "km/h")
    inherited = " and a sister's calibration" if assessment.file.sister_id else ""
    return (
        f"Calibrated on {counted(len(assessment.file.provenance.drives), 'run')}{inherited}: payloads of "
        f"{span(*seen.payload_kg, 'kg')}, front shares of {span(*seen.front_share_pct, '%', 1)}, {speeds}. "
        f"{assessment.file.id}"
    )


def report_json(assessment: Assessment, verdicts: tuple[Verdict, ...]) -> dict[str, Any]:
    """The report's numbers: verdicts with reasons, error tables (12) by estimator and set, run verdicts."""
    return {
        "calibration_id": assessment.file.id,
        "vehicle": assessment.vehicle.name,
        "grade": str(verdicts[0].grade),
        "verdicts": [{"estimator": verdict.estimator, **verdict.to_json()} for verdict in verdicts],
        "runs": [
            {
                "run": one.run.number,
                "log": one.run.log,
                "is_usable": one.is_usable,
                "findings": [finding.to_json() for finding in one.findings],
            }
            for one in (assessment.outcome.inspection.runs if assessment.outcome else ())
        ],
        "errors": {
            one.estimator: {str(part): table.to_json() for part, table in one.tables.items()}
            for one in assessment.judgements
        },
        "error_budget": {one.estimator: BUDGET.write(stated_budget(one)) for one in assessment.judgements},
    }


_RULE_TEXT: Final = {Grade.FIT: "Fit", Grade.RESERVED: "With reservations", Grade.UNFIT: "Not fit"}
_GRADE_MARK: Final = {Grade.FIT: "✓", Grade.RESERVED: "!", Grade.UNFIT: "✗"}


def _verdict_html(verdicts: Sequence[Verdict]) -> str:
    """The verdict on the estimator that the service runs, with the reasons of all."""
    running = verdicts[0]
    several = ", which the service runs by default" if len(verdicts) > 1 else ""
    return (
        f'<section id="verdict" class="{running.grade}"><h2>{_mark(running.grade)} {GRADE_TEXT[running.grade]}</h2>'
        f"<p>By the {escape(estimator_name(running.estimator))}{several}. {prose(running.accuracy)}</p>"
        f"{f'<p>{prose(running.advice)}</p>' if running.advice else ''}"
        f"{''.join(_reasons(verdict) for verdict in verdicts)}</section>"
    )


def _reasons(verdict: Verdict) -> str:
    rows = "".join(
        f'<li class="{reason.grade}">{_mark(reason.grade)} <span class="unseen">{_RULE_TEXT[reason.grade]}: </span>'
        f"{prose(reason.text)}</li>"
        for reason in verdict.reasons
    )
    name = estimator_name(verdict.estimator)
    return f'<h3>{escape(name.capitalize())}: {GRADE_TEXT[verdict.grade].lower()}</h3><ul class="reasons">{rows}</ul>'


def _mark(grade: Grade) -> str:
    return f'<span class="mark" aria-hidden="true">{_GRADE_MARK[grade]}</span>'
