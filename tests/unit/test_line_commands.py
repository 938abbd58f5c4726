"""springscale line build and show, calibrate --like: what they write, what they say, what they refuse."""

import json
from pathlib import Path

import pytest
from support.calibrated import calibration_file
from support.commands import called, run
from support.known_load_logs import write_known_loads

from gateway.calibration.file.calibration_file import load_calibration
from gateway.calibration.file.hashed import content_id
from gateway.calibration.file.line_file import load_like
from gateway.errors import ConfigurationError

FAST = ("--estimator", "cross_spectrum", "--window-s", "100")


def refused(*arguments: str | Path) -> str:
    """What a person is told who made a mistake."""
    ended = called(*arguments)
    if isinstance(ended.exception, ConfigurationError):
        return str(ended.exception)
    assert ended.exit_code == 2
    return ended.output


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Loads in four runs."""
    return write_known_loads(tmp_path_factory.mktemp("drives"), identification_fraction=1.0)


@pytest.fixture(scope="module")
def sisters(drives: Path) -> list[Path]:
    """Three calibrations, each of two of the drives; nobody minds that it is one van."""
    files = []
    for loaded in ("2", "3", "4"):
        files.append(drives.parent / f"sister_{loaded}.json")
        run("calibrate", drives, "--runs", f"1,{loaded}", "--output", files[-1], *FAST)
    return files


def test_one_empty_drive_and_a_sister_make_a_calibration(drives: Path, sisters: list[Path], tmp_path: Path) -> None:
    output = tmp_path / "van.json"
    made = run("calibrate", drives, "--runs", "1", "--like", sisters[0], "--output", output, "--window-s", "100")
    assert "inherited from 1 of its line" in made.stdout
    assert "one_load_only" not in made.stdout
    assert "warning: ratio_index: " in made.stdout
    file, sister = load_calibration(output), load_calibration(sisters[0])
    assert file.line.members == (sister.id,)
    assert file.estimators == ("cross_spectrum",)
    assert f"--like {sister.id}" in file.provenance.command
    assert file.seen.payload_kg == sister.seen.payload_kg
    shown = run("calibration", "show", output).stdout
    assert sister.id in shown
    assert {"inherited", "its own"} <= {row[52:].strip() for row in shown.splitlines() if "±" in row}
    verified = run("calibration", "verify", output, "--logs", drives)
    assert f"inherited from {sister.id}" in verified.stdout
    told = run("calibration", "diff", sisters[0], output)
    assert "line.members: absent -> " in told.stdout


def test_a_line_is_built_shown_and_inherited_from(drives: Path, sisters: list[Path], tmp_path: Path) -> None:
    line, output = tmp_path / "line.json", tmp_path / "van.json"
    built = run("line", "build", *sisters, "--output", line, "--json")
    record = json.loads(built.stdout)
    assert record["members"] == sorted(load_calibration(path).id for path in sisters)
    assert (record["n_siblings"], record["warnings"]) == (3, ["siblings_not_left_out"])
    assert load_like(line).id == record["line_id"]
    shown = run("line", "show", line).stdout
    assert "estimated from 3 of them" in shown
    assert "spring_front_npm" in shown
    run("calibrate", drives, "--runs", "1", "--like", line, "--output", output, *FAST)
    held = load_calibration(output).line
    assert list(held.members) == record["members"]
    assert held.n_siblings == 3


def test_the_order_of_files_does_not_change_the_line(sisters: list[Path], tmp_path: Path) -> None:
    for name, files in (("one", sisters), ("other", sisters[::-1])):
        run("line", "build", *files, "--output", tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()


def test_a_file_that_is_named_twice_is_one_vehicle(sisters: list[Path], tmp_path: Path) -> None:
    for name, files in (("one", sisters), ("other", [*sisters, sisters[0]])):
        built = run("line", "build", *files, "--output", tmp_path / name)
        assert f"{name}: 3 vehicles" in built.stdout
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()


def test_what_is_no_line_is_refused_with_what_to_do(sisters: list[Path], tmp_path: Path) -> None:
    ratio_index = tmp_path / "ratio_index.json"
    ratio_index.write_text(calibration_file().to_json())
    line, broken, newer = (tmp_path / name for name in ("line.json", "broken.json", "newer.json"))
    run("line", "build", *sisters, "--output", line)
    content = json.loads(line.read_text())
    broken.write_text(json.dumps(content | {"software": "another"}))
    content["version"] = 2
    newer.write_text(json.dumps(content | {"id": content_id(content)}))
    for arguments, said in (
        (("line", "build", ratio_index, "--output", line), "calibrate it again without --estimator"),
        (("line", "build", line, "--output", line), "not a springscale calibration file"),
        (("line", "build", tmp_path / "none.json", "--output", line), "no such calibration file"),
        (("line", "build", sisters[0], "--output", tmp_path), "is a folder"),
        (("line", "build", sisters[0], "--output", tmp_path / "no" / "line.json"), "make it first"),
        (("line", "show", sisters[0]), "springscale calibration show"),
        (("calibrate", line, "--like", line, "--estimator", "ratio_index", "--check"), "nothing to inherit"),
        (("line", "show", broken), "does not match its id"),
        (("line", "show", newer), "version 2"),
    ):
        assert said in refused(*arguments)


def test_logs_that_no_calibration_was_made_from_are_refused(sisters: list[Path], tmp_path: Path) -> None:
    other = write_known_loads(tmp_path, loads=((0.0, None),), duration_s=30.0)
    said = refused("line", "build", *sisters, "--logs", other, "--output", tmp_path / "line.json")
    assert "none of the calibrations was made from this campaign" in said


def test_two_line_files_are_refused(drives: Path, sisters: list[Path], tmp_path: Path) -> None:
    lines = [tmp_path / "a.json", tmp_path / "b.json"]
    for path, members in zip(lines, (sisters[:1], sisters[1:]), strict=True):
        run("line", "build", *members, "--output", path)
    likes = [word for path in lines for word in ("--like", str(path))]
    said = refused("calibrate", drives, "--runs", "1", *likes, "--output", tmp_path / "van.json", *FAST)
    assert "two line files" in said


def test_the_report_says_what_was_inherited(drives: Path, sisters: list[Path], tmp_path: Path) -> None:
    run(
        *("calibrate", drives, "--runs", "1", "--like", sisters[0]),
        *("--output", tmp_path / "van.json", "--report", tmp_path / "report", *FAST),
    )
    page = (tmp_path / "report" / "report.html").read_text()
    for said in (
        "Calibrated on 1 run and what 1 vehicle of its line told",
        "the effect of others was inherited from 1 vehicle of its line",
        "These stay at what its line told",
        load_calibration(sisters[0]).id,
    ):
        assert said in page


def test_a_plan_before_any_drive_knows_the_line(drives: Path, sisters: list[Path], tmp_path: Path) -> None:
    empty = tmp_path / "campaign.toml"
    head, _, _ = drives.read_text().partition("[[runs]]")
    empty.write_text(head + "payload_range_kg = [0.0, 450.0]\npayload_length_m = 0.8\n")
    (tmp_path / "signals.toml").write_text((drives.parent / "signals.toml").read_text())
    expected = []
    for like in ((), ("--like", sisters[0])):
        planned = run("calibrate", empty, "--plan", *like, "--json")
        expected.append(json.loads(planned.stdout)["plan"]["advice"][0]["expected"]["payload_std_kg"])
    any_vehicle, of_its_line = expected
    assert of_its_line**2 < 0.65 * any_vehicle**2  # what no known load narrows is in both
