"""The drawings in the documents are what the code draws today."""

import make_drawings
import pytest
from generated import agrees


@pytest.mark.parametrize("name", make_drawings.DRAWINGS)
def test_a_drawing_is_up_to_date(name: str) -> None:
    drawn = make_drawings.DRAWINGS[name]()
    kept = (make_drawings.IMAGES / name).read_text(encoding="utf-8")
    assert agrees(kept, drawn, lambda number: make_drawings.TOLERANCE_PX), "run `make docs`"


@pytest.mark.parametrize(
    ("other", "is_same"),
    [("M1.0 20.4", True), ("M1.0 21.6", False), ("M1.0 20.4L3 3", False), ("L1.0 20.4", False)],
)
def test_only_numbers_may_differ_and_only_by_the_tolerance(other: str, is_same: bool) -> None:
    assert agrees("M1.0 20.5", other, lambda number: 1.0) is is_same
