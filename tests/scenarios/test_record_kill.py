"""kill -9 at any moment: every block that was on disk is there afterwards, and the log can be read and gone on with."""

import random
from pathlib import Path

import pytest
from support.killed import told_before_kill
from support.patience import PATIENCE_S

from gateway.bus.logs.open import open_log
from gateway.bus.ring import RingLimits, RingLog
from gateway.bus.signals import load_signal_map

RECORDER = """
import itertools, pathlib, sys
from gateway.bus.ring import RingLimits, RingLog
from support.bus_drive import white_noise

log = RingLog(pathlib.Path(sys.argv[1]), "can0", RingLimits(10**9, 10**9, 0, block_s=0.0))
log.start()
drive = white_noise(20.0, 1_790_000_000_000_000_000, seed=1)
for n in itertools.count(1):
    log.put(drive)
    while log.status().n_frames_written < n * len(drive):
        pass
    print(n * len(drive), flush=True)
"""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_kill_loses_no_block_that_was_told_of(tmp_path: Path, seed: int) -> None:
    told = told_before_kill(RECORDER, tmp_path, after_s=random.Random(seed).uniform(0.0, 0.2))

    log = RingLog(tmp_path, "can0", RingLimits(10**9, 10**9, 0, block_s=3600.0))
    log.start()
    log.stop(PATIENCE_S)
    n_kept = sum(segment.n_frames for segment in log.segments())
    assert n_kept >= int(told[-1])
    n_read = 0
    for path in sorted(tmp_path.glob("*.log.gz")):
        chunks, report = open_log(path, load_signal_map("springscale:reference"))
        n_read += sum(map(len, chunks))
        assert report.ended_early is None
    assert n_read == n_kept
