"""Charts as plain records, and two ways to draw them: ``still`` by matplotlib, ``live`` by plotly.

A page's sections with their charts and tables are described here (``chart``) by whoever knows the numbers, and drawn
without knowing them: the same record gives the SVG file and the chart that answers to the mouse.
"""

from gateway.reports.charts.chart import (
    GREY,
    Axis,
    Cell,
    Chart,
    Line,
    Link,
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
    "Line",
    "Link",
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
