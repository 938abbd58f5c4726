"""The paper's section 4 from nothing, at a small scale: half of the loads, 80-second batches."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.html_page import Page, assert_self_contained

from gateway.calibration.file import load_calibration
from gateway.errors import ConfigurationError
from gateway.reports.paper.experiments import CAMPAIGNS, Extent
from gateway.reports.paper.reproduction import PAPER_PCT, reproduce, rows_of
from gateway.workbench import simulated_drives
from gateway.workbench.simulated_campaigns import Plan, plan_of

SMALL = Extent(seed=3, window_s=80.0, longest_s=125.0)  # two thirds of an experiment's drive make one batch
THINNED = ("load-sweep", "share-sweep", "ident", "experiment", "speeds")


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    def thinned(kind, vehicle, seed, longest_s) -> Plan:
        plan = plan_of(kind, vehicle, seed, longest_s if kind == "experiment" else SMALL.window_s + 5.0)
        return replace(plan, drives=plan.drives[:: 2 if kind in THINNED else 1])

    output = tmp_path_factory.mktemp("reproduced")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulated_drives, "plan_of", thinned)
        steps: list[tuple[int, int]] = []
        reproduce(output, SMALL, lambda what, done, of: steps.append((done, of)))
    assert steps == sorted(steps)
    assert steps[-1][0] < steps[-1][1]
    return output


def test_every_figure_is_in_the_page_and_a_file(reproduced: Path) -> None:
    page = (reproduced / "report.html").read_text(encoding="utf-8")
    figures = re.findall(r'<img src="(figures/[a-z0-9_]+\.svg)"', page)
    assert len(figures) == 12
    for figure in figures:
        assert (reproduced / figure).stat().st_size > 5_000
    assert_self_contained(reproduced / "report.html")


def test_a_quick_trial_is_marked_as_one(reproduced: Path) -> None:
    assert "A quick try with a part of the driving" in (reproduced / "report.html").read_text(encoding="utf-8")
    results = json.loads((reproduced / "report.json").read_text(encoding="utf-8"))
    assert results["is_whole"] is False
    assert Extent(seed=7, workers=2).is_whole


def test_the_page_compares_the_papers_numbers_with_ours(reproduced: Path) -> None:
    page = Page((reproduced / "report.html").read_text(encoding="utf-8"))
    results = json.loads((reproduced / "report.json").read_text(encoding="utf-8"))
    rows = {tuple(row) for table in page.tables for row in table}
    assert set(rows_of(results["tables"])) <= rows
    of_paper = " ".join(" ".join(row) for row in rows if "the paper" in row)
    assert all(f"{pct:.2f}" in of_paper for pair in PAPER_PCT.values() for pct in pair)


def test_every_method_is_judged_on_every_drive(reproduced: Path) -> None:
    results = json.loads((reproduced / "report.json").read_text(encoding="utf-8"))
    methods = {table["method"] for table in results["tables"]}
    assert {"ratio index", "ratio index, bands of the paper's Table 2"} <= methods
    assert len(results["tables"]) == 6 * len(methods)
    of_test_3 = [table for table in results["tables"] if table["drive"] == "test3"]
    assert all(table["n_batches"] == 10 for table in of_test_3)


def test_the_ratio_index_works_where_it_was_calibrated_and_not_at_other_speeds(reproduced: Path) -> None:
    """What the report exists to show."""
    results = json.loads((reproduced / "report.json").read_text(encoding="utf-8"))
    (test_3,) = (t for t in results["tables"] if t["drive"] == "test3" and t["method"] == "ratio index")
    errors_kg = {
        row["condition"]: row["payload_error_kg"] for row in results["sensitivity"] if row["method"] == "ratio index"
    }
    at_50_kmh_kg = test_3["payload"]["mean_abs_kg"]
    assert at_50_kmh_kg < 60.0
    assert abs(errors_kg["50kmh"]) < 100.0
    assert abs(errors_kg["130kmh"]) > 3.0 * at_50_kmh_kg


def test_the_numbers_follow_from_the_stored_results(reproduced: Path) -> None:
    for kind in CAMPAIGNS:
        assert (reproduced / "campaigns" / kind / "campaign.toml").is_file()
    calibration = load_calibration(reproduced / "vehicle_simulated.json")
    assert calibration.vehicle.name == "paper_van"
    assert np.allclose(calibration.seen.speed_mps, 50.0 / 3.6, atol=0.5)


def test_a_reproduction_is_not_written_over(reproduced: Path) -> None:
    with pytest.raises(ConfigurationError, match="there is a reproduction already"):
        reproduce(reproduced, SMALL)
