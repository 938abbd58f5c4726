"""A sheet to draw on: plain SVG, readable on light and on dark pages, in the reader's own sans serif."""

from collections.abc import Iterable
from html import escape
from typing import Final, Literal

Point = tuple[float, float]
Anchor = Literal["start", "middle", "end"]

LIGHT: Final = {
    "sheet": "#ffffff",
    "ink": "#1f2933",
    "soft": "#68747f",
    "panel": "#eef2f6",
    "blue": "#1a66c9",
    "orange": "#c2410c",
}
DARK: Final = {
    "sheet": "#14181d",
    "ink": "#e8ebee",
    "soft": "#98a3ae",
    "panel": "#242b33",
    "blue": "#6cb0ff",
    "orange": "#ff9d66",
}
INKS: Final = ("ink", "soft", "blue", "orange")
LINE_HEIGHT: Final = 16.0
SIZES: Final = "text{font:13px system-ui,sans-serif}text.small{font-size:11.5px}text.bold{font-weight:600}"


def _rules(colours: dict[str, str]) -> str:
    """One class a colour: lines take it as ``line NAME``, filled shapes as ``fill NAME``, words as themselves."""
    inks = "".join(f".line.{ink}{{stroke:{colours[ink]}}}.fill.{ink},text.{ink}{{fill:{colours[ink]}}}" for ink in INKS)
    return f".sheet{{fill:{colours['sheet']}}}.panel{{fill:{colours['panel']};stroke:{colours['soft']}}}{inks}"


def _n(number: float) -> str:
    """A coordinate to a tenth of a pixel."""
    return f"{number:.1f}".removesuffix(".0").replace("-0", "-0" if abs(number) >= 0.05 else "0")


class Canvas:
    """Shapes in the order they were drawn; y grows downwards, as in SVG."""

    def __init__(self, width: int, height: int, title: str) -> None:
        self._size = (width, height)
        self._title = title
        self._shapes: list[str] = []

    def line(self, points: Iterable[Point], ink: str = "ink", *, width: float = 1.5) -> None:
        """A line through all points."""
        path = "M" + "L".join(f"{_n(x)} {_n(y)}" for x, y in points)
        self._shapes.append(f'<path class="line {ink}" stroke-width="{width:g}" d="{path}"/>')

    def arrow(self, points: Iterable[Point], ink: str = "ink") -> None:
        """A line with a head at its end."""
        line = list(points)
        self.line(line, ink)
        self._head(line[-2], line[-1], ink)

    def _head(self, before: Point, tip: Point, ink: str) -> None:
        (x0, y0), (x1, y1) = before, tip
        length = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        corners = ((x1, y1), (x1 - 9 * ux - 4 * uy, y1 - 9 * uy + 4 * ux), (x1 - 9 * ux + 4 * uy, y1 - 9 * uy - 4 * ux))
        points = " ".join(f"{_n(x)},{_n(y)}" for x, y in corners)
        self._shapes.append(f'<polygon class="fill {ink}" points="{points}"/>')

    def box(self, x: float, y: float, width: float, height: float) -> None:
        """A panel with rounded corners."""
        at = f'x="{_n(x)}" y="{_n(y)}" width="{_n(width)}" height="{_n(height)}"'
        self._shapes.append(f'<rect class="panel" {at} rx="5"/>')

    def text(
        self, x: float, y: float, words: str, *, ink: str = "ink", style: str = "", anchor: Anchor = "middle"
    ) -> None:
        """One line of words."""
        at = f'x="{_n(x)}" y="{_n(y)}" text-anchor="{anchor}"'
        self._shapes.append(f'<text class="{ink} {style}" {at}>{escape(words)}</text>')

    def lines_of_text(self, x: float, y: float, lines: Iterable[str]) -> None:
        """Small soft lines below one another, the first at ``y``."""
        for number, words in enumerate(lines):
            self.text(x, y + LINE_HEIGHT * number, words, ink="soft", style="small")

    def svg(self) -> str:
        """The whole file."""
        width, height = self._size
        style = f".line{{fill:none}}{SIZES}{_rules(LIGHT)}@media (prefers-color-scheme:dark){{{_rules(DARK)}}}"
        head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" role="img">'
        sheet = f'<rect class="sheet" width="{width}" height="{height}" rx="8"/>'
        parts = [
            head,
            f"<title>{escape(self._title)}</title>",
            f"<style>{style}</style>",
            sheet,
            *self._shapes,
            "</svg>",
        ]
        return "\n".join(parts) + "\n"
