"""Charts are drawn from records of numbers. Figures are files of their own."""

from pathlib import Path

import numpy as np
import pytest

from gateway.reports.charts import (
    COLOURS,
    Axis,
    Chart,
    ChartLink,
    LineMark,
    Mark,
    Panel,
    Points,
    Ribbon,
    Rule,
    Table,
)
from gateway.reports.charts.html import table_html
from gateway.reports.charts.still import draw, save_still

X = np.linspace(1.0, 3.0, 5)
MARKS: tuple[Mark, ...] = (
    LineMark(X, X**2, "line"),
    Points(X, X, "points", 1, "diamond", X - 1.0, X + 2.0),
    Ribbon(X, X - 1.0, X + 1.0, "ribbon", 2),
    Rule(2.0, is_vertical=True, label="rule"),
)


def chart(*panels: Panel) -> Chart:
    return Chart("name", "caption", "what is to be seen", panels)


def panel(*marks: Mark, is_log: bool = False) -> Panel:
    return Panel(Axis("x [Hz]"), Axis("y [kg]", is_log=is_log), marks)


def luminance(colour: str) -> float:
    """Relative, as WCAG 2.2 defines it."""
    parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("ground", ["#ffffff", "#192220"])
@pytest.mark.parametrize("colour", COLOURS)
def test_every_colour_is_seen_on_light_and_on_dark(colour: str, ground: str) -> None:
    dark, light = sorted((luminance(colour), luminance(ground)))
    assert (light + 0.05) / (dark + 0.05) >= 3.0


@pytest.mark.parametrize("mark", MARKS, ids=lambda mark: type(mark).__name__)
def test_every_mark_is_drawn(mark: Mark) -> None:
    one = chart(panel(mark))
    (axes, *_) = draw(one).axes
    assert len(axes.lines) + len(axes.collections) + len(axes.patches) >= 1


def test_the_legend_has_each_label_once() -> None:
    (legend,) = draw(chart(panel(LineMark(X, X, "same")), panel(LineMark(X, -X, "same")))).legends
    assert [text.get_text() for text in legend.get_texts()] == ["same"]


def test_axes_say_what_they_are() -> None:
    one = chart(Panel(Axis("f", limits=(1.0, 9.0)), Axis("", ticks=((1.0, "low"), (2.0, "high"))), (LineMark(X, X),)))
    (axes,) = draw(one).axes
    assert (axes.get_xlabel(), axes.get_xlim()) == ("f", (1.0, 9.0))
    assert [label.get_text() for label in axes.get_yticklabels()] == ["low", "high"]
    (axes,) = draw(chart(Panel(Axis("f", is_log=True, limits=(0.1, 10.0)), Axis("y"), (LineMark(X, X),)))).axes
    assert (axes.get_xscale(), axes.get_xlim()) == ("log", (0.1, 10.0))


def test_the_same_chart_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "other"):
        save_still(chart(panel(*MARKS, is_log=True)), tmp_path / name)
    one, other = (tmp_path / name / "name.svg" for name in ("one", "other"))
    assert one.read_bytes() == other.read_bytes()


def test_a_cell_may_lead_to_another_page_and_nothing_breaks_out_of_it() -> None:
    cells = table_html(Table("of vans", ("Van",), ((ChartLink("<b>", 'a"b.html'),),)))
    assert '<th scope="row"><a href="a&quot;b.html">&lt;b&gt;</a></th>' in cells
