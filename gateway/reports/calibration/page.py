"""The report as one page: the verdict first, then the sections. It reads without scripts; plotly replaces pictures."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from typing import Final

from gateway.calibration.judgement import Grade, Verdict
from gateway.reports.calibration.text import estimator_name
from gateway.reports.charts import Chart, Section, Table

GRADE_TEXT: Final = {
    Grade.FIT: "Fit for use",
    Grade.RESERVED: "Fit for use with reservations",
    Grade.UNFIT: "Not fit for use",
}
_RULE_TEXT: Final = {Grade.FIT: "Fit", Grade.RESERVED: "With reservations", Grade.UNFIT: "Not fit"}
_GRADE_MARK: Final = {Grade.FIT: "✓", Grade.RESERVED: "!", Grade.UNFIT: "✗"}


@dataclass(frozen=True, slots=True)
class Page:
    """All that stands on the page; ``live`` holds plotly's JSON by the chart's name."""

    title: str
    subtitle: str
    verdicts: tuple[Verdict, ...]
    in_short: str
    next_run: str | None
    sections: tuple[Section, ...]
    live: dict[str, str]


def page_html(page: Page) -> str:
    """The whole document; figures lie in figures/, plotly.min.js beside it."""
    contents = "".join(f'<li><a href="#{one.anchor}">{escape(one.heading)}</a></li>' for one in page.sections)
    scripts = f'<script src="plotly.min.js"></script><script>{_asset("report.js")}</script>' if page.live else ""
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark">'
        f"<title>{escape(page.title)}</title><style>{_asset('report.css')}</style></head><body>"
        f'<a class="skip" href="#verdict">Skip to the verdict</a>'
        f"<header><h1>{escape(page.title)}</h1><p>{prose(page.subtitle)}</p></header>"
        f'<main>{_verdict(page)}<nav aria-label="Contents"><ul>{contents}</ul></nav>'
        f"{''.join(_section(one, page.live) for one in page.sections)}</main>{scripts}</body></html>\n"
    )


def prose(text: str) -> str:
    """Escaped, with a number and its unit kept on one line."""
    return re.sub(r"(?<=\d) (?=(?:%|kg|pp|Hz|m|km/h|m/s²)(?:\W|$))", "\u00a0", escape(text)).replace("± ", "±\u00a0")


def _asset(name: str) -> str:
    return files("gateway.reports").joinpath("assets", name).read_text(encoding="utf-8")


def _verdict(page: Page) -> str:
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


def _section(section: Section, live: dict[str, str]) -> str:
    paragraphs = "".join(f"<p>{prose(text)}</p>" for text in section.paragraphs)
    items: list[Chart | Table] = [*section.charts, *section.tables]
    body = "".join(_item(item, live) for item in items)
    folded = "".join(
        f"<details><summary>{escape(summary)}</summary>{''.join(_item(item, live) for item in inside)}</details>"
        for summary, inside in section.folded
    )
    heading = f"<h2>{escape(section.heading)}</h2>"
    return f'<section id="{section.anchor}">{heading}{paragraphs}{body}{folded}</section>'


def _item(item: Chart | Table, live: dict[str, str]) -> str:
    return _figure(item, live) if isinstance(item, Chart) else table_html(item)


def _figure(chart: Chart, live: dict[str, str]) -> str:
    """The still picture, and beside it what plotly needs to take its place on screen."""
    spec = live[chart.name].replace("<", "\\u003c")  # so that no text can end the element
    return (
        f'<figure id="figure-{chart.name}">'
        f'<div class="wide"><img src="figures/{chart.name}.svg" alt="{escape(chart.alt)}"></div>'
        f'<div class="wide live" role="img" aria-label="{escape(chart.alt)}" hidden></div>'
        f'<script type="application/json">{spec}</script>'
        f'<figcaption>{prose(chart.caption)} <a href="figures/{chart.name}.svg">SVG</a> '
        f'<a href="figures/{chart.name}.png">PNG</a></figcaption></figure>'
    )


def table_html(table: Table) -> str:
    """A table that scrolls by itself where the page is narrow."""
    head = "".join(f'<th scope="col">{escape(column)}</th>' for column in table.columns)
    body = "".join(_row(row, table.n_heads) for row in table.rows)
    caption = escape(table.caption)
    return (
        f'<div class="wide" role="region" tabindex="0" aria-label="{caption}"><table><caption>{caption}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _row(cells: Sequence[str], n_heads: int) -> str:
    heads = "".join(f'<th scope="row">{prose(cell)}</th>' for cell in cells[:n_heads])
    return f"<tr>{heads}{''.join(f'<td>{prose(cell)}</td>' for cell in cells[n_heads:])}</tr>"
