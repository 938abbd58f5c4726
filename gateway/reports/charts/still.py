"""Charts by matplotlib: SVG files for pages.

The figures have no global state and are saved reproducibly: the same numbers give the same bytes.
"""

from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.axis import XAxis, YAxis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from gateway.reports.charts import COLOURS, Axis, Chart, LineMark, Mark, Panel, Points, Ribbon, Rule

_STYLE: Final[Any] = {  # matplotlib types its keys one by one
    "svg.fonttype": "none",
    "font.size": 9.0,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}


_INCHES_PER_PX: Final = 1.0 / 105.0  # chosen: size of letters in print
_DASHES: Final = {"solid": "-", "dash": "--", "dot": ":"}
_MARKERS: Final = {"circle": "o", "square": "s", "diamond": "D", "x": "x"}
_LEGEND_COLUMNS: Final = 5  # chosen


def save_still(chart: Chart, directory: Path) -> None:
    """Write NAME.svg; the same bytes for the same chart."""
    directory.mkdir(parents=True, exist_ok=True)
    style: Any = {**_STYLE, "svg.hashsalt": chart.name}
    with mpl.rc_context(style):
        draw(chart).savefig(directory / f"{chart.name}.svg", metadata={"Date": None, "Creator": None})


def draw(chart: Chart) -> Figure:
    """Draw the chart with one common legend below all panels."""
    size_in = (9.0, chart.row_height_px * _INCHES_PER_PX * chart.n_rows)
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=size_in, layout="constrained")
        axes_of = list(figure.subplots(chart.n_rows, chart.n_columns, squeeze=False).ravel())
    n_drawn = len(chart.panels)
    for panel, axes in zip(chart.panels, axes_of[:n_drawn], strict=True):
        _draw_panel(axes, panel)
    for axes in axes_of[n_drawn:]:
        axes.set_axis_off()
    marks = {
        label: handle
        for axes in axes_of
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }  # fmt: skip
    if marks:
        n_columns = min(len(marks), _LEGEND_COLUMNS)
        figure.legend(
            list(marks.values()),
            list(marks),
            loc="outside lower center",
            ncols=n_columns,
            fontsize=7,
            frameon=False,
        )
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # laid out once, not again for every format
    return figure


def _draw_panel(axes: Axes, panel: Panel) -> None:
    for order, mark in enumerate(panel.marks):
        _draw_mark(mark, axes, order + 2)
    axes.set_title(panel.title, fontsize=9)
    axes.set(xlabel=panel.x.title, ylabel=panel.y.title)
    _set_axis(axes.xaxis, panel.x, rotation=30, ha="right")
    _set_axis(axes.yaxis, panel.y)


def _set_axis(drawn: XAxis | YAxis, axis: Axis, **of_ticks: Any) -> None:
    """Set scale, limits and ticks; ``of_ticks`` formats the labels of ticks."""
    name = drawn.axis_name
    if axis.is_log:
        drawn.axes.set(**{f"{name}scale": "log"})
        _with_plain_ticks(drawn)
    if axis.limits:
        drawn.axes.set(**{f"{name}lim": axis.limits})
    if axis.ticks:
        drawn.set_ticks([at for at, _ in axis.ticks], [name for _, name in axis.ticks], fontsize=7, **of_ticks)


def _with_plain_ticks(axis: XAxis | YAxis) -> None:
    """Ticks as 0.001, 0.002, 0.005; matplotlib needs half a second per figure to typeset powers of ten."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def _draw_mark(mark: Mark, axes: Axes, order: int) -> None:
    # matplotlib leaves names that begin with an underscore out of the legend
    style: dict[str, Any] = {"color": COLOURS[mark.colour], "label": mark.label or "_"}
    match mark:
        case LineMark():
            axes.plot(mark.x, mark.y, linestyle=_DASHES[mark.dash], linewidth=1.2, zorder=order, **style)
        case Points():
            if mark.low is not None and mark.high is not None:
                bars: dict[str, Any] = {"color": style["color"], "linewidth": 0.8, "alpha": 0.6}
                axes.vlines(mark.x, mark.low, mark.high, zorder=order, **bars)
            axes.plot(mark.x, mark.y, _MARKERS[mark.marker], markersize=4, zorder=order, **style)
        case Ribbon():
            axes.fill_between(mark.x, mark.low, mark.high, alpha=0.18, linewidth=0.0, zorder=order, **style)
        case Rule():
            across = axes.axvline if mark.is_vertical else axes.axhline
            across(mark.at, linestyle=_DASHES[mark.dash], linewidth=1.0, zorder=order, **style)
