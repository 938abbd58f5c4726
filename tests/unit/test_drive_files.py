"""The drives that a service keeps: bounded in size, forgotten by what they teach, and there again after a start."""

import json
from pathlib import Path

import pytest
from support.drives import drive
from support.learner import ANSWERS, NOW_NS, WINDOW_S, LearnerBench, kept_window, window

from gateway.calibration.kept import packed, unpacked
from gateway.calibration.learning.job import LearnJob
from gateway.service.learner.kept_drives import DriveFiles
from gateway.service.learner.learner import MOST_WAITING
from gateway.stated.facts import VehicleAnswers
from gateway.units import NS_PER_S

BYTES = len(packed(kept_window(0, 0)))


def nothing(begin_ns: int, end_ns: int) -> bool:
    """No statement is about any time."""
    return False


def begun(files: DriveFiles) -> list[int]:
    """When the windows begin, in seconds after the bench's first drive."""
    return [(one.t_start_ns - NOW_NS) // NS_PER_S for one in files.windows()]


def test_windows_survive_a_restart(tmp_path: Path) -> None:
    files = DriveFiles(tmp_path, 10 * BYTES)
    assert files.add(kept_window(0, 0), nothing)
    assert not files.add(kept_window(0, 0), nothing)
    assert files.add(kept_window(0, 300), nothing)
    again = DriveFiles(tmp_path, 10 * BYTES)
    assert again.windows() == files.windows()
    assert again.n_bytes == sum(path.stat().st_size for path in tmp_path.iterdir())
    assert unpacked(again.path(again.windows()[0]).read_bytes()).batch.usable_s == 300.0


def test_the_drive_that_teaches_least_is_forgotten_first(tmp_path: Path) -> None:
    files = DriveFiles(tmp_path, round(3.2 * BYTES))
    files.add(kept_window(0, 0), nothing)
    files.add(kept_window(0, 300), nothing)
    files.add(kept_window(3600, 3600), nothing)  # half as long a drive
    files.add(kept_window(7200, 7200), nothing)
    assert begun(files) == [0, 300, 7200]
    files.add(kept_window(7200, 7500), nothing)
    assert begun(files) == [7200, 7500]  # of two that are as long, the newer one


def test_a_drive_with_a_statement_outlives_all_others(tmp_path: Path) -> None:
    files = DriveFiles(tmp_path, round(2.2 * BYTES))

    def is_stated(begin_ns: int, end_ns: int) -> bool:
        return begin_ns == NOW_NS

    for n in range(5):
        files.add(kept_window(n * 3600, n * 3600), is_stated)
    assert begun(files) == [0, 4 * 3600]


def test_of_a_long_drive_the_first_half_hour_is_kept(tmp_path: Path) -> None:
    files = DriveFiles(tmp_path, 100 * BYTES)
    for n in range(20):
        files.add(kept_window(0, n * 300), nothing)
    assert begun(files) == [n * 300 for n in range(6)]


def test_a_failing_disk_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "drives").write_text("in the way")
    with pytest.raises(OSError, match="drives"):
        DriveFiles(tmp_path / "drives", 10 * BYTES).add(kept_window(0, 0), nothing)


def test_windows_that_nobody_can_keep_are_counted_and_told(tmp_path: Path) -> None:
    """The disk is slower than the bus: the queue takes a few windows, and what follows is lost."""
    learner = LearnerBench(tmp_path).learner
    n_handed = MOST_WAITING + 3
    for i in range(n_handed):
        learner.take(window(0.0, i * WINDOW_S), drive(1.0))
    told = json.loads(learner.learnt.state())
    assert told["n_windows_lost"] == n_handed - MOST_WAITING
    assert "wait for the disk" in told["fault"]


def test_a_fit_that_cannot_begin_loses_no_window(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(job: LearnJob) -> None:
        raise OSError("no space left")

    bench = LearnerBench(tmp_path)
    bench.learner.van.state(VehicleAnswers(**ANSWERS), "workshop", is_confirmed=True)
    bench.drive(0)
    monkeypatch.setattr(bench.worker, "start", refuse)
    bench.turn()
    told = json.loads(bench.learner.learnt.state())
    assert "; nothing can be learnt: no space left; weighing goes on" in f"; {told['fault']}"
    assert told["n_windows_lost"] == 0
