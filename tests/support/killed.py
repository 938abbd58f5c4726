"""A process killed at some moment, and what it had told by then."""

import signal
import subprocess
import sys
import time
from pathlib import Path

from support.patience import PATIENCE_S


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
