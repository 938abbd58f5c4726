"""kill -9 at any moment: what was answered or told is there afterwards, none of it twice, and every file is whole."""

import json
import random
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest
from support.alarms import AlarmBench
from support.learner import LearnerBench
from support.patience import PATIENCE_S

from gateway.bus.logs.open import open_log
from gateway.bus.signals import load_signal_map
from gateway.store import Store


def told_before_kill(program: str, *arguments: object, after_s: float, ready: str | None = None) -> list[str]:
    """Every whole line that a Python program printed, killed so long after its first; a line ``ready`` comes before."""
    process = subprocess.Popen(
        [sys.executable, "-c", program, *map(str, arguments)],
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[1],
    )
    if ready is not None:
        assert process.stdout.readline() == ready
    told = [process.stdout.readline()]
    time.sleep(after_s)
    process.send_signal(signal.SIGKILL)
    rest, _ = process.communicate(timeout=PATIENCE_S)
    return told + [line for line in rest.splitlines(keepends=True) if line.endswith("\n")]


WRITER = """
import itertools, pathlib, sys
from gateway.store import Store
from support.estimates import make_record
from support.patience import PATIENCE_S

store = Store.open(pathlib.Path(sys.argv[1]))
first = int(sys.argv[2])
for n in itertools.count(first):
    record = make_record(n, with_spectra=True)
    store.write_estimate(record)
    if n % 3 == 0 and store.flush(PATIENCE_S):  # groups of three: a kill also falls between accept and commit
        print(n, flush=True)
"""


def write_until_killed(directory: Path, first: int, after_s: float) -> list[int]:
    """Numbers known to be committed when the writer was killed ``after_s`` after its first commit."""
    return [int(line) for line in told_before_kill(WRITER, directory, first, after_s=after_s)]


@pytest.mark.parametrize("seed", [1, 2])
def test_a_kill_loses_no_committed_estimate(tmp_path: Path, seed: int) -> None:
    moments = random.Random(seed)
    first, known = 0, set[int]()
    for _ in range(3):
        committed = write_until_killed(tmp_path, first, moments.uniform(0.0, 0.08))
        known |= set(range(first, committed[-1] + 1))
        first = committed[-1] + 1
    with closing(sqlite3.connect(tmp_path / "springscale.db")) as database:
        assert database.execute("PRAGMA integrity_check").fetchone()[0] == "ok"
    store = Store.open(tmp_path)
    assert store.health().set_aside is None
    stored = [round(json.loads(text)["payload_kg"]) - 100 for text in store.reader().estimates(limit=100_000).items]
    store.close()
    assert stored == sorted(set(stored))
    assert known <= set(stored)


RECORDER = """
import itertools, pathlib, sys
from gateway.bus.ring_log import RingLog
from support.bus_drive import white_noise

log = RingLog(pathlib.Path(sys.argv[1]), "can0", 10**9, 0, write_s=0.001)
log.start()
drive = white_noise(20.0, 1_790_000_000_000_000_000, seed=1)
for n in itertools.count(1):
    log.put(drive)
    while log.status().n_frames_written < n * len(drive):
        pass
    print(n * len(drive), flush=True)
"""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_kill_loses_no_acknowledged_frame(tmp_path: Path, seed: int) -> None:
    told = told_before_kill(RECORDER, tmp_path, after_s=random.Random(seed).uniform(0.0, 0.2))

    n_read = 0
    for path in tmp_path.glob("*.log"):
        chunks, report = open_log(path, load_signal_map("springscale:reference"))
        n_read += sum(map(len, chunks))
        assert report.n_rejected <= 1  # the line that was being written
    assert n_read >= int(told[-1])


WATCHER = """
import pathlib, sys
from support.alarms import LIMIT_KG, AlarmBench, of_load

bench = AlarmBench(pathlib.Path(sys.argv[1]))
print("ready", flush=True)
for n in range(2000):
    bench.weigh(of_load(3 * n, LIMIT_KG + 60.0, n_batches=2))
    alarm = bench.standing()[0]["id"]
    assert bench.store.flush(60.0)
    print(alarm, flush=True)
    bench.weigh(of_load(3 * n + 2, 100.0))
"""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_kill_loses_no_alarm_that_was_stored_and_doubles_none(tmp_path: Path, seed: int) -> None:
    stored = told_before_kill(WATCHER, tmp_path, after_s=random.Random(seed).uniform(0.0, 0.3), ready="ready\n")
    bench = AlarmBench(tmp_path)
    found = [alarm["id"] for alarm in bench.history()]
    assert {line.strip() for line in stored} <= set(found)
    assert len(set(found)) == len(found)
    assert len(bench.standing()) <= 1
    bench.store.close()


STATER = """
import itertools, json, pathlib, sys
from gateway.stated.statement import StatementRecord
from support.learner import LearnerBench, at

bench = LearnerBench(pathlib.Path(sys.argv[1]))
print("ready", flush=True)
for n in itertools.count():
    record = StatementRecord.model_validate(
        {"source": "empty", "from": at(1000 * n), "ref": f"{n}", "load": {"payload_kg": 0.0}}
    )
    print(json.loads(bench.learner.loads.state(record, "b"))["id"], flush=True)
"""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_kill_loses_no_statement_that_was_answered(tmp_path: Path, seed: int) -> None:
    answered = told_before_kill(STATER, tmp_path, after_s=random.Random(seed).uniform(0.0, 0.3), ready="ready\n")
    kept = json.loads(LearnerBench(tmp_path).learner.loads.page(limit=1000))["items"]
    assert {line.strip() for line in answered[-900:]} <= {one["id"] for one in kept}
