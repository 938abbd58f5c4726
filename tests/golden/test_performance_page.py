"""docs/performance.md says what docs/performance.json says, which `make bench` measured; no speed is asserted."""

import json
from pathlib import Path

from make_performance import performance_page

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_is_made_from_the_figures() -> None:
    found = json.loads((DOCS / "performance.json").read_text(encoding="utf-8"))
    assert (DOCS / "performance.md").read_text(encoding="utf-8") == performance_page(found)


def test_everybody_of_the_comparison_stands_in_it() -> None:
    found = json.loads((DOCS / "performance.json").read_text(encoding="utf-8"))
    parts = {"decode", "formats", "day", "live", "service", "web", "weigh", "archive", "start", "simulator"}
    assert parts <= set(found)
    assert not [name for name, row in found["decode"]["rows"].items() if "skipped" in row]
