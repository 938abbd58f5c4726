"""springscale learn, as a person calls it: logs of five ordinary drives and a table of notes, one of them wrong."""

import gzip
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest
from support.commands import called, printed
from support.known_load_logs import SIGNALS, write_known_loads

from gateway.calibration.file import load_calibration
from gateway.calibration.judgement.advice import Grade
from gateway.calibration.statements_csv import StatementsFileError
from gateway.estimates.quantity import Z95

README = Path(__file__).parents[2] / "README.md"
ABOARD_KG = {1: 0.0, 2: 200.0, 3: 380.0, 4: 120.0, 5: 300.0}
PLACES_M = (None, 1.8, 2.2, 1.5, 1.6)
NOTES = """vehicle;from;until;source;payload_kg;plus_minus_kg;ref;learn
van;2026-09-21 16:55;2026-09-21 17:10;empty;;;yard;
van;2026-09-21 19:40;2026-09-21 20:00;delivery_note;205;25;LS-1;
van;2026-09-21 22:30;2026-09-21 22:50;delivery_note;38;25;LS-2;
van;2026-09-22 01:10;2026-09-22 01:40;scale;120;10;ticket;no
van;2026-09-25 01:10;;delivery_note;90;25;LS-3;
other;2026-09-22 04:00;;delivery_note;90;25;LS-4;
van;soon;;delivery_note;90;25;LS-5;
"""
WINDOW = ("--window-s", "100")


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five logs, van.toml and notes.csv."""
    directory = tmp_path_factory.mktemp("ordinary")
    campaign = write_known_loads(directory, tuple(zip(ABOARD_KG.values(), PLACES_M, strict=True)))
    of_vehicle, _, _ = campaign.read_text(encoding="utf-8").partition("[[runs]]")
    (directory / "van.toml").write_text(of_vehicle, encoding="utf-8")
    (directory / "notes.csv").write_text(NOTES, encoding="utf-8")
    return directory


def learn_of(directory: Path, *more: object) -> list[object]:
    said = ("--vehicle", directory / "van.toml", "--statements", directory / "notes.csv")
    return ["learn", *sorted(directory.glob("*.log")), *said, *WINDOW, *more]


@pytest.fixture(scope="module")
def learnt(drives: Path) -> dict[str, Any]:
    return dict(json.loads(printed(*learn_of(drives, "--json", "--output", drives / "vehicle.json"))))


def test_a_dry_run_says_which_rows_match_a_drive_and_writes_nothing(drives: Path) -> None:
    before = set(drives.iterdir())
    said = printed(*learn_of(drives, "--dry-run"))
    assert "5 logs: 5 drives" in said
    assert "7 rows: 4 match a drive, 1 waits, 1 unknown vehicle (row 7), 1 bad (row 8)" in said
    assert "row 6: no drive within 12 hours" in said
    assert "row 7: vehicle: other: this one is van" in said
    assert "row 8: from: soon: no time" in said
    assert set(drives.iterdir()) == before


def test_drives_of_which_nothing_is_said_are_found_too(learnt: dict[str, Any]) -> None:
    for drive in learnt["drives"]:
        found = drive["found_without_statement"] or drive["found"]
        assert abs(found["payload_kg"] - ABOARD_KG[drive["number"]]) < found["plus_minus_kg"]


def test_true_notes_teach_and_the_wrong_one_is_held_and_asked_about(learnt: dict[str, Any]) -> None:
    by_ref = {one["ref"]: one for one in learnt["statements"]}
    assert {ref: one["state"] for ref, one in by_ref.items()} == {
        "yard": "used", "LS-1": "used", "LS-2": "held", "ticket": "checked", "LS-3": "waiting"
    }  # fmt: skip
    assert "is it with a digit missing? then 380 kg were aboard" in by_ref["LS-2"]["question"]
    assert by_ref["LS-3"]["found"] is None
    assert by_ref["ticket"]["found"] == learnt["drives"][3]["found"]


def test_the_calibration_is_written_with_a_verdict_and_what_would_help(drives: Path, learnt: dict[str, Any]) -> None:
    file = load_calibration(drives / "vehicle.json")
    assert file.id == learnt["calibration_id"]
    assert learnt["verdict"]["grade"] == Grade.RESERVED
    assert any("drive 3" in one["text"] for one in learnt["verdict"]["reasons"])
    assert learnt["learning"]["plus_minus_kg"] < learnt["learning"]["useful_at_kg"]


@pytest.fixture(scope="module")
def weighed(drives: Path, learnt: dict[str, Any]) -> list[str]:
    """The weights of a drive of which nothing was said, a line of JSON each."""
    files = ["--signals", drives / "signals.toml", "--calibration", learnt["output"]]
    return printed("estimate", drives / "05.log", *files, "--json", *WINDOW).splitlines()


def test_the_file_weighs_a_drive_of_which_nothing_was_said(weighed: list[str]) -> None:
    assert weighed
    for one in map(json.loads, weighed):
        assert abs(one["payload_kg"] - ABOARD_KG[5]) < Z95 * one["payload_std_kg"]


def test_readme_tells_how_much_leaves_the_van(weighed: list[str]) -> None:
    told = re.search(r"a value of (\d+) kB .*?about (\d+) MB a month", README.read_text(encoding="utf-8"), re.DOTALL)
    assert told
    n_bytes = len(json.dumps(json.loads(weighed[0]) | {"spectra": None}, separators=(",", ":")))
    month = 2 * n_bytes * 12 * 8 * 22  # with the retained copy; values an hour, hours a day, days
    assert float(told[1]) == pytest.approx(n_bytes / 1e3, rel=0.15)
    assert float(told[2]) == pytest.approx(month / 1e6, rel=0.15)


def test_a_table_that_cannot_be_read_is_refused_before_any_log_is(drives: Path, tmp_path: Path) -> None:
    notes = tmp_path / "notes.csv"
    notes.write_text("ref;payload\nLS-1;310\n", encoding="utf-8")
    with pytest.raises(StatementsFileError, match="no column from") as refused:
        printed("learn", drives / "01.log", "--vehicle", drives / "van.toml", "--statements", notes, "--dry-run")
    assert "did you mean payload_kg?" in str(refused.value)


@pytest.mark.parametrize(
    ("axle_kg", "more", "told"),
    [
        (1562, {"wheelbase_m": 2.8}, ["3124 kg empty on a wheelbase of 2.8 m: such vehicles weigh 862 to"]),
        (4600, {"wheelbase_m": 5.6}, []),  # 450 kg by default: said before, and not doubted too
        (4600, {"wheelbase_m": 5.6, "payload_range_kg": [0, 450]}, ["450 kg"]),
    ],
)
def test_unlikely_figures_of_the_vehicle_are_asked_about(
    drives: Path, tmp_path: Path, axle_kg: int, more: dict[str, object], told: list[str]
) -> None:
    keys = {"kerb_front_axle_kg": axle_kg, "kerb_rear_axle_kg": axle_kg, "sensor_position_m": 1.2, **more}
    lines = "".join(f"{name} = {figure}\n" for name, figure in keys.items())
    (tmp_path / "van.toml").write_text(f'[vehicle]\nname = "van"\n{lines}', encoding="utf-8")
    done = called("learn", drives / "01.log", "--vehicle", tmp_path / "van.toml", "--signals", SIGNALS, "--dry-run")
    assert done.exit_code == 0, done.output
    doubts = [line for line in done.stderr.splitlines() if "van.toml: unlikely: " in line]
    assert len(doubts) == len(told)
    assert all(part in line for part, line in zip(told, doubts, strict=True))


def _second_half(log: bytes) -> bytes:
    lines = log.splitlines(keepends=True)
    return b"".join(lines[len(lines) // 2 :])


def _undated(log: bytes) -> bytes:
    """Stamps since the first frame, as of ``candump -tz``."""
    lines = [line.partition(b") ") for line in log.splitlines(keepends=True)]
    first_s = int(lines[0][0][1:11])
    return b"".join(b"(%03d%s) %s" % (int(stamp[1:11]) - first_s, stamp[11:], rest) for stamp, _, rest in lines)


def _in_another_zone(log: bytes) -> bytes:
    """Stamps an hour later, as of a copy whose zone was not stated."""
    lines = [line.partition(b".") for line in log.splitlines(keepends=True)]
    return b"".join(b"(%d%s%s" % (int(stamp[1:]) + 3600, dot, rest) for stamp, dot, rest in lines)


@pytest.mark.parametrize(
    ("name", "copied"),
    [
        ("01.log.gz", gzip.compress),
        ("a.log", _second_half),
        ("01.log", lambda log: log),
        ("b.log", _in_another_zone),
        ("c.log", _undated),
    ],
)
@pytest.mark.parametrize("is_first", [False, True])
def test_driving_that_two_logs_have_teaches_once(
    name: str, copied: Callable[[bytes], bytes], is_first: bool, drives: Path, tmp_path: Path
) -> None:
    """It counted twice, and intervals were narrower than they may be. The longer log counts, whatever their order."""
    shutil.copy(drives / "01.log", tmp_path)
    (tmp_path / name).write_bytes(copied((drives / "01.log").read_bytes()))
    logs = [tmp_path / "01.log", tmp_path / name][:: -1 if is_first else 1]
    asked = ("--vehicle", drives / "van.toml", "--signals", SIGNALS, "--dry-run", *WINDOW)
    said = printed("learn", *logs, drives / "02.log", *asked)
    assert "3 logs: 2 drives" in said
    other, one = (logs[1], logs[0]) if copied is not _second_half else (tmp_path / name, tmp_path / "01.log")
    assert f"{other}: left out: of the same driving as {one}, which counts once" in said


def test_drives_without_a_date_are_not_taken_for_one(drives: Path, tmp_path: Path) -> None:
    logs = [tmp_path / "01.log", tmp_path / "02.log"]
    for log in logs:
        log.write_bytes(_undated((drives / log.name).read_bytes()))
    said = printed("learn", *logs, "--vehicle", drives / "van.toml", "--signals", SIGNALS, "--dry-run", *WINDOW)
    assert "2 logs: 1 drive with" in said
    assert f"{logs[1]}: left out: of the same driving as {logs[0]}" in said
    assert f"{logs[0]} and 1 other log: has no date" in said


def test_a_drive_without_a_date_has_none_anywhere(drives: Path, tmp_path: Path) -> None:
    log, output = tmp_path / "01.log", tmp_path / "vehicle.json"
    log.write_bytes(_undated((drives / log.name).read_bytes()))
    options = ("--vehicle", drives / "van.toml", "--signals", SIGNALS, "--output", output, *WINDOW)
    assert "  no date  " in printed("learn", log, *options)
    (drive,) = load_calibration(output).provenance.drives
    assert (drive.log, drive.t_start) == ("no date, 0 s", None)
    (told,) = json.loads(printed("learn", log, *options, "--json"))["drives"]
    assert (told["t_start"], told["t_start_ns"]) == (None, 0)


def test_the_zone_of_a_log_is_asked_for_where_statements_have_times(drives: Path, tmp_path: Path) -> None:
    log = tmp_path / "01.asc"
    with can.LogReader(drives / "01.log") as reader, can.ASCWriter(log) as writer:
        for message in reader:
            writer.on_message_received(message)
    said = printed("learn", log, "--vehicle", drives / "van.toml", "--signals", SIGNALS, "--dry-run", *WINDOW)
    assert f"{log}: its date states no zone, it is read as UTC" in said


def test_without_a_place_for_the_calibration_nothing_begins(drives: Path) -> None:
    done = called(*learn_of(drives))
    assert done.exit_code == 2
    assert "--output" in done.output
