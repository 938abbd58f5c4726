"""docs/scale.md says what footprint.json measured and scale.toml assumes, and its sums are right."""

import copy
import tomllib
from pathlib import Path
from typing import Any

import pytest
from scale import measured_figures
from vehicle_year import Scale, figure, limits_of

DOCS = Path(__file__).parents[2] / "docs"
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
