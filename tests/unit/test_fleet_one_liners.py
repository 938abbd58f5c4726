"""What docs/fleet-report.md shows for DuckDB and polars runs, and counts what the report counts."""

import json
import re
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.fleet import week, write_table

from gateway.archive import place_of
from gateway.archive.fleet.fleet import FleetSummary, fleet_of

TEXT = (Path(__file__).parents[2] / "docs/fleet-report.md").read_text(encoding="utf-8")
SQL = [one for block in re.findall(r"```sql\n(.*?)```", TEXT, re.DOTALL) for one in block.split(";") if one.strip()]
PYTHON = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two vehicles, and a table that no receipt vouches for."""
    folder = tmp_path_factory.mktemp("dataset")
    for name in ("van-1", "van-2"):
        rows = [*week(0, 6, damper_front_ratio=1.1), *week(1, 4, payload_kg=200.0)]
        write_table(folder, name, [*rows, *week(2, 3, "too_slow", "speed_missing")])
    orphan = write_table(folder, "van-1", week(3, 50), month="2026-02")
    (folder / orphan.receipt).unlink()
    return folder


@pytest.fixture(scope="module")
def fleet(dataset: Path) -> FleetSummary:
    return fleet_of(place_of(dataset))


def loads(fleet: FleetSummary) -> dict[tuple[str, str], tuple[int, float | None]]:
    """Number of answers and mean by vehicle and Monday, as the report has them."""
    return {
        (vehicle.name, str(monday)): (int(n), float(mean) if n else None)
        for vehicle in fleet.vehicles
        for monday, n, mean in zip(
            vehicle.weeks.mondays, vehicle.weeks.n_answered, vehicle.weeks.payload_mean_kg, strict=True
        )
    }


def refusals(fleet: FleetSummary) -> dict[tuple[str, str], int]:
    return {(vehicle.name, reason): n for vehicle in fleet.vehicles for reason, n in vehicle.n_refused.items()}


def shown(number: int, names: dict[str, Any], replaced: dict[str, str]) -> dict[str, Any]:
    code = PYTHON[number]
    for name, path in replaced.items():
        code = code.replace(name, path)
    exec(code, names)
    return names


def test_duckdb_counts_what_the_report_counts(dataset: Path, fleet: FleetSummary) -> None:
    by_reason, by_week = (duckdb.sql(one.replace("DATASET", str(dataset))).fetchall() for one in SQL)
    assert {(vehicle, reason): n for vehicle, reason, n in by_reason} == refusals(fleet)
    assert {(vehicle, str(at)[:10]): (n, mean) for vehicle, at, n, mean in by_week} == loads(fleet)


def test_polars_counts_what_the_report_counts(dataset: Path, fleet: FleetSummary) -> None:
    found = shown(0, {}, {"DATASET": str(dataset)})
    by_week = found["loads"].rows()
    assert {(vehicle, str(at)[:10]): (n, mean) for vehicle, at, n, mean in by_week} == loads(fleet)
    assert {(vehicle, reason): n for vehicle, reason, n in found["refusals"].rows()} == refusals(fleet)
    medians = {(vehicle, str(at)[:10]): (n, median) for vehicle, at, n, median in found["dampers"].rows()}
    assert medians["van-1", "2026-01-05"] == (6, 1.1)
    assert medians["van-1", "2026-01-12"] == (0, None)


def test_the_reports_own_numbers_are_a_table(tmp_path: Path) -> None:
    (tmp_path / "report.json").write_text(json.dumps({"vehicles": [{"vehicle": "van-1", "n": 3}]}))
    found = shown(1, {}, {"report/report.json": str(tmp_path / "report.json")})
    assert found["vehicles"].to_dicts() == [{"vehicle": "van-1", "n": 3}]
