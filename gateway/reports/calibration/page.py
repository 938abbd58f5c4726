"""The report as one page: the verdict first, then the sections. It reads without scripts; plotly replaces pictures."""

from dataclasses import dataclass
from html import escape
from typing import Final

from gateway.calibration.judgement import Grade, Verdict
from gateway.reports.calibration.text import estimator_name
from gateway.reports.charts import Section, html
from gateway.reports.charts.html import contents_html, prose, section_html

GRADE_TEXT: Final = {
    Grade.FIT: "Fit for use",
    Grade.RESERVED: "Fit for use with reservations",
    Grade.UNFIT: "Not fit for use",
}
_RULE_TEXT: Final = {Grade.FIT: "Fit", Grade.RESERVED: "With reservations", Grade.UNFIT: "Not fit"}
_GRADE_MARK: Final = {Grade.FIT: "✓", Grade.RESERVED: "!", Grade.UNFIT: "✗"}


@dataclass(frozen=True, slots=True)
class ReportPage:
    """The content of the page; ``live`` has plotly's JSON by the chart's name."""

    title: str
    subtitle: str
    verdicts: tuple[Verdict, ...]
    in_short: str
    next_run: str | None
    sections: tuple[Section, ...]
    live: dict[str, str]


def page_html(page: ReportPage) -> str:
    """The whole document; figures are in figures/, plotly.min.js is beside it."""
    sections = "".join(section_html(one, page.live) for one in page.sections)
    return html.document(
        html.Page(
            page.title,
            f"<p>{prose(page.subtitle)}</p>",
            _verdict(page) + contents_html(page.sections) + sections,
            ("verdict", "Skip to the verdict"),
            html.PLOTLY_FILE if page.live else None,
        )
    )


def _verdict(page: ReportPage) -> str:
    running = page.verdicts[0]
    several = ", which the service runs unless it is told otherwise" if len(page.verdicts) > 1 else ""
    next_run = f"<h3>What to drive next</h3><p>{prose(page.next_run)}</p>" if page.next_run else ""
    return (
        f'<section id="verdict" class="{running.grade}"><h2>{_mark(running.grade)} {GRADE_TEXT[running.grade]}</h2>'
        f"<p>By the {escape(estimator_name(running.estimator))}{several}. {prose(page.in_short)}</p>{next_run}"
        f"{''.join(_reasons(verdict) for verdict in page.verdicts)}</section>"
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
