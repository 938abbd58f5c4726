"""Every page that docs/make.py makes says what its source does, and it compares as it says."""

import make
import pytest
from made import ROOT, agrees, filled


@pytest.mark.parametrize("page", make.pages())
def test_a_page_is_up_to_date(page: str) -> None:
    kept = (ROOT / page).read_text(encoding="utf-8")
    assert agrees(kept, make.text_of(page), lambda number: make.tolerance_of(page)), "run `make docs`"


def test_marks_and_parts_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="other"):
        filled("<!-- made: one -->\n<!-- end: one -->\n", {"one": str, "other": str})


@pytest.mark.parametrize(
    ("other", "is_same"),
    [("M1.0 20.4", True), ("M1.0 21.6", False), ("M1.0 20.4L3 3", False), ("L1.0 20.4", False)],
)
def test_only_numbers_may_differ_and_only_by_the_tolerance(other: str, is_same: bool) -> None:
    assert agrees("M1.0 20.5", other, lambda number: 1.0) is is_same
