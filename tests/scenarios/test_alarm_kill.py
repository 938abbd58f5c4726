"""kill -9 at any moment: who was answered that an alarm is acknowledged finds it so afterwards, and none is doubled."""

import random
from pathlib import Path

import pytest
from support.alarms import AlarmBench
from support.killed import told_before_kill

WATCHER = """
import pathlib, sys
from support.alarms import LIMIT_KG, AlarmBench, of_load

bench = AlarmBench(pathlib.Path(sys.argv[1]))
print("ready", flush=True)
for n in range(2000):
    bench.weigh(of_load(3 * n, LIMIT_KG + 60.0))
    alarm = bench.standing()[0]["id"]
    bench.desk.acknowledge(alarm, "yard", str(n))
    print(alarm, flush=True)
    bench.weigh(of_load(3 * n + 1, LIMIT_KG + 60.0, n_batches=2))
    bench.weigh(of_load(3 * n + 2, 100.0))
"""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_kill_loses_no_acknowledgement_that_was_answered(tmp_path: Path, seed: int) -> None:
    answered = told_before_kill(WATCHER, tmp_path, after_s=random.Random(seed).uniform(0.0, 0.3), ready="ready\n")
    bench = AlarmBench(tmp_path)
    history = bench.history()
    seen = {alarm["id"]: alarm["acknowledged"]["by"] for alarm in history if alarm["acknowledged"]}
    assert {line.strip(): "yard" for line in answered}.items() <= seen.items()
    assert len({alarm["id"] for alarm in history}) == len(history)
    assert len(bench.standing()) <= 1
    bench.store.close()
