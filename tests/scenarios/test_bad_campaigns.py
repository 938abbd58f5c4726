"""Campaigns gone wrong, from log files through the command line: each is told what is wrong and how to mend it."""

import gzip
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import can
import pytest
from click.testing import Result
from support.calibrated import calibration_file
from support.commands import called

from gateway.calibration.campaign_file import load_campaign
from gateway.calibration.file import load_calibration
from gateway.errors import CalibrationImpossibleError
from gateway.workbench.simulated_drives import bench_of, write_campaign

DRIVE_S = 165.0
WINDOW = ("--window-s", "50")
CHOSEN = (1, 4, 8, 10)  # of the paper's experiment: empty; 120 kg far back; 420 kg far forward and far back


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sound campaign of ten short drives: campaign.toml, signals.toml with its DBC, a log each."""
    directory = tmp_path_factory.mktemp("campaign")
    write_campaign(bench_of("experiment", longest_s=DRIVE_S), directory)
    return directory


UNTOLD = "note:roll_rate_sign_untold"  # one run with a sensor 0.15 m off the centre line is not enough for that


def calibrate(campaign: Path, *options: str | Path) -> Result:
    """The command's result; the message of a refusal is in ``exception``."""
    done = called("calibrate", campaign, *WINDOW, *options)
    if done.exception is not None and not isinstance(done.exception, CalibrationImpossibleError):
        raise done.exception
    return done


def check(campaign: Path, *options: str) -> tuple[int, dict[str, Any]]:
    """The exit code of --check and what it found."""
    done = calibrate(campaign, "--check", "--json", *options)
    return done.exit_code, json.loads(done.stdout)


def kinds(found: dict[str, Any]) -> dict[int, list[str]]:
    """The severities and kinds of the findings by run number; 0 is of all runs together."""
    runs = {run["number"]: run["findings"] for run in found["runs"]} | {0: found["campaign_findings"]}
    return {number: [f"{one['severity']}:{one['kind']}" for one in findings] for number, findings in runs.items()}


def altered(folder: Path, name: str, runs: Sequence[int] = CHOSEN, **replaced: str) -> Path:
    """A campaign file beside the sound one: these of its runs, and texts replaced (run3="..." within one run)."""
    head, *tables = (folder / "campaign.toml").read_text(encoding="utf-8").split("[[runs]]")
    head = replaced.pop("head", head)
    chosen = [replaced.get(f"run{number}", tables[number - 1]) for number in runs]
    path = folder / f"{name}.toml"
    path.write_text("[[runs]]".join([head, *chosen]), encoding="utf-8")
    return path


def table_of(folder: Path, number: int) -> str:
    return (folder / "campaign.toml").read_text(encoding="utf-8").split("[[runs]]")[number]


def head_with(folder: Path, old: str, new: str) -> str:
    head = (folder / "campaign.toml").read_text(encoding="utf-8").split("[[runs]]")[0]
    assert old in head
    return head.replace(old, new)


def map_with(folder: Path, name: str, old: str, new: str) -> str:
    """The head of a campaign that reads its logs by a wrong signal map."""
    text = (folder / "signals.toml").read_text(encoding="utf-8")
    assert old in text
    (folder / f"{name}-signals.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    return head_with(folder, '"signals.toml"', f'"{name}-signals.toml"')


def test_a_sound_campaign_passes_without_a_word(folder: Path) -> None:
    exit_code, found = check(altered(folder, "sound"))
    assert (exit_code, kinds(found)) == (0, {0: [], 1: [], 2: [], 3: [], 4: []})
    lines = calibrate(altered(folder, "one", [1, 10]), "--check").stdout.splitlines()
    assert [line.split("; ")[0].split(": ")[1] for line in lines[:2]] == ["sound"] * 2
    assert lines[2].startswith("2 of 2 runs can be used: 0 to 420 kg")
    alone = calibrate(altered(folder, "alone", [1]), "--check").stdout.splitlines()
    assert alone[-1].endswith(": 0 kg, 50.0 % in front")


def test_a_missing_lateral_position_is_noted(folder: Path) -> None:
    text = (folder / "signals.toml").read_text(encoding="utf-8")
    (folder / "no-roll-signals.toml").write_text(re.sub(r"\[signals\.roll_rate\][^[]*", "", text), encoding="utf-8")
    head = head_with(folder, '"signals.toml"', '"no-roll-signals.toml"')
    head = re.sub(r"sensor_offset_left_m = .*\n", "", head)
    exit_code, found = check(altered(folder, "no-roll", head=head))
    notes = ["note:roll_rate_unmapped", "note:sensor_offset_unknown"]
    assert (exit_code, kinds(found)) == (0, {0: notes, 1: [], 2: [], 3: [], 4: []})
    unmapped, unknown = found["campaign_findings"]
    assert "springscale look" in unmapped["text"]
    assert unknown["text"] == "sensor_offset_left_m is 0 ± 0.59 m (95 %)"


def test_one_load_alone_calibrates_the_cross_spectrum_only(folder: Path, tmp_path: Path) -> None:
    campaign = altered(folder, "one-load", [1])
    exit_code, found = check(campaign)
    assert (exit_code, kinds(found)) == (0, {0: ["warning:one_load_only", UNTOLD], 1: []})
    done = calibrate(campaign, "--output", tmp_path / "zero.json")
    assert done.exit_code == 0, done.output
    held = load_calibration(tmp_path / "zero.json")
    assert held.estimators == ("cross_spectrum",)
    assert "one_load_only: 0 kg in every run that can be used" in held.warnings
    assert "springs_from_priors" in held.warnings
    options = ("--estimator", "ratio_index", "--window-s", "100")
    refused = calibrate(campaign, "--output", tmp_path / "none.json", *options)
    assert refused.exit_code == 1
    assert "at least two different payloads" in str(refused.exception)
    assert not (tmp_path / "none.json").exists()


WRONG_MAPS = {
    "turned": ('signal = "PitchRate"\nsign = 1', 'signal = "PitchRate"\nsign = -1', "fault:pitch_rate_sign"),
    "in-g": ('signal = "AccelZ"', 'signal = "AccelZ"\nunit = "g"', "fault:acceleration_unit"),
    "no-fix": ("valid_when = { Fix = 3 }", "valid_when = { Fix = 2 }", "fault:speed_missing"),
}


@pytest.mark.parametrize("mistake", WRONG_MAPS)
def test_a_wrong_signal_map_is_named_and_nothing_is_written(mistake: str, folder: Path, tmp_path: Path) -> None:
    old, new, expected = WRONG_MAPS[mistake]
    campaign = altered(folder, mistake, [1, 8], head=map_with(folder, mistake, old, new))
    exit_code, found = check(campaign)
    assert (exit_code, kinds(found)) == (1, {0: [], 1: [expected], 2: [expected]})
    assert found["refusal"] == "no run can be used"
    refused = calibrate(campaign, "--output", tmp_path / "none.json")
    assert refused.exit_code == 1
    assert "no run can be used" in str(refused.exception)
    assert expected.removeprefix("fault:") in refused.stdout
    assert not (tmp_path / "none.json").exists()


def test_twenty_seconds_are_too_short_and_the_rest_goes_on(folder: Path, tmp_path: Path) -> None:
    short = table_of(folder, 4).rstrip() + "\nstart_s = 40.0\nend_s = 60.0\n\n"
    campaign = altered(folder, "short", run4=short)
    done = calibrate(campaign, "--output", tmp_path / "v.json", "--estimator", "cross_spectrum")
    assert done.exit_code == 0, done.output
    assert "run 2 04_" in done.stdout
    assert "left out" in done.stdout
    held = load_calibration(tmp_path / "v.json")
    assert [run.number for run in held.provenance.drives] == [1, 3, 4]
    assert [one for one in held.warnings if one.startswith("run 2 left out: too_short: ")]


def test_every_log_at_fault_is_named_and_the_rest_goes_on(folder: Path) -> None:
    (folder / "empty.log").touch()
    whole = next(folder.glob("10_*/can.log.gz")).read_bytes()
    (folder / "cut.log.gz").write_bytes(whole[: 9 * len(whole) // 10])
    log = next(line for line in table_of(folder, 1).splitlines() if line.startswith("log"))
    runs = {
        "run4": '\nlog = "empty.log"\npayload_kg = 0.0\n\n',
        "run8": table_of(folder, 8).rstrip() + "\nstart_s = 900.0\n\n",
        "run10": '\nlog = "cut.log.gz"\npayload_kg = 420.0\npayload_position_m = 2.8\n\n',
        "run9": f"\n{log}\npayload_kg = 420.0\npayload_position_m = 1.3\n\n",
    }
    exit_code, found = check(altered(folder, "logs", (1, 4, 8, 10), **runs))
    told = kinds(found)
    assert (exit_code, told[2], told[3]) == (0, ["fault:log_unreadable"], ["fault:cut_away"])
    assert told[4] == ["warning:log_damaged"]
    exit_code, found = check(altered(folder, "twice", (1, 9, 10), run9=runs["run9"]))
    assert (kinds(found)[1], kinds(found)[2]) == (["fault:same_drive"], ["fault:same_drive"])


def test_a_log_whose_clock_was_set_is_named(folder: Path, tmp_path: Path) -> None:
    lines = gzip.decompress(next(folder.glob("04_*/can.log.gz")).read_bytes()).splitlines(keepends=True)
    half = len(lines) // 2
    later = [re.sub(rb"\((\d+)", lambda stamp: b"(%d" % (int(stamp[1]) - 40), line) for line in lines[half:]]
    (folder / "set.log").write_bytes(b"".join([*lines[:half], *later]))
    run4 = re.sub(r'log = ".*"', 'log = "set.log"', table_of(folder, 4))
    campaign, told = altered(folder, "set", run4=run4), "its stamps step back 1 time, by up to 0:00:39."
    _, found = check(campaign)
    assert kinds(found)[2][0] == "warning:log_clock"  # before what follows from it
    assert told in json.dumps(found)
    assert all("log_clock" not in one for number, findings in kinds(found).items() if number != 2 for one in findings)
    (tmp_path / "van.json").write_text(calibration_file().to_json(), encoding="utf-8")
    judged = called("evaluate", campaign, "--calibration", tmp_path / "van.json", *WINDOW)
    assert f"set.log: {told}" in judged.stderr


@pytest.mark.parametrize("copied", ["unpacked.log", "exported.asc"])
def test_a_copy_of_a_log_in_another_form_counts_once(copied: str, folder: Path) -> None:
    packed, copy = next(folder.glob("10_*/can.log.gz")), folder / copied
    if copied.endswith(".log"):
        copy.write_bytes(gzip.decompress(packed.read_bytes()))
    else:
        with can.LogReader(packed) as frames, can.ASCWriter(copy) as writer:
            for frame in frames:
                writer.on_message_received(frame)
    again = re.sub('log = ".*"', f'log = "{copied}"', table_of(folder, 10))
    exit_code, found = check(altered(folder, "copied", (1, 10, 9), run9=again))
    assert (exit_code, kinds(found)[2], kinds(found)[3]) == (0, [], ["fault:same_drive"])


def test_faults_that_leave_one_load_of_several_are_refused(folder: Path) -> None:
    short = table_of(folder, 10).rstrip() + "\nend_s = 20.0\n\n"
    exit_code, found = check(altered(folder, "one-left", [1, 10], run10=short))
    assert (exit_code, kinds(found)) == (1, {0: ["warning:one_load_only", UNTOLD], 1: [], 2: ["fault:too_short"]})
    assert found["refusal"] == "faults leave only runs with 0 kg, which is no scale"


def test_two_loads_swapped_in_the_file_are_found(folder: Path) -> None:
    one, other = 1, 10
    loads = {number: table_of(folder, number).split("\n", 2)[2] for number in (one, other)}
    logs = {number: "\n".join(table_of(folder, number).split("\n", 2)[:2]) for number in (one, other)}
    runs = {f"run{one}": f"{logs[one]}\n{loads[other]}", f"run{other}": f"{logs[other]}\n{loads[one]}"}
    _, found = check(altered(folder, f"swap-{one}-{other}", **runs))
    places = [CHOSEN.index(number) + 1 for number in (one, other)]
    faulty = {number: findings for number, findings in kinds(found).items() if number and findings}
    assert faulty == {place: ["warning:loads_swapped"] for place in places}
    assert f"exchanged with drive {places[1]}, both fit far better" in json.dumps(found)


def test_the_share_may_be_stated_instead_of_the_position(folder: Path) -> None:
    by_position = load_campaign(altered(folder, "by-position"))
    share_pct = by_position.front_share_pct(by_position.runs[1])
    lines = [line for line in table_of(folder, 4).splitlines() if not line.startswith("payload_position_m")]
    by_share = load_campaign(
        altered(folder, "by-share", run4="\n".join([*lines, f"front_share_pct = {share_pct!r}", ""]))
    )
    assert by_share.front_share_pct(by_share.runs[1]) == share_pct
    assert check(by_share.path, "--runs", "1,2") == check(by_position.path, "--runs", "1,2")
