"""The service as a process of its own, which ends with its test whatever happens."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

TESTS = Path(__file__).parents[1]


@contextmanager
def running_service(config: Path, *options: str, **environment: str) -> Iterator["subprocess.Popen[str]"]:
    """springscale run, unhurried (see support.unhurried); its output is to be read with ``communicate``."""
    process = subprocess.Popen(
        [sys.executable, "-m", "support.unhurried", "run", "--config", str(config), *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=TESTS,
        env={**os.environ, **environment},
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()
