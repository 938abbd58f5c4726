"""Where a number comes from: the log of every line, and a calibration's id from its drives, not from file names."""

import csv
import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from support.known_load_logs import SIGNALS, write_known_loads

from gateway.calibration.file.calibration_file import load_calibration
from gateway.cli import springscale
from gateway.estimate_json import COLUMNS

WINDOW = ("--window-s", "100")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_known_loads(tmp_path_factory.mktemp("provenance"), duration_s=110.0, identification_fraction=1.0)


def run(*arguments: str) -> Result:
    done = CliRunner().invoke(springscale, list(arguments), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done


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
    lines = run("estimate", *logs, *asked).stdout.splitlines()
    assert [line.split(": ")[0] for line in lines] == [record["log"] for record in together]


def test_a_table_has_a_row_a_batch_and_the_columns_of_the_history(campaign: Path) -> None:
    logs = [str(campaign.parent / name) for name in ("01.log", "02.log")]
    asked = ("--signals", SIGNALS, *WINDOW)
    records = [json.loads(line) for line in run("estimate", *logs, *asked, "--json").stdout.splitlines()]
    rows = list(csv.DictReader(run("estimate", *logs, *asked, "--csv").stdout.splitlines()))
    assert list(rows[0]) == ["log", *COLUMNS]
    assert [row["log"] for row in rows] == [record["log"] for record in records]
    assert [row["payload_kg"] for row in rows] == [str(record["payload_kg"] or "") for record in records]
    (head, *_) = run("estimate", logs[0], *asked, "--csv").stdout.splitlines()
    assert head == ",".join(COLUMNS)
    both = CliRunner().invoke(springscale, ["estimate", *logs, *asked, "--csv", "--json"])
    assert both.exit_code == 2
    assert "not both" in both.output
