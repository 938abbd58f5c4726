"""kill -9 at any moment: every ticket that was answered is there afterwards, and the file is whole."""

import random
from pathlib import Path

import pytest
from support.killed import told_before_kill

from gateway.calibration.ticket_file import FILE_NAME, TicketHistory
from gateway.service.proving.history_file import HistoryFile

HANDER = """
import itertools, json, pathlib, sys
from support.tickets import TicketBench

bench = TicketBench(pathlib.Path(sys.argv[1]), tuple(range(100, 400, 10)))
print("ready", flush=True)
for n in itertools.cycle(range(1, 30)):
    made = bench.add(n)["id"]
    print(made, flush=True)
    if n % 3 == 0:
        bench.desk.withdraw("b", made)
    if n == 29:
        break
"""


@pytest.mark.parametrize("seed", [1, 2])
def test_a_kill_loses_no_ticket_that_was_answered(tmp_path: Path, seed: int) -> None:
    answered = told_before_kill(HANDER, tmp_path, after_s=random.Random(seed).uniform(0.0, 0.3), ready="ready\n")
    file = HistoryFile(tmp_path / FILE_NAME, TicketHistory())
    assert file.fault is None
    assert {line.strip() for line in answered} <= {ticket.id for ticket in file.history.tickets}
