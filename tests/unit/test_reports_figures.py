"""Figures are files of their own, and the same numbers draw the same bytes."""

from pathlib import Path

import numpy as np
import pytest

from gateway.reports.charts.still import panels, save


def drawn(directory: Path, last: float) -> str:
    figure, (left, right) = panels(1, 2)
    left.plot(np.arange(5.0), np.arange(5.0) ** 2, label="payload [kg] < 300")
    right.plot([0.0, 1.0], [0.0, last])
    left.legend()
    return save(figure, directory, "one")


def test_the_same_numbers_draw_the_same_bytes(tmp_path: Path) -> None:
    one, same, other = (drawn(tmp_path / name, last) for name, last in (("a", 1.0), ("b", 1.0), ("c", 2.0)))
    assert one == same
    assert one != other
    assert (tmp_path / "a" / "one.png").read_bytes() == (tmp_path / "b" / "one.png").read_bytes()


def test_the_element_can_stand_in_a_page(tmp_path: Path) -> None:
    element = drawn(tmp_path, 1.0)
    assert element.startswith("<svg")
    assert element.rstrip().endswith("</svg>")
    assert "payload [kg] &lt; 300" in element


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (2, 1), (1, 3)])
def test_panels_come_row_by_row(rows: int, columns: int) -> None:
    figure, axes = panels(rows, columns)
    assert len(axes) == rows * columns
    assert figure.axes == axes
