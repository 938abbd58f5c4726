"""A chart as plain numbers: what it shows, not how. Drawn twice, live by plotly and still by matplotlib."""

from dataclasses import dataclass
from typing import Final, Literal

from gateway.records import F64

Dash = Literal["solid", "dash", "dot"]
Marker = Literal["circle", "square", "diamond", "x"]

# each at least 3:1 against the light and the dark ground of the page (WCAG 2.2, 1.4.11)
COLOURS: Final = ("#2a7fc1", "#d9503f", "#2c9960", "#9467bd", "#b57f1c", "#1f96a5", "#d0609e", "#7d8785")
GREY: Final = 7


@dataclass(frozen=True, slots=True)
class Axis:
    """``places`` names the positions 0, 1, 2 ... of an axis of kinds instead of numbers.

    ``ticks`` names positions of an axis of numbers that people do not read as such, as instants: (position, name).
    """

    title: str
    is_log: bool = False
    limits: tuple[float, float] | None = None
    places: tuple[str, ...] = ()
    ticks: tuple[tuple[float, str], ...] = ()

    @property
    def named(self) -> tuple[tuple[float, str], ...]:
        """Positions that have names, with these; empty where the numbers stand for themselves."""
        return self.ticks or tuple((float(n), place) for n, place in enumerate(self.places))


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A curve through x, y (n,)."""

    x: F64
    y: F64
    label: str = ""
    colour: int = 0
    dash: Dash = "solid"


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Marks at x, y (n,); low and high (n,) are the ends of an interval about y; notes say what each is."""

    x: F64
    y: F64
    label: str = ""
    colour: int = 0
    marker: Marker = "circle"
    low: F64 | None = None
    high: F64 | None = None
    notes: tuple[str, ...] = ()


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


@dataclass(frozen=True, slots=True)
class Span:
    """The stretch low to high of x, shaded over the panel's height."""

    low: float
    high: float
    label: str = ""
    colour: int = GREY


Mark = Line | Points | Ribbon | Rule | Span


@dataclass(frozen=True, slots=True)
class Panel:
    """One pair of axes and what is drawn in it, the first lowest."""

    x: Axis
    y: Axis
    marks: tuple[Mark, ...]
    title: str = ""


@dataclass(frozen=True, slots=True)
class Chart:
    """Panels side by side, ``most_columns`` in a row. ``name`` is a file's; ``alt`` tells in words what is seen.

    ``has_still`` is false where no picture is drawn, for tables beside it hold the same numbers.
    """

    name: str
    caption: str
    alt: str
    panels: tuple[Panel, ...]
    most_columns: int = 2
    row_height_px: int = 340
    has_still: bool = True

    @property
    def n_columns(self) -> int:
        """Panels in a row."""
        return min(self.most_columns, len(self.panels))

    @property
    def n_rows(self) -> int:
        """Rows of panels."""
        return -(-len(self.panels) // self.n_columns)


@dataclass(frozen=True, slots=True)
class Link:
    """A cell that leads to another page; ``to`` is a relative URL."""

    text: str
    to: str


Cell = str | Link


@dataclass(frozen=True, slots=True)
class Table:
    """Numbers as text, the first ``n_heads`` cells of a row naming it. A row may be as wide as ``columns`` only."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    n_heads: int = 1


@dataclass(frozen=True, slots=True)
class Section:
    """A chapter of the report: paragraphs, then charts and tables; what is lengthy is ``folded`` away at first."""

    anchor: str
    heading: str
    paragraphs: tuple[str, ...] = ()
    charts: tuple[Chart, ...] = ()
    tables: tuple[Table, ...] = ()
    folded: tuple[tuple[str, tuple[Chart | Table, ...]], ...] = ()
