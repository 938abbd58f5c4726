"""Pages that are made say what their sources say: those of docs/make.py, those of studies, and docs/scale.md.

A study's come from `python -m benchmarks.accuracy NAME --output DIR`: NAME.md, and its numbers NAME.json.
"""

import copy
import json
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import make
import pytest
from made import ROOT, agrees, filled
from scale import measured_figures
from vehicle_year import Scale, figure, limits_of

from benchmarks.accuracy.budget.study import budget_page
from benchmarks.accuracy.coverage import coverage_page
from benchmarks.accuracy.coverage_table import ALL_KINDS
from benchmarks.accuracy.delivery import delivery_page
from benchmarks.accuracy.disturbances import disturbances_page
from benchmarks.accuracy.drives import TRIPS
from benchmarks.accuracy.faults import faults_page
from benchmarks.accuracy.grades import GRADES, grades_page

DOCS = Path(__file__).parents[2] / "docs"
PAGES: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "budget": budget_page,
    "coverage": coverage_page,
    "delivery": delivery_page,
    "disturbances": disturbances_page,
    "sensor-faults": faults_page,
    "sensor-grades": grades_page,
}


def numbers(name: str) -> dict[str, Any]:
    return json.loads((DOCS / f"{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", PAGES)
def test_the_page_is_made_from_the_numbers(name: str) -> None:
    assert (DOCS / f"{name}.md").read_text(encoding="utf-8") == PAGES[name](numbers(name))


def test_coverage_pools_at_least_200_batches_of_every_kind_of_drive() -> None:
    lines = numbers("coverage")["lines"]
    assert {line["kind"] for line in lines} == {*TRIPS, ALL_KINDS}
    assert min(line["n_batches"] for line in lines if line["kind"] == ALL_KINDS) >= 200


def test_every_sensor_was_tried_on_every_van() -> None:
    found = numbers("sensor-grades")
    assert [one["name"] for one in found["grades"]] == [*GRADES]
    lines = {line["kind"]: line for line in found["lines"] if line["kind"] in GRADES}
    assert {line["n_vans"] for line in lines.values()} == {len(found["vans"])}


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


MEASURED = measured_figures()
ASSUMED = tomllib.loads((DOCS / "scale.toml").read_text(encoding="utf-8"))


def with_round_figures() -> tuple[dict[str, Any], dict[str, Any]]:
    """Figures whose sums are easily done by hand: an hour a day of batches of six minutes."""
    measured, assumed = copy.deepcopy(MEASURED), copy.deepcopy(ASSUMED)
    assumed["driving"] = {"hours_per_day": 1.0, "days_per_year": 365, "window_s": 360.0, "share_at_peak": 0.36}
    measured["records"]["parquet_bytes"] = {"per_record": 100.0, "per_file": 1000.0}
    measured["weighing"] = {"hours": 2.0, "cpu_s": 7.2, "cpu_s_per_answer": 0.36}
    measured["whole_bus"] |= {"frames_per_s": 1000, "gz_mframes_per_cpu_s": 10.0, "gz_bytes_per_hour": 1e8}
    measured["uplink"] |= {"wire_bytes_up": 990.0, "wire_bytes_down": 10.0, "cpu_us_per_message": 100.0}
    return measured, assumed


def test_a_vehicle_year_by_hand() -> None:
    scale = Scale(*with_round_figures())
    assert scale.records == 3650
    assert scale.parquet_bytes == 3650 * 100 + 12 * 1000
    assert scale.uplink_bytes == 3650 * 1000
    assert scale.weighing_core_hours == pytest.approx(365 * 0.001)
    assert scale.bus_core_hours == pytest.approx(365 * 0.001 + 365 * 0.36 / 3600)
    assert scale.messages_per_s_at_peak == pytest.approx(0.001)
    assert scale.stored_cost(1e9) == pytest.approx(12 * ASSUMED["prices"]["storage_per_gb_month"])


def test_the_first_limit_stands_first_and_each_by_hand() -> None:
    limits = limits_of(Scale(*with_round_figures()))
    numbers = [limit.n_vehicles for limit in limits]
    assert numbers == sorted(numbers)
    found = {limit.what: limit.n_vehicles for limit in limits}
    assert found["One core of the broker at the busiest moment"] == pytest.approx(10_000 / 0.001)
    cores, night = ASSUMED["machine"]["cores"], ASSUMED["machine"]["night_hours"]
    by_night = found["One machine weighs the whole year in a night, logs of the mapped frames"]
    assert by_night == pytest.approx(cores * night / 0.365)


def test_twice_the_driving_is_twice_of_everything_but_files() -> None:
    measured, assumed = with_round_figures()
    once = Scale(measured, assumed)
    twice = Scale(measured, {**assumed, "driving": {**assumed["driving"], "hours_per_day": 2.0}})
    for what in ("records", "sqlite_bytes", "bus_log_bytes", "uplink_bytes", "bus_core_hours", "messages_per_s_mean"):
        assert getattr(twice, what) == pytest.approx(2 * getattr(once, what))
    assert twice.objects == once.objects
    assert twice.messages_per_s_at_peak == once.messages_per_s_at_peak


@pytest.mark.parametrize(
    ("number", "shown"),
    [(0.0, "0"), (0.000123, "0.00012"), (1.0, "1"), (99.4, "99"), (123.4, "123"), (123456.0, "123 000")],
)
def test_figures_have_the_digits_that_count(number: float, shown: str) -> None:
    assert figure(number) == shown
