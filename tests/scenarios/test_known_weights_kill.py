"""kill -9 at any moment: every tare that was answered is there afterwards, and the file is whole."""

import random
from pathlib import Path

import pytest
from support.killed import told_before_kill

from gateway.calibration.tare_file import FILE_NAME, MOST_ENTRIES, load_tares

TARER = """
import itertools, json, pathlib, sys
from gateway.service.tare_desk import Subject, TareDesk
from support.calibrated import calibration_file
from support.tare import FakePipeline

pipeline = FakePipeline()
subject = Subject(calibration_file().for_core(), "ratio_index", "van-17")
desk = TareDesk(pathlib.Path(sys.argv[1]), subject, pipeline, stale_after_s=900.0, on_event=lambda kind, detail: None)
for n in itertools.count():
    pipeline.weigh(n % 60)
    print(json.loads(desk.tare("a", None))["id"], flush=True)
    if n % 3 == 2:
        desk.undo("b", to_factory=False)
"""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_kill_loses_no_tare_that_was_answered(tmp_path: Path, seed: int) -> None:
    answered = told_before_kill(TARER, tmp_path, after_s=random.Random(seed).uniform(0.0, 0.15))
    kept = [entry.id for entry in load_tares(tmp_path / FILE_NAME).entries]
    known = [line.strip() for line in answered][1 - MOST_ENTRIES :]  # one more may have been kept, unanswered
    assert set(known) <= set(kept)
