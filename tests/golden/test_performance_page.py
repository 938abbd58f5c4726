"""docs/performance.md says what docs/performance.json says, which `make bench` measured; no speed is asserted."""

import json
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def test_everybody_of_the_comparison_stands_in_it() -> None:
    found = json.loads((DOCS / "performance.json").read_text(encoding="utf-8"))
    parts = {"decode", "formats", "day", "live", "service", "web", "weigh", "archive", "start", "simulator"}
    assert parts <= set(found)
    assert not [name for name, row in found["decode"]["rows"].items() if "skipped" in row]
