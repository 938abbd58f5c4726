"""The processes of one computer: a killed one costs what it was doing, a fault is whose it is, they end when told."""

import os
import time
from collections.abc import Iterator
from operator import truediv
from pathlib import Path

import pytest
from support.archive import die

from gateway.archive.reprocess import Progress, done_by
from gateway.archive.workers import Processes, WorkerKilledError


@pytest.fixture(name="workers", scope="module")
def _workers() -> Iterator[Processes]:
    with Processes(2) as workers:
        yield workers


def test_answers_come_from_other_processes_with_one_thread_of_numerics(workers: Processes) -> None:
    pids = {workers.submit(os.getpid).result() for _ in range(4)}
    assert os.getpid() not in pids
    assert len(pids) <= workers.n_workers == 2
    assert workers.submit(os.getenv, "OPENBLAS_NUM_THREADS").result() == "1"


def test_a_fault_comes_back_and_the_process_goes_on(workers: Processes) -> None:
    with pytest.raises(ZeroDivisionError):
        workers.submit(truediv, 1, 0).result()
    assert workers.submit(truediv, 6, 3).result() == 2.0


def test_what_cannot_be_sent_back_is_told(workers: Processes) -> None:
    with pytest.raises(RuntimeError, match="cannot be sent back"):
        workers.submit(open, os.devnull).result()


def test_a_killed_process_costs_its_task_one_more_try(workers: Processes, tmp_path: Path) -> None:
    others = [workers.submit(truediv, n, 1) for n in range(8)]
    assert workers.submit(die, str(tmp_path / "once")).result() is None
    assert [one.result() for one in others] == list(range(8))


def test_a_task_that_kills_every_process_is_given_up_and_the_others_go_on(workers: Processes) -> None:
    killer = workers.submit(die, "")
    with pytest.raises(WorkerKilledError, match="3 processes died over it without a word"):
        killer.result()
    assert workers.submit(truediv, 6, 3).result() == 2.0


def test_they_end_at_once_when_they_are_stopped() -> None:
    workers = Processes(1)
    slow = workers.submit(time.sleep, 600.0)
    while not slow.running():
        time.sleep(0.01)
    workers.shutdown(cancel_futures=True)
    assert slow.done()


def test_a_bounded_number_of_tasks_is_under_way(workers: Processes) -> None:
    taken = 0

    def tasks() -> Iterator[float]:
        nonlocal taken
        while taken < 20:
            taken += 1
            yield float(taken)

    for n, (task, answer) in enumerate(done_by(workers, float.hex, tasks()), 1):
        assert answer.result() == task.hex()
        assert taken <= n + 2 * workers.n_workers
    assert taken == 20


def test_progress_tells_rate_and_what_is_left() -> None:
    assert Progress("weighing", 0, 100, 0, 4, 0.0).remaining_s is None
    half = Progress("weighing", 50, 100, 2, 4, 10.0)
    assert (half.rate, half.remaining_s) == (5.0, 10.0)
