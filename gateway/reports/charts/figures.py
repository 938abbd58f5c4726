"""Matplotlib figures without global state, saved reproducibly (the same numbers give the same bytes) as SVG and PNG."""

import io
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

_STYLE: Final[Any] = {  # matplotlib types its keys one by one
    "svg.fonttype": "none",
    "font.size": 9.0,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}
COLOURS: Final = ("#0b6fa4", "#d1495b", "#2e8b57", "#8e6c8a", "#edae49")


def panels(n_rows: int = 1, n_columns: int = 1, height_in: float = 3.2) -> tuple[Figure, list[Axes]]:
    """Create a figure 9 inches wide; return it and its panels, row by row."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(9.0, height_in * n_rows), layout="constrained")
        grid = figure.subplots(n_rows, n_columns, squeeze=False)
    return figure, list(grid.ravel())


def save(figure: Figure, directory: Path, name: str) -> str:
    """Write NAME.svg and NAME.png; return the SVG element for use in a page."""
    directory.mkdir(parents=True, exist_ok=True)
    text = io.StringIO()
    style: Any = {**_STYLE, "svg.hashsalt": name}
    with mpl.rc_context(style):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
        figure.savefig(directory / f"{name}.png", dpi=110, metadata={"Software": None})
    drawn = text.getvalue()
    (directory / f"{name}.svg").write_text(drawn, encoding="utf-8")
    return drawn[drawn.index("<svg") :]
