"""kill -9 at any moment: every known weight that was answered is there afterwards, and the file is whole."""

import random
from pathlib import Path

import pytest
from support.killed import told_before_kill

from gateway.calibration.known_weights_file import FILE_NAME, MOST_KNOWN_WEIGHTS, load_known_weights

STATER = """
import itertools, pathlib, sys
from support.known_weights import KnownWeightBench

bench = KnownWeightBench(pathlib.Path(sys.argv[1]))
print("ready", flush=True)
for n in itertools.count():
    bench.pipeline.weigh(n % 60)
    made = bench.empty()["id"]
    print(made, flush=True)
    if n % 3 == 2:
        bench.service.take_back("b", made)
"""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_kill_loses_no_known_weight_that_was_answered(tmp_path: Path, seed: int) -> None:
    answered = told_before_kill(STATER, tmp_path, after_s=random.Random(seed).uniform(0.0, 0.3), ready="ready\n")
    kept = [entry.id for entry in load_known_weights(tmp_path / FILE_NAME).entries]
    known = [line.strip() for line in answered][1 - MOST_KNOWN_WEIGHTS :]  # one more may have been kept, unanswered
    assert set(known) <= set(kept)
