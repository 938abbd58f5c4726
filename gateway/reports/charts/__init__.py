"""Charts as plain records of numbers; ``still`` draws them by matplotlib, ``html`` makes the pages.

Reports describe their sections, charts and tables with these records; the renderer knows nothing about the numbers.
"""

from dataclasses import dataclass
from typing import Final, Literal

from gateway.records import F64

Dash = Literal["solid", "dash", "dot"]
Marker = Literal["circle", "square", "diamond", "x"]

# each at least 3:1 against the light and the dark ground of the page (WCAG 2.2, 1.4.11)
COLOURS: Final = ("#2a7fc1", "#d9503f", "#2c9960", "#9467bd", "#b57f1c", "#1f96a5", "#d0609e", "#7d8785")
GREY: Final = 7  # index in the palette


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis; ``ticks`` labels positions of it, for example instants: (position, name)."""

    title: str
    is_log: bool = False
    limits: tuple[float, float] | None = None
    ticks: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class LineMark:
    """A curve through x, y (n,)."""

    x: F64
    y: F64
    label: str = ""
    colour: int = 0
    dash: Dash = "solid"


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Markers at x, y (n,); low and high (n,) are the ends of an interval around y."""

    x: F64
    y: F64
    label: str = ""
    colour: int = 0
    marker: Marker = "circle"
    low: F64 | None = None
    high: F64 | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Ribbon:
    """The area between low and high (n,) over x (n,)."""

    x: F64
    low: F64
    high: F64
    label: str = ""
    colour: int = 0


@dataclass(frozen=True, slots=True)
class Rule:
    """A straight line across the panel at x (vertical) or y."""

    at: float
    is_vertical: bool = False
    label: str = ""
    colour: int = GREY
    dash: Dash = "solid"


Mark = LineMark | Points | Ribbon | Rule


@dataclass(frozen=True, slots=True)
class Panel:
    """One pair of axes and its marks, drawn in this order (the first is at the back)."""

    x: Axis
    y: Axis
    marks: tuple[Mark, ...]
    title: str = ""


@dataclass(frozen=True, slots=True)
class Chart:
    """Panels, at most ``most_columns`` in a row. ``name`` is the file name; ``alt`` describes the chart in words."""

    name: str
    caption: str
    alt: str
    panels: tuple[Panel, ...]
    most_columns: int = 2
    row_height_px: int = 340

    @property
    def n_columns(self) -> int:
        return min(self.most_columns, len(self.panels))

    @property
    def n_rows(self) -> int:
        return -(-len(self.panels) // self.n_columns)


@dataclass(frozen=True, slots=True)
class ChartLink:
    """A cell that leads to another page; ``to`` is a relative URL."""

    text: str
    to: str


Cell = str | ChartLink


@dataclass(frozen=True, slots=True)
class Table:
    """Numbers as text; the first ``n_heads`` cells of a row are its headings. No row is longer than ``columns``."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    n_heads: int = 1


@dataclass(frozen=True, slots=True)
class Section:
    """A chapter of the report: paragraphs, then charts and tables. ``folded`` tables are collapsed at first."""

    anchor: str
    heading: str
    paragraphs: tuple[str, ...] = ()
    charts: tuple[Chart, ...] = ()
    tables: tuple[Table, ...] = ()
    folded: tuple[tuple[str, tuple[Table, ...]], ...] = ()
