"""The example runs as it stands, and its table holds the load that was on board."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.patience import PATIENCE_S

EXAMPLE = Path(__file__).parents[2] / "examples/weigh_in_a_notebook.py"


def test_the_notebook_ends_in_a_table_of_weights() -> None:
    pytest.importorskip("pandas")
    ran = subprocess.run(
        [sys.executable, EXAMPLE], capture_output=True, text=True, timeout=PATIENCE_S, check=False, env={**os.environ}
    )
    assert ran.returncode == 0, ran.stderr
    header, *rows = ran.stdout.splitlines()
    assert header.split() == ["t_end", "payload_kg", "payload_std_kg", "front_share_pct", "rejected"]
    weighed = [row.split() for row in rows if not re.search(r"\bNaN\b", row)]
    truths_kg = [0.0, 0.0, 0.0, 270.0, 270.0]
    off = [abs(float(row[2]) - truth) / float(row[3]) for row, truth in zip(weighed, truths_kg, strict=True)]
    assert max(off) < 2.0
