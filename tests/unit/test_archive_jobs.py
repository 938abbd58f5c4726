"""Which logs make which jobs, and that a job's name is the hash of all that its rows follow from."""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from support.archive import MIDNIGHT_NS, S, write_manifest
from support.calibrated import calibration_file

from gateway.archive import place_of
from gateway.archive.jobs import PACKAGE, ArchiveJob, code_id, hash_of, plan, software
from gateway.archive.manifest import Assignment, load_manifest
from gateway.archive.survey import LogFile, SurveyedLog
from gateway.core.batch_settings import BatchSettings

HOUR = 3600 * S
DATASET = place_of("/dataset")


@pytest.fixture
def van(tmp_path: Path) -> Assignment:
    return load_manifest(str(write_manifest(tmp_path, "van"))).assignments[0]


def jobs_of(van: Assignment, starts: Sequence[int | None], settings: BatchSettings | None = None) -> list[ArchiveJob]:
    """The jobs of logs 0.log, 1.log, ... that begin at these times; None: a log without a readable frame."""
    logs = [LogFile(van.logs, f"{n}.log", f"van/{n}.log", 100, "x") for n in range(len(starts))]
    facts = {
        log.key: SurveyedLog(f"sha{n}", f"sha{n}", starts[n], None if starts[n] else "bad")
        for n, log in enumerate(logs)
    }
    return list(plan(DATASET, van, logs, facts, settings or BatchSettings()))


def names(jobs: Sequence[ArchiveJob]) -> list[tuple[str, list[str], list[str]]]:
    return [(job.slot.month, [one.log.path for one in job.lead_in], [one.log.path for one in job.logs]) for job in jobs]


def test_a_job_is_a_month_and_continues_the_state_of_the_day_before(van: Assignment) -> None:
    starts = [MIDNIGHT_NS + hours * HOUR for hours in (-60, -24, -1, 0, 5, 29 * 24)]
    jobs = jobs_of(van, starts)
    assert names(jobs) == [
        ("2026-10", [], ["0.log", "1.log", "2.log"]),
        ("2026-11", ["1.log", "2.log"], ["3.log", "4.log", "5.log"]),
    ]
    assert [job.next_ns for job in jobs] == [MIDNIGHT_NS, None]


def test_logs_are_in_the_order_of_their_frames_whatever_their_names(van: Assignment) -> None:
    assert names(jobs_of(van, [MIDNIGHT_NS + 2 * S, MIDNIGHT_NS + 1 * S])) == [("2026-11", [], ["1.log", "0.log"])]


def test_a_log_without_a_frame_belongs_where_its_name_does(van: Assignment) -> None:
    assert names(jobs_of(van, [MIDNIGHT_NS - S, None, MIDNIGHT_NS])) == [
        ("2026-10", [], ["0.log", "1.log"]),
        ("2026-11", ["0.log", "1.log"], ["2.log"]),
    ]
    assert names(jobs_of(van, [None, MIDNIGHT_NS])) == [("2026-11", [], ["0.log", "1.log"])]
    assert names(jobs_of(van, [None, None])) == [("unknown", [], ["0.log", "1.log"])]


def test_validity_in_time_parts_logs_by_their_first_frame(van: Assignment) -> None:
    old, new = replace(van, span_ns=(0, MIDNIGHT_NS)), replace(van, span_ns=(MIDNIGHT_NS, 2 * MIDNIGHT_NS))
    starts = [MIDNIGHT_NS - S, MIDNIGHT_NS]
    assert names(jobs_of(old, starts)) == [("2026-10", [], ["0.log"])]
    assert names(jobs_of(new, starts)) == [("2026-11", [], ["1.log"])]


def test_the_name_of_a_job_follows_from_its_inputs_alone(van: Assignment, tmp_path: Path) -> None:
    """Written down once: another computer, process or order of keys names it the same."""
    [job], [again] = jobs_of(van, [MIDNIGHT_NS]), jobs_of(van, [MIDNIGHT_NS])
    assert job.slot == again.slot
    assert (
        hash_of({"b": [1, None], "a": "ö"}) == hash_of({"a": "ö", "b": [1, None]}) == "5b45036fb0a18fa979611680b3f65b1a"
    )
    elsewhere = load_manifest(str(write_manifest(tmp_path / "elsewhere", "van"))).assignments[0]
    assert jobs_of(elsewhere, [MIDNIGHT_NS])[0].slot == job.slot


@pytest.mark.parametrize(
    "entry",
    [
        'id = "other"',
        'id = "van"\nvin = "WF0XXXTTGXJK12345"',
        'id = "van"\nsignals = "springscale:canmod_gps"',
        'id = "van"\ncalibration = "other.json"',
        'id = "van"\ngross_limit_kg = 1850.0',
    ],
)
def test_a_changed_input_changes_the_job(van: Assignment, tmp_path: Path, entry: str) -> None:
    path = write_manifest(tmp_path / "changed", entry)
    (path.parent / "other.json").write_text(calibration_file(payload_kg=201.0).to_json())
    other = load_manifest(str(path)).assignments[0]
    assert jobs_of(other, [MIDNIGHT_NS])[0].slot.job != jobs_of(van, [MIDNIGHT_NS])[0].slot.job


def test_changed_settings_content_or_neighbours_change_the_job(van: Assignment) -> None:
    jobs = [
        jobs_of(van, [MIDNIGHT_NS])[0],
        jobs_of(van, [MIDNIGHT_NS], BatchSettings(window_s=60.0))[0],
        jobs_of(van, [MIDNIGHT_NS, MIDNIGHT_NS + S])[0],
        jobs_of(van, [MIDNIGHT_NS - HOUR, MIDNIGHT_NS])[1],
        jobs_of(van, [MIDNIGHT_NS - HOUR, MIDNIGHT_NS])[0],
    ]
    assert len({job.slot.job for job in jobs}) == len(jobs)


@pytest.mark.parametrize("module", ["posterior", "calibration/file"])
def test_a_changed_module_changes_the_software_id(tmp_path: Path, module: str) -> None:
    assert software().endswith(f" code {code_id()}")
    copy = tmp_path / "gateway"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__", "assets"))
    assert code_id(copy) == code_id()
    with (copy / f"{module}.py").open("a") as file:
        file.write("# changed\n")
    assert code_id(copy) != code_id()
