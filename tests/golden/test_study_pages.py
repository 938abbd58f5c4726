"""docs/coverage.md and its like say what the numbers beside them say, and nothing else.

They come from `python -m benchmarks.accuracy NAME --output DIR`: NAME.md, and its numbers NAME.json.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from benchmarks.accuracy.budget.study import budget_page
from benchmarks.accuracy.coverage import coverage_page
from benchmarks.accuracy.coverage_table import ALL_KINDS
from benchmarks.accuracy.delivery import delivery_page
from benchmarks.accuracy.disturbances import disturbances_page
from benchmarks.accuracy.drives import TRIPS
from benchmarks.accuracy.false_facts import false_facts_page
from benchmarks.accuracy.faults import faults_page
from benchmarks.accuracy.grades import GRADES, grades_page
from benchmarks.accuracy.phones import CAN, phones_page
from benchmarks.accuracy.siblings import siblings_page

DOCS = Path(__file__).parents[2] / "docs"
PAGES: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "budget": budget_page,
    "coverage": coverage_page,
    "delivery": delivery_page,
    "disturbances": disturbances_page,
    "false-facts": false_facts_page,
    "phone_accuracy": phones_page,
    "sensor-faults": faults_page,
    "sensor-grades": grades_page,
    "siblings": siblings_page,
}


def numbers(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((DOCS / f"{name}.json").read_text(encoding="utf-8"))
    return found


@pytest.mark.parametrize("name", PAGES)
def test_the_page_is_made_from_the_numbers(name: str) -> None:
    assert (DOCS / f"{name}.md").read_text(encoding="utf-8") == PAGES[name](numbers(name))


def test_coverage_pools_at_least_200_batches_of_every_kind_of_drive() -> None:
    lines = numbers("coverage")["lines"]
    assert {line["kind"] for line in lines} == {*TRIPS, ALL_KINDS}
    assert min(line["n_batches"] for line in lines if line["kind"] == ALL_KINDS) >= 200


def test_a_phone_errs_little_more_than_a_can_imu_and_its_intervals_hold() -> None:
    rows = {row["sensor"]: row for row in numbers("phone_accuracy")["rows"]}
    assert len(rows) == 2
    for row in rows.values():
        assert row["payload"]["mean_abs_pct_of_rated"] < 2.0 * rows[CAN]["payload"]["mean_abs_pct_of_rated"]
        assert min(row["payload"]["coverage95"], row["front_share"]["coverage95"]) >= 0.95
        assert row["n_rejected"] < 0.5 * row["n_batches"]


def test_every_sensor_was_tried_on_every_van() -> None:
    found = numbers("sensor-grades")
    assert [one["name"] for one in found["grades"]] == [*GRADES]
    lines = {line["kind"]: line for line in found["lines"] if line["kind"] in GRADES}
    assert {line["n_vans"] for line in lines.values()} == {len(found["vans"])}
