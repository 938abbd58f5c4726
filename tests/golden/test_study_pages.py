"""docs/learning_curve.md, coverage.md, budget.md and their like say what the numbers beside them say, and nothing else.

They come from `python -m benchmarks.accuracy NAME --output DIR`: NAME.md, and its numbers NAME.json.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from benchmarks.accuracy.alarms import alarms_page
from benchmarks.accuracy.budget import budget_page
from benchmarks.accuracy.coverage_drives import TRIPS
from benchmarks.accuracy.coverage_page import coverage_page
from benchmarks.accuracy.coverage_table import ALL_KINDS
from benchmarks.accuracy.delivery_page import delivery_page
from benchmarks.accuracy.disturbances_page import WELL, disturbances_page, held_or_refused, is_mended
from benchmarks.accuracy.disturbed import DISTURBANCES, UNDISTURBED
from benchmarks.accuracy.pages import learning_curve_page
from benchmarks.accuracy.phones import CAN, phones_page
from benchmarks.accuracy.siblings import siblings_page
from benchmarks.accuracy.siblings.study import Way

DOCS = Path(__file__).parents[2] / "docs"
PAGES: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "learning_curve": learning_curve_page,
    "coverage": coverage_page,
    "disturbances": disturbances_page,
    "siblings": siblings_page,
    "events": delivery_page,
    "alarm_rules": alarms_page,
    "budget": budget_page,
    "phone_accuracy": phones_page,
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


def test_every_disturbance_is_held_refused_or_mended() -> None:
    lines = {line["kind"]: line for line in numbers("disturbances")["lines"] if line["kind"] != ALL_KINDS}
    assert set(lines) == set(DISTURBANCES)
    undisturbed = lines[UNDISTURBED.name]
    for name, line in lines.items():
        assert min(held_or_refused(line, "payload"), held_or_refused(line, "front_share")) >= WELL, name
        if DISTURBANCES[name].is_mended:
            assert is_mended(line, undisturbed), name


def test_every_plain_change_of_load_is_told_and_none_is_invented() -> None:
    found = numbers("events")
    assert len(found["vans"]) >= 20
    told = found["said"]["carries"]["found"]
    assert told["found_above_3_std"]["n"] == told["found_above_3_std"]["n_told"] >= 50
    assert told["stops_without_change"]["n_told"] == told["under_way"]["n_told"] == 0
    assert told["stops_without_change"]["n"] >= 30


def test_the_learning_curve_holds_every_size_and_all_27_triples() -> None:
    found = numbers("learning_curve")
    assert {2, 3, 4, 6, 10} <= {rung["n_runs"] for rung in found["rungs"]}
    assert {(rung["estimator"], rung["n_subsets"]) for rung in found["triples"]} == {
        ("cross_spectrum", 27),
        ("ratio_index", 27),
    }


def test_a_sister_is_worth_more_than_priors_and_her_intervals_hold() -> None:
    rows = {row["estimator"]: row for row in numbers("siblings")["rows"]}
    assert set(rows) == set(Way)
    for way in (Way.LIKE_ONE, Way.LIKE_ONE_TWO_DRIVES, Way.LIKE_THREE):
        for other in (Way.AS_IS, Way.WEIGHED_EMPTY, Way.ALONE):
            for quantity in ("payload", "front_share"):
                error = f"{quantity}_mean_abs_pct_with_misses"
                assert rows[way][error] < 0.5 * rows[other][error]
        assert rows[way]["payload_coverage"]["share"] >= 0.93
        assert rows[way]["front_share_coverage"]["share"] >= 0.93
        assert rows[way]["n_rejected"] <= 0.12 * rows[way]["n_batches"]


def test_a_phone_errs_little_more_than_a_can_imu_and_its_intervals_hold() -> None:
    rows = {row["sensor"]: row for row in numbers("phone_accuracy")["rows"]}
    assert len(rows) == 4
    for row in rows.values():
        assert row["payload"]["mean_abs_pct_of_rated"] < 2.0 * rows[CAN]["payload"]["mean_abs_pct_of_rated"]
        assert row["payload"]["coverage95"] >= 0.95
        assert row["front_share"]["coverage95"] >= 0.95
        assert row["n_rejected"] < 0.5 * row["n_batches"]


def test_alarms_are_told_of_what_is_too_heavy_and_hardly_of_what_is_not() -> None:
    found = numbers("alarm_rules")
    lines = {line["distance"]: line for line in found["lines"]}
    assert lines[-2.0]["n_final"] == 0
    assert lines[3.0]["n_final"] >= 0.99 * found["n_loads"]
    for line in found["days"]["lines"]:
        assert line["truth"] != "far_under" or line["n_final"] <= 0.02 * line["n"]
        assert line["truth"] != "far_over" or line["n_final"] >= 0.8 * line["n"]
    for line in lines.values():  # the gap keeps them from coming and going
        assert line["n_alarms"] <= line["n_alarms_without_gap"]
