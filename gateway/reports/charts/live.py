"""Interactive charts: the JSON that plotly.js draws in the page, and the script itself."""

import math
from dataclasses import replace
from typing import Any, Final

import plotly.graph_objects as go
from plotly.io.json import to_json_plotly
from plotly.offline import get_plotlyjs
from plotly.subplots import make_subplots

from gateway.reports.charts import COLOURS, Axis, Chart, LineMark, Mark, Panel, Points, Ribbon, Rule, Span

_LEGEND_PX: Final = 90  # chosen: by eye, like the next three
_NAME_PX: Final = 20  # chosen: height of a name
_GAP_PX: Final = 95  # chosen: between panels
_OPACITY: Final = 0.18  # chosen: of bands
_TICKS: Final = [digit * 10.0**decade for decade in range(-5, 4) for digit in (1, 2, 5)]
_LOG_TICKS: Final = {"tickmode": "array", "tickvals": _TICKS, "ticktext": [f"{tick:g}" for tick in _TICKS]}


def plotly_script() -> str:
    """plotly.min.js as the installed package ships it."""
    script: str = get_plotlyjs()
    return script


def plotly_json(chart: Chart) -> str:
    """{"data": [...], "layout": {...}, "narrow": {...}}: validated by plotly, without a theme (the page sets colours).

    ``narrow`` is the layout for phones, with all panels in one column.
    """
    narrow = live(replace(chart, most_columns=1), has_room=False).layout
    text: str = to_json_plotly(live(chart).to_plotly_json() | {"narrow": narrow})
    return text


def live(chart: Chart, *, has_room: bool = True) -> go.Figure:
    """The chart as a plotly figure; its legend is in rows below, or one entry per row if the page is narrow."""
    height_px = chart.n_rows * chart.row_height_px
    figure = make_subplots(
        rows=chart.n_rows,
        cols=chart.n_columns,
        subplot_titles=[panel.title for panel in chart.panels],
        horizontal_spacing=0.27 / chart.n_columns if chart.n_columns > 1 else 0.0,
        vertical_spacing=_GAP_PX / height_px if chart.n_rows > 1 else 0.0,
    )
    seen: set[str] = set()
    for number, panel in enumerate(chart.panels):
        _add_panel(figure, chart, panel, number, seen)
    figure.update_annotations(font_size=13)
    figure.update_layout(
        template="none",
        height=height_px + (_LEGEND_PX if has_room else _LEGEND_PX + _NAME_PX * len(seen)),
        margin={"l": 60, "r": 15, "t": 35, "b": 60},
        legend={"orientation": "h" if has_room else "v", "yanchor": "top", "y": -_GAP_PX / height_px * 0.8, "x": 0.0},
        hovermode="closest",
    )
    return figure


def _add_panel(figure: go.Figure, chart: Chart, panel: Panel, number: int, seen: set[str]) -> None:
    place = {"row": number // chart.n_columns + 1, "col": number % chart.n_columns + 1}
    for mark in panel.marks:
        named = _named(mark, seen)
        if isinstance(mark, Rule | Span):
            _add_shape(figure, mark, named, place)
        else:
            figure.add_trace({**_trace(mark), **named}, **place)
    figure.update_xaxes(**_axis(panel.x), **place)
    figure.update_yaxes(**_axis(panel.y), **place)


def _named(mark: Mark, seen: set[str]) -> dict[str, Any]:
    """Show each label once in the legend and let it toggle all its marks in every panel."""
    label = mark.label
    is_new = bool(label) and label not in seen
    seen.add(label)
    return {"name": label, "showlegend": is_new, **({"legendgroup": label} if label else {})}


def _axis(axis: Axis) -> dict[str, Any]:
    limits = None if axis.limits is None else [math.log10(end) if axis.is_log else end for end in axis.limits]
    named = {
        "tickmode": "array",
        "tickvals": [at for at, _ in axis.named],
        "ticktext": [name for _, name in axis.named],
    }
    return {
        "title_text": axis.title,
        "type": "log" if axis.is_log else "linear",
        "range": limits,
        "automargin": True,
        "zeroline": False,
        **(_LOG_TICKS if axis.is_log else {}),
        **(named if axis.named else {}),
    }


def _add_shape(figure: go.Figure, mark: Rule | Span, named: dict[str, Any], place: dict[str, int]) -> None:
    colour = COLOURS[mark.colour]
    if isinstance(mark, Span):
        filled = {"fillcolor": colour, "opacity": 0.3, "line_width": 0, "layer": "below"}
        figure.add_vrect(x0=mark.low, x1=mark.high, exclude_empty_subplots=False, **filled, **named, **place)
    else:
        drawn = {"line_color": colour, "line_dash": mark.dash, "line_width": 1.2}
        add = figure.add_vline if mark.is_vertical else figure.add_hline
        add(mark.at, exclude_empty_subplots=False, **drawn, **named, **place)


def _trace(mark: LineMark | Points | Ribbon) -> dict[str, Any]:
    colour = COLOURS[mark.colour]
    match mark:
        case LineMark():
            line = {"color": colour, "dash": mark.dash, "width": 1.6}
            return {"type": "scatter", "mode": "lines", "x": mark.x, "y": mark.y, "line": line}
        case Points():
            style = {"color": colour, "symbol": mark.marker, "size": 8}
            trace: dict[str, Any] = {"type": "scatter", "mode": "markers", "x": mark.x, "y": mark.y, "marker": style}
            trace["text"] = list(mark.notes) or None
            if mark.low is not None and mark.high is not None:
                reach = {"array": mark.high - mark.y, "arrayminus": mark.y - mark.low}
                trace["error_y"] = {"type": "data", "symmetric": False, "thickness": 1.0, "width": 2, **reach}
            return trace
        case Ribbon():  # a closed polygon: along the upper bound and back along the lower
            filled = {"fill": "toself", "fillcolor": colour, "opacity": _OPACITY, "line": {"width": 0}}
            outline = {"x": [*mark.x, *mark.x[::-1]], "y": [*mark.high, *mark.low[::-1]]}
            return {"type": "scatter", "mode": "lines", **outline, "hoverinfo": "skip", **filled}
