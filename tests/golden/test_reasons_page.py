"""docs/reasons.md explains every reason there is, and none that is not."""

import re
from pathlib import Path

from gateway.config import BatchSection
from gateway.records import Why

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "reasons.md").read_text(encoding="utf-8")
REASONS, _, _ = PAGE.partition("## Why an estimate is uncertain")
ROWS = [line.split("|") for line in REASONS.splitlines() if line.startswith("| `")]


def test_every_reason_is_explained_once() -> None:
    explained = [reason for row in ROWS for reason in re.findall(r"`(\w+)`", row[1])]
    assert sorted(explained) == sorted(Why)


def test_every_reason_says_what_to_do() -> None:
    assert [row[1] for row in ROWS if not (row[2].strip() and row[3].strip())] == []


def test_every_limit_it_names_is_a_setting() -> None:
    others = {"cross_spectrum", "ratio_index", "valid_when", "wheel_speed", "pitch_rate"}
    limits = {name for row in ROWS for name in re.findall(r"`(\w+_\w+)`", row[2] + row[3])} - others
    assert limits <= set(BatchSection.model_fields)
