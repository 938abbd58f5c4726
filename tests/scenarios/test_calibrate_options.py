"""springscale calibrate on four short drives: what its options name is held, and how far a fit is can be seen.

And where a number comes from: the log of every line, and a calibration's id from its drives, not from file names.
"""

import csv
import json
import shutil
from itertools import pairwise
from pathlib import Path

import pytest
from click.testing import Result
from support.commands import called, run
from support.known_load_logs import SIGNALS, write_known_loads

from gateway.calibration.campaign_file import load_campaign
from gateway.calibration.file import CalibrationFile, load_calibration
from gateway.calibration.from_drives import calibrate_inspected
from gateway.cli.progress import counted, on_share
from gateway.config import ESTIMATOR_NAMES
from gateway.core.batch_settings import BatchSettings
from gateway.core.ratio_index.index import PAPER_BANDS
from gateway.core.ratio_index.regression import MODEL_9_PAYLOAD, MODEL_10_FRONT_SHARE
from gateway.estimates.as_json import COLUMNS
from gateway.offline.campaigns import inspect

WINDOW = ("--window-s", "100")
N_RUNS = 4


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four short drives, all of them to identify."""
    return write_known_loads(tmp_path_factory.mktemp("options"), duration_s=110.0, identification_fraction=1.0)


def calibrate(campaign: Path, output: Path, *options: str) -> Result:
    asked = ["calibrate", str(campaign), "--output", str(output), *WINDOW, "--estimator", "ratio_index"]
    return called(*asked, *options)


def bands_of(held: CalibrationFile) -> list[tuple[float, float]]:
    pairs = (held.ratio_index.acceleration_bands, held.ratio_index.pitch_rate_bands)
    return [band for pair in pairs if pair is not None for band in pair]


def test_the_papers_bands_are_taken_as_named(campaign: Path, tmp_path: Path) -> None:
    """Four runs are too few for (11), which then gives way to (9) and (10)."""
    paper = [(band.centre_hz, band.width_hz) for pair in PAPER_BANDS.values() for band in pair]
    done = calibrate(campaign, tmp_path / "paper.json", "--bands", "table2")
    assert done.exit_code == 0, done.output
    held = load_calibration(tmp_path / "paper.json")
    assert bands_of(held) == paper
    assert held.ratio_index.payload.terms == MODEL_9_PAYLOAD
    assert held.ratio_index.front_share.terms == MODEL_10_FRONT_SHARE
    assert calibrate(campaign, tmp_path / "own.json").exit_code == 0
    own = load_calibration(tmp_path / "own.json")
    assert bands_of(own) != paper
    assert own.ratio_index.payload.terms == ("log_ra", "log_rg")


def test_an_unknown_name_is_a_usage_error(campaign: Path, tmp_path: Path) -> None:
    refused = calibrate(campaign, tmp_path / "none.json", "--bands", "widest")
    assert refused.exit_code == 2
    assert "is not one of" in refused.output


def test_an_id_does_not_depend_on_where_files_lie(
    campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "elsewhere"
    shutil.copytree(campaign.parent, elsewhere)
    ids = set()
    for where, name in ((campaign, "a.json"), (campaign, "b.json"), (elsewhere / "campaign.toml", "c.json")):
        asked = ["calibrate", str(where), "--output", str(tmp_path / name), "--estimator", "ratio_index", *WINDOW]
        monkeypatch.setattr("sys.argv", ["springscale", *asked])
        done = run(*asked)
        assert "payload_range_kg: not stated: using 0 to 450 kg" in done.stderr
        ids.add(load_calibration(tmp_path / name).id)
    assert len(ids) == 1
    command = load_calibration(tmp_path / "a.json").provenance.command
    assert command.startswith("springscale calibrate campaign.toml --estimator ratio_index")
    assert command.endswith("--window-s 100")


def test_every_line_of_several_logs_says_of_which_it_is(campaign: Path) -> None:
    logs = [str(campaign.parent / name) for name in ("01.log", "02.log")]
    asked = ("--signals", SIGNALS, *WINDOW)
    together = [json.loads(line) for line in run("estimate", *logs, *asked, "--json").stdout.splitlines()]
    alone = [
        json.loads(line)
        for log in logs
        for line in run("estimate", log, *asked, "--json").stdout.splitlines()
    ]  # fmt: skip
    assert {record["log"] for record in together} == set(logs)
    assert [{key: part for key, part in record.items() if key != "log"} for record in together] == alone
    lines = called(
        "estimate", *logs, *asked
    ).stdout.splitlines()  # ends with 1: nothing is weighed without a calibration
    assert [line.split(": ")[0] for line in lines] == [record["log"] for record in together]


def test_a_table_has_a_row_a_batch_and_the_columns_of_the_history(campaign: Path) -> None:
    logs = [str(campaign.parent / name) for name in ("01.log", "02.log")]
    asked = ("--signals", SIGNALS, *WINDOW)
    records = [json.loads(line) for line in run("estimate", *logs, *asked, "--json").stdout.splitlines()]
    rows = list(csv.DictReader(called("estimate", *logs, *asked, "--csv").stdout.splitlines()))
    assert list(rows[0]) == ["log", *COLUMNS]
    assert [row["log"] for row in rows] == [record["log"] for record in records]
    assert [row["payload_kg"] for row in rows] == [str(record["payload_kg"] or "") for record in records]
    (head, *_) = called("estimate", logs[0], *asked, "--csv").stdout.splitlines()
    assert head == ",".join(COLUMNS)
    both = called("estimate", *logs, *asked, "--csv", "--json")
    assert both.exit_code == 2
    assert "not both" in both.output


def test_every_estimator_tells_its_steps(campaign: Path) -> None:
    """A fit of many seconds."""
    loaded = load_campaign(campaign)
    inspection = inspect(loaded, BatchSettings(window_s=100.0))
    told: list[tuple[str, int, int]] = []
    calibrate_inspected(
        loaded.vehicle,
        inspection,
        where="",
        sha256="",
        estimators=ESTIMATOR_NAMES,
        on_fit=lambda *step: told.append(step),
    )
    for estimator in ESTIMATOR_NAMES:
        steps = [(done, of) for name, done, of in told if name == estimator]
        assert len(steps) >= N_RUNS
        assert {of for _, of in steps} == {steps[-1][0]}
        assert all(before < after for (before, _), (after, _) in pairwise(steps))


def test_the_bar_names_what_is_fitted(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with counted("fitting") as on_step:
        on_part = on_share(on_step, ESTIMATOR_NAMES)
        for name in ESTIMATOR_NAMES:
            on_part(name, 1, 2)
            on_part(name, 2, 2)
    told = capsys.readouterr().err
    assert "fitting cross spectrum" in told
    assert "fitting ratio index" in told
    assert "25%" in told
    assert "100%" in told
