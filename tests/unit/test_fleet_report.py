"""springscale fleet-report: whole pages, names that cannot break them, and queries that count the same."""

import json
import re
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import polars as pl
import pytest
from click.testing import Result
from support.commands import called
from support.fleet import DAY_S, MONDAY_S, row, week, write_table
from support.html_page import Page, assert_self_contained, assert_well_formed

from gateway.archive import place_of
from gateway.archive.fleet.fleet import FleetSummary, fleet_of
from gateway.archive.fleet.weeks import monday_of
from gateway.cli import main
from gateway.reports.charts import Rule
from gateway.reports.fleet.text import page_of, time_axis
from gateway.reports.fleet.vehicle_page import vehicle_sections

EVIL = "<script>alert(1)</script>\"'&"
N_WEEKS = 26


def run(dataset: Path, output: Path) -> Result:
    return called("fleet-report", dataset, "--output", output, "--json")


def drifting() -> list[dict[str, Any]]:
    rng = np.random.default_rng(1)
    return [
        one
        for number in range(N_WEEKS)
        for one in week(number, damper_front_ratio=1.0 + 0.01 * number + rng.normal(0.0, 0.002), misfit=1.0)
    ]


def failing() -> list[dict[str, Any]]:
    """Answers for sixty days, of the first an overload; then a sensor that is stuck."""
    batches = [
        row(MONDAY_S + day * DAY_S + 300 * k, *(["acceleration_stuck"] if day >= 60 else []))
        for day in range(80)
        for k in range(1, 5)
    ]
    batches[0]["over_limit"] = ["gross"]
    return batches


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """report/ of a data set with a vehicle that drifts, one that fails, one that was silent, one without a batch."""
    folder = tmp_path_factory.mktemp("fleet")
    dataset = folder / "dataset"
    write_table(dataset, "van-1", drifting())
    write_table(dataset, "van-2", failing())
    write_table(dataset, "van-3", week(0, 5, "too_slow", EVIL))
    write_table(dataset, "van-4", [], failed=[{"log": f"{EVIL}.log", "reason": f"line 1: {EVIL}"}])
    done = run(dataset, folder / "report")
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)["report"] == str(folder / "report/report.html")
    return folder / "report"


@pytest.fixture(scope="module")
def page(made: Path) -> Page:
    return Page((made / "report.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def numbers(made: Path) -> dict[str, Any]:
    return dict(json.loads((made / "report.json").read_text(encoding="utf-8")))


def pages(made: Path) -> list[Path]:
    return [made / "report.html", *sorted((made / "vehicles").glob("*.html"))]


def table(page: Page, first: str) -> list[list[str]]:
    """The table whose second column is of that name."""
    return next(one for one in page.tables if one[0][1] == first)


def test_vehicles_that_need_attention_come_first_with_their_numbers(page: Page) -> None:
    looks = {(look[0], look[1]): look[2] for look in table(page, "what")[1:]}
    bad = looks["van-2", "sensor: acceleration_stuck"]
    assert "14 of 14 days (78 to 100 %)" in bad
    assert "since 2026-03-06" in bad
    drift = looks["van-1", "drift: front dampers, of the calibrated"]
    assert drift.startswith("+0.52 a year")
    assert f"{N_WEEKS} weeks" in drift
    assert looks["van-3", "few answers"].startswith("0.0 % of 5 batches")
    assert looks["van-3", "silent"] == "its last batch is of 2026-01-05"
    assert ("van-4", "no batch") in looks
    assert looks["van-4", "logs failed"].startswith("1,")
    assert looks["van-2", "over a limit"] == "0.4 % of 240 answered batches"
    assert [look[1] for look in table(page, "what")[1:3]] == ["over a limit", "sensor: acceleration_stuck"]


def test_no_refusal_is_dropped(page: Page, numbers: dict[str, Any]) -> None:
    refused = {line[0]: line[1:4] for line in next(one for one in page.tables if one[0][0] == "Reason")[1:]}
    assert refused["acceleration_stuck"] == ["80", "14 %", "1"]
    assert refused["too_slow"] == ["5", "0.9 %", "1"]
    assert refused[EVIL][0] == "5"
    assert numbers["n"] == N_WEEKS * 10 + 320 + 5 == sum(vehicle["n"] for vehicle in numbers["vehicles"])
    assert numbers["n_answered"] == N_WEEKS * 10 + 240


def test_unknown_is_a_dash_on_the_page_and_null_in_json(page: Page, numbers: dict[str, Any]) -> None:
    line = next(line for line in table(page, "batches") if line[0] == "van-3")
    assert (line[2], line[3], line[4]) == ("0.0 %", "–", "–")
    [monday] = numbers["vehicles"][2]["weeks"]
    assert (monday["n"], monday["n_answered"]) == (5, 0)
    assert monday["monday"] == "2026-01-05"
    assert all(monday[name] is None for name in ("payload_mean_kg", "payload_low_kg", "damper_front_ratio"))


def test_a_vehicles_page_has_every_week_with_its_number_of_batches(made: Path) -> None:
    van = Page((made / "vehicles/van-1.html").read_text(encoding="utf-8"))
    weeks = table(van, "batches")
    assert len(weeks) == N_WEEKS + 1
    assert weeks[1][1:5] == ["10", "10", "100 kg (92 to 108)", "100 to 100 kg"]
    slopes = next(one for one in van.tables if one[0][0] == "Parameter")
    assert [line[-1] for line in slopes[1:]] == ["yes", "no"]


def test_a_new_calibration_is_marked_and_the_slope_begins_there(tmp_path: Path) -> None:
    rows = [one for number in range(20) for one in week(number, calibration_id=f"sha256:{number // 12}", misfit=1.0)]
    write_table(tmp_path / "dataset", "van", rows)
    [van] = fleet_of(place_of(str(tmp_path / "dataset"))).vehicles
    charts = [chart for section in vehicle_sections(van) for chart in section.charts]
    [rule] = [mark for panel in charts[-1].panels for mark in panel.marks if isinstance(mark, Rule)]
    assert monday_of(int(rule.at)) == date(2026, 1, 5) + timedelta(weeks=12)


def test_every_page_is_well_formed_and_links_only_to_files_beside_it(made: Path) -> None:
    """No name breaks out of a page, and every chart is a picture with words."""
    for path in pages(made):
        text = path.read_text(encoding="utf-8")
        alts = Page(text).alts
        assert_well_formed(Page(text))
        assert_self_contained(path)
        assert all(len(alt) > 40 for alt in alts)
        assert text.count("<img") == text.count("<figure") == len(alts) > 0
        assert "<script>alert" not in text
        assert text.count("<script") == text.count("</script>")
    report = (made / "report.html").read_text()
    assert "&lt;script&gt;alert(1)&lt;/script&gt;&quot;&#x27;&amp;.log" in report
    assert '<img src="figures/refused.svg"' in report


@pytest.mark.parametrize("name", ["van-17", "../../etc/passwd", "a b", "", EVIL, "x" * 300])
def test_a_vehicles_page_is_a_file_of_its_folder(name: str) -> None:
    assert re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*\.html", page_of(name))
    assert page_of("van-17") == "van-17.html"


def test_months_are_named_where_they_begin() -> None:
    axis = time_axis(pl.Series(range(2922, 2930)))  # from 2025-12-29 on
    assert axis.ticks == ((2923.0, "2026-01"), (2927.0, "2026-02"))
    assert time_axis(pl.Series([2923])).ticks == ((2923.0, "2026-01"),)


def test_an_invalid_data_set_is_reported_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["fleet-report", str(tmp_path), "--output", str(tmp_path / "report")])
    assert left.value.code == 2
    assert "holds no receipt" in capsys.readouterr().err


def test_a_torn_receipt_is_reported_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place_of(tmp_path).replace(write_table(tmp_path, "van-1", week(0, 6)).receipt, b"")
    with pytest.raises(SystemExit) as left:
        main(["fleet-report", str(tmp_path), "--output", str(tmp_path / "report")])
    assert left.value.code == 1
    assert "is no receipt" in capsys.readouterr().err


PAGE = (Path(__file__).parents[2] / "docs/archive.md").read_text(encoding="utf-8")
TEXT = PAGE.partition("## The report of a fleet")[2]
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
        (vehicle.name, str(monday)): (n, mean)
        for vehicle in fleet.vehicles
        for monday, n, mean in vehicle.weeks.select("monday", "n_answered", "payload_mean_kg").rows()
    }


def refusals(fleet: FleetSummary) -> dict[tuple[str, str], int]:
    return {(vehicle.name, reason): n for vehicle in fleet.vehicles for reason, n in vehicle.n_refused.items()}


def shown(number: int, names: dict[str, Any], replaced: dict[str, str]) -> dict[str, Any]:
    code = PYTHON[number]
    for name, path in replaced.items():
        code = code.replace(name, path)
    exec(code, names)
    return names


def test_duckdb_agrees_with_the_report(dataset: Path, fleet: FleetSummary) -> None:
    by_reason, by_week = (duckdb.sql(one.replace("DATASET", str(dataset))).fetchall() for one in SQL)
    assert {(vehicle, reason): n for vehicle, reason, n in by_reason} == refusals(fleet)
    assert {(vehicle, str(at)[:10]): (n, mean) for vehicle, at, n, mean in by_week} == loads(fleet)


def test_polars_agrees_with_the_report(dataset: Path, fleet: FleetSummary) -> None:
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
