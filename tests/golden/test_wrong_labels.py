"""A load that was noted wrong is named: recorded drives of known load, one of them with another label."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from support.recordings import recordings

from gateway.calibration.campaign import Campaign, load_campaign
from gateway.calibration.inspection.finding import Kind
from gateway.calibration.inspection.loads import compare_loads
from gateway.calibration.known_run import KnownRun
from gateway.cli import springscale
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import front_share_pct
from gateway.offline.campaigns import split_runs

SIX = (1, 3, 5, 6, 7, 9)


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return load_campaign(recordings() / "known_loads/campaign.toml")


@pytest.fixture(scope="module")
def runs(campaign: Campaign) -> list[KnownRun]:
    return [one.identification for one in split_runs(campaign, BatchSettings())]


def named(
    campaign: Campaign, runs: list[KnownRun], wrong: int, payload_kg: float, chosen: Sequence[int]
) -> list[tuple[int, Kind]]:
    """What is found where run ``wrong`` is labelled with this payload, at its place or amidships."""
    place_m = campaign.runs[wrong - 1].payload_position_m or 1.4
    share_pct = front_share_pct(campaign.vehicle, payload_kg, place_m)
    label = {"payload_kg": payload_kg, "front_share_pct": share_pct}
    labelled = [replace(run, **label) if run.number == wrong else run for run in runs if run.number in chosen]
    return [(number, Kind(finding.kind)) for number, finding in compare_loads(labelled, campaign.vehicle)]


@pytest.mark.parametrize(("wrong", "payload_kg"), [(6, 150.0), (6, 450.0), (1, 60.0), (1, 120.0)])
def test_the_run_that_was_labelled_wrong_is_named_and_no_other(
    campaign: Campaign, runs: list[KnownRun], wrong: int, payload_kg: float
) -> None:
    assert named(campaign, runs, wrong, payload_kg, range(1, 11)) == [(wrong, Kind.LOAD_DISAGREES)]


@pytest.mark.parametrize("wrong", [1, 5, 6, 9])
def test_whichever_of_six_it_is(campaign: Campaign, runs: list[KnownRun], wrong: int) -> None:
    true_kg = campaign.runs[wrong - 1].payload_kg
    stated_kg = true_kg - 150.0 if true_kg > 200.0 else true_kg + 150.0
    assert named(campaign, runs, wrong, stated_kg, SIX) == [(wrong, Kind.LOAD_DISAGREES)]


def test_six_true_labels_raise_no_doubt(campaign: Campaign, runs: list[KnownRun]) -> None:
    assert list(compare_loads([run for run in runs if run.number in SIX], campaign.vehicle)) == []


def test_the_report_of_six_runs_with_one_wrong_label_calls_nothing_fit(tmp_path: Path) -> None:
    source = recordings() / "known_loads"
    text = (source / "campaign.toml").read_text(encoding="utf-8")
    head, *tables = text.replace('"signals.toml"', f'"{source}/signals.toml"').split("[[runs]]")
    tables[5] = tables[5].replace("270.0", "150.0")
    six = [tables[number - 1].replace('log = "', f'log = "{source}/') for number in SIX]
    (tmp_path / "campaign.toml").write_text("[[runs]]".join([head, *six]), encoding="utf-8")
    files = [str(tmp_path / name) for name in ("campaign.toml", "vehicle.json", "report")]
    order = ["calibrate", files[0], "--output", files[1], "--report", files[2], "--estimator", "cross_spectrum"]
    told = CliRunner().invoke(springscale, [*order, "--json"], catch_exceptions=False)
    assert told.exit_code == 0, told.output
    found = json.loads(told.stdout)["inspection"]["runs"]
    assert [[one["kind"] for one in run["findings"]] for run in found] == [[], [], [], ["load_disagrees"], [], []]
    report = (tmp_path / "report/report.html").read_text(encoding="utf-8")
    assert "Not fit for use" in report
    assert "Fit for use" not in report
