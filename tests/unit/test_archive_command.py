"""springscale reprocess and its processes: what it prints, how it ends, and what a killed one costs."""

import json
import os
import time
from collections.abc import Iterator
from operator import truediv
from pathlib import Path

import pytest
from click.testing import Result
from support.archive import MIDNIGHT_NS, Here, die, write_drive, write_manifest
from support.commands import called

from gateway.archive import PlaceError
from gateway.archive.job_run import JobOutcome, JobStatus
from gateway.archive.receipts import Slot
from gateway.archive.reprocessing import Progress, Summary, done_by
from gateway.archive.workers import Workers, answer_of, local_workers
from gateway.cli import main
from gateway.cli.reprocess import duration, how_far, size, summary_in_words

SLOT = Slot("van-1", "2026-11", "abc")


@pytest.fixture(name="archive")
def _archive(tmp_path: Path) -> Path:
    write_drive(tmp_path / "van-1" / "1.log", MIDNIGHT_NS, 21.0)
    write_manifest(tmp_path, "van-1")
    return tmp_path


def reprocessed(archive: Path, *options: str) -> Result:
    return called("reprocess", archive, "--output", archive / "dataset", "--workers", 1, *options)


def test_the_summary_reports_the_work_and_that_nothing_is_left(archive: Path) -> None:
    first, second = reprocessed(archive), reprocessed(archive, "--json")
    assert first.exit_code == second.exit_code == 0, first.output
    assert "done now: 1, 1 batches, 1 of them weighed; done before: 0" in first.stdout
    assert json.loads(second.stdout)["jobs"] == {"done": 0, "already": 1, "lost": 0}


def test_a_failed_log_gives_exit_code_1_and_its_reason(archive: Path) -> None:
    (archive / "van-1" / "2.log").write_bytes(b"nothing\n")
    result = reprocessed(archive)
    assert result.exit_code == 1
    assert "failed: 1 log:\n  van-1/2.log: holds no CAN frame" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["/nowhere", "--output", "/tmp/x"], "springscale: /nowhere: has no archive.toml, which tells"),
        (["/nowhere/a.toml", "--output", "/tmp/x"], "springscale: /nowhere/a.toml: no such file"),
        (["/nowhere", "--output", "ftp://x"], "ftp:// is not read here; there are file, s3, and paths"),
        (["/nowhere", "--output", "/tmp/x", "--workers", "1", "--scheduler", "tcp://x:1"], "not both"),
        (["/nowhere"], "Missing option '--output'"),
    ],
)
def test_a_usage_error_gives_exit_code_2_and_one_line(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main(["reprocess", *arguments])
    assert left.value.code == 2
    assert told in capsys.readouterr().err


def test_how_far_it_is_with_rate_and_remaining_time() -> None:
    assert how_far(Progress("weighing", 0, 10, 0, 3, 0.0)) == "weighing: 0 of 3 jobs, 0 B of 10 B, 0 B/s"
    told = how_far(Progress("weighing", 1_200_000_000, 34_000_000_000, 12, 340, 23.0))
    assert told == "weighing: 12 of 340 jobs, 1.2 GB of 34.0 GB, 52.2 MB/s, 10 min left"


def test_sizes_and_durations_are_in_units_that_suit() -> None:
    assert [size(n) for n in (999, 1000, 2.5e6, 3e9, 4e15)] == ["999 B", "1.0 kB", "2.5 MB", "3.0 GB", "4000.0 TB"]
    assert [duration(s) for s in (1, 99, 600, 7200, 200_000)] == ["1 s", "99 s", "10 min", "2.0 h", "2.3 days"]


def test_the_summary_names_some_failures_and_the_next_step() -> None:
    summary = Summary(n_vehicles=2, n_logs=30, size=100, n_jobs=3, n_already=0)
    summary.outcomes = [
        JobOutcome(SLOT, JobStatus.DONE, failures=tuple(f"log {n}" for n in range(14)), n_failed_logs=14),
        JobOutcome(SLOT, JobStatus.LOST, failures=("timed out",)),
    ]
    summary.lost = {"vehicle=van-1/month=2026-11/abc": "timed out"}
    told = summary_in_words(summary, "DATASET")
    assert "  log 9\n  and 4 more\n" in told
    assert told.endswith("not done: 1; run again to try them:\n  vehicle=van-1/month=2026-11/abc: timed out")


@pytest.fixture(name="workers", scope="module")
def _workers() -> Iterator[Workers]:
    with local_workers(2) as workers:
        yield workers


def test_tasks_run_in_processes_with_one_numeric_thread(workers: Workers) -> None:
    pids = {workers.submit(os.getpid).result() for _ in range(4)}
    assert os.getpid() not in pids
    assert len(pids) <= workers.n_workers == 2
    assert workers.submit(os.getenv, "OPENBLAS_NUM_THREADS").result() == "1"


def test_a_task_that_kills_every_process_is_given_up_and_the_others_go_on(workers: Workers) -> None:
    killer = workers.submit(die, "")
    with pytest.raises(PlaceError, match="several processes died over it without a word"):
        answer_of(killer)
    assert workers.submit(truediv, 6, 3).result() == 2.0


def stuck(folder: str) -> None:
    """Says which process it is, and does not end."""
    (Path(folder) / "pid").write_text(str(os.getpid()))
    time.sleep(600.0)


def test_they_end_at_once_when_the_run_is_stopped(tmp_path: Path) -> None:
    pid = tmp_path / "pid"

    def stopped() -> None:
        with local_workers(1) as workers:
            workers.submit(stuck, str(tmp_path))
            while not pid.exists() or not pid.read_text():
                time.sleep(0.01)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert not Path(f"/proc/{pid.read_text()}").exists()


def test_only_as_many_tasks_run_as_there_are_workers() -> None:
    taken = 0

    def tasks() -> Iterator[float]:
        nonlocal taken
        while taken < 20:
            taken += 1
            yield float(taken)

    for n, (task, answer) in enumerate(done_by(Here(), float.hex, tasks()), 1):
        assert answer.result() == task.hex()
        assert taken == n
    assert taken == 20
