"""kill -9 at any moment: every estimate that was reported as committed is there afterwards."""

import json
import random
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from support.killed import told_before_kill

from gateway.store import Store

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
