"""A report's directory: sections, charts and tables as HTML, with figures and numbers beside it.

The pages have no scripts and load nothing from other hosts.
"""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from datetime import date
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from gateway.errors import ConfigurationError
from gateway.reports.charts import Cell, Chart, ChartLink, Section, Table
from gateway.reports.charts.still import save_still

FIGURES: Final = "figures"  # the folder beside a page
OnChart = Callable[[int, int], None]  # (charts drawn, charts in all)


@dataclass(frozen=True, slots=True)
class Page:
    """The top of a document: its title, what stands below it (HTML), and the anchor of the main content.

    ``summary`` (HTML) stands before the sections.
    """

    title: str
    header: str
    skip_to: str
    summary: str = ""


def document(page: Page, sections: Sequence[Section]) -> str:
    """The complete document; it loads nothing from other hosts."""
    links = "".join(f'<li><a href="#{one.anchor}">{escape(one.heading)}</a></li>' for one in sections)
    contents = f'<nav aria-label="Contents"><ul>{links}</ul></nav>{"".join(map(section_html, sections))}'
    style = files("gateway.reports").joinpath("assets", "report.css").read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark">'
        f"<title>{escape(page.title)}</title><style>{style}</style></head><body>"
        f'<a class="skip" href="#{page.skip_to}">Skip to the content</a>'
        f"<header><h1>{escape(page.title)}</h1>{page.header}</header>"
        f"<main>{page.summary}{contents}</main></body></html>\n"
    )


def write_report(
    directory: Path,
    page: Page,
    sections: Sequence[Section],
    numbers: Mapping[str, Any],
    on_chart: OnChart = lambda done, of: None,
) -> Path:
    """Write report.html, its numbers as report.json and the charts' figures; return the path of report.html."""
    text = json.dumps(numbers, indent=1, allow_nan=False, ensure_ascii=False, default=_as_json)
    (directory / "report.json").write_text(text + "\n", encoding="utf-8")
    return write_page(directory / "report.html", page, sections, on_chart)


def _as_json(told: Any) -> Any:
    """Records as objects of their fields, frames as lists of rows, dates as text."""
    if is_dataclass(told):
        return {one.name: getattr(told, one.name) for one in fields(told)}
    return str(told) if isinstance(told, date) else told.to_dicts()


def write_page(path: Path, page: Page, sections: Sequence[Section], on_chart: OnChart = lambda done, of: None) -> Path:
    """Write a page and its charts' figures, which lie in a folder beside it."""
    charts = [chart for section in sections for chart in section.charts]
    for done, chart in enumerate(charts, 1):
        save_still(chart, path.parent / FIGURES)
        on_chart(done, len(charts))
    path.write_text(document(page, sections), encoding="utf-8")
    return path


def made_folder(directory: Path) -> None:
    """Create the directory if needed. Raises ConfigurationError if that fails."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        why = f"no report can be written there ({fault.strerror}): name a directory"
        raise ConfigurationError(f"{directory}: {why}") from None


def prose(text: str) -> str:
    """Escape text, with a non-breaking space between a number and its unit."""
    return re.sub(r"(?<=\d) (?=(?:%|kg|pp|Hz|m|km/h|m/s²)(?:\W|$))", "\u00a0", escape(text)).replace("± ", "±\u00a0")


def section_html(section: Section) -> str:
    paragraphs = "".join(f"<p>{prose(text)}</p>" for text in section.paragraphs)
    body = "".join([*map(_figure, section.charts), *map(table_html, section.tables)])
    folded = "".join(
        f"<details><summary>{escape(summary)}</summary>{''.join(map(table_html, inside))}</details>"
        for summary, inside in section.folded
    )
    heading = f"<h2>{escape(section.heading)}</h2>"
    return f'<section id="{section.anchor}">{heading}{paragraphs}{body}{folded}</section>'


def _figure(chart: Chart) -> str:
    picture = f"{FIGURES}/{chart.name}.svg"
    return (
        f'<figure id="figure-{chart.name}"><div class="wide"><img src="{picture}" alt="{escape(chart.alt)}"></div>'
        f'<figcaption>{prose(chart.caption)} <a href="{picture}">SVG</a></figcaption></figure>'
    )


def table_html(table: Table) -> str:
    """A table that scrolls horizontally on narrow pages."""
    head = "".join(f'<th scope="col">{escape(column)}</th>' for column in table.columns)
    body = "".join(_row(row, table.n_heads) for row in table.rows)
    caption = escape(table.caption)
    return (
        f'<div class="wide" role="region" tabindex="0" aria-label="{caption}"><table><caption>{caption}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _row(cells: Sequence[Cell], n_heads: int) -> str:
    heads = "".join(f'<th scope="row">{_cell(cell)}</th>' for cell in cells[:n_heads])
    return f"<tr>{heads}{''.join(f'<td>{_cell(cell)}</td>' for cell in cells[n_heads:])}</tr>"


def _cell(cell: Cell) -> str:
    return f'<a href="{escape(cell.to)}">{prose(cell.text)}</a>' if isinstance(cell, ChartLink) else prose(cell)
