"""docs/accuracy.md says what the reproduction's numbers beside it say, and nothing else.

Both come from `springscale reproduce --output DIR`: accuracy.md, and results.json as docs/accuracy.json.
"""

import json
from pathlib import Path

from gateway.reports.paper.table import PAPER_PCT, TITLES, accuracy_page

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_is_made_from_the_numbers() -> None:
    results = json.loads((DOCS / "accuracy.json").read_text(encoding="utf-8"))
    assert (DOCS / "accuracy.md").read_text(encoding="utf-8") == accuracy_page(results)


def test_every_drive_is_there_for_every_method() -> None:
    results = json.loads((DOCS / "accuracy.json").read_text(encoding="utf-8"))
    drives = {(table["drive"], table["split"]) for table in results["tables"]}
    methods = {table["method"] for table in results["tables"]}
    assert drives == set(TITLES)
    assert len(results["tables"]) == len(drives) * len(methods)
    assert set(PAPER_PCT) < drives
    assert results["window_s"] == 300.0
