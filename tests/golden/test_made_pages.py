"""Pages that are made say what their sources say."""

import json
from pathlib import Path
from typing import Any

import make
import pytest
from made import ROOT, filled

from benchmarks.accuracy.coverage_table import ALL_KINDS
from benchmarks.accuracy.drives import TRIPS

DOCS = Path(__file__).parents[2] / "docs"


def numbers(name: str) -> dict[str, Any]:
    return json.loads((DOCS / f"{name}.json").read_text(encoding="utf-8"))


def test_coverage_pools_at_least_200_batches_of_every_kind_of_drive() -> None:
    lines = numbers("coverage")["lines"]
    assert {line["kind"] for line in lines} == {*TRIPS, ALL_KINDS}
    assert min(line["n_batches"] for line in lines if line["kind"] == ALL_KINDS) >= 200


@pytest.mark.parametrize("page", make.pages())
def test_a_page_is_up_to_date(page: str) -> None:
    kept = (ROOT / page).read_text(encoding="utf-8")
    read = json.loads if page.endswith(".json") else str  # 0 and 0.0 are one number
    assert read(kept) == read(make.text_of(page)), "run `make docs`"


def test_marks_and_parts_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="other"):
        filled("<!-- made: one -->\n<!-- end: one -->\n", {"one": str, "other": str})
