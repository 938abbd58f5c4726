"""Charts as plain records, and two ways to draw them: ``still`` by matplotlib, ``live`` by plotly.

Reports describe their sections, charts and tables with the records of ``chart``; the renderers know nothing about the
numbers. The same record gives the SVG file and the interactive chart.
"""

from gateway.reports.charts.chart import (
    GREY,
    Axis,
    Cell,
    Chart,
    ChartLink,
    LineMark,
    Mark,
    Marker,
    Panel,
    Points,
    Ribbon,
    Rule,
    Section,
    Span,
    Table,
)

__all__ = [
    "GREY",
    "Axis",
    "Cell",
    "Chart",
    "ChartLink",
    "LineMark",
    "Mark",
    "Marker",
    "Panel",
    "Points",
    "Ribbon",
    "Rule",
    "Section",
    "Span",
    "Table",
]
