"""How the benchmarks measure: CPU time of one core, the best of some runs, each path in a process of its own.

CPU time, not the clock: what else the machine does then disturbs a ratio least. Logs lie in the page cache.
"""

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "POLARS_MAX_THREADS": "1", "OMP_NUM_THREADS": "1"}


def cpu_s() -> float:
    """CPU time of this process and of its finished children."""
    return time.process_time() + _children_s()


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def best_of(n_times: int, work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """The result of the work, with ``seconds``, the CPU time of the fastest run."""
    quickest: dict[str, Any] = {}
    for _ in range(n_times):
        begun_s = cpu_s()
        found = work()
        found["seconds"] = cpu_s() - begun_s
        if not quickest or found["seconds"] < quickest["seconds"]:
            quickest = found
    return quickest


def peak_mb(pid: int | str = "self") -> float:
    """Peak memory of a process so far; unlike rusage's it excludes its parent's."""
    status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    return int(status["VmHWM"].split()[0]) / 1024


def cpu_of_s(pid: int) -> float:
    """CPU time that another process has taken so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def in_own_process(module: str, *arguments: object) -> dict[str, Any]:
    """The output of ``python -m benchmarks.speed.MODULE``, with one thread each."""
    command = [sys.executable, "-m", f"benchmarks.speed.{module}", *map(str, arguments)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, env=os.environ | ONE_THREAD)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def print_run(run: Callable[[], dict[str, Any]]) -> None:
    """In the child process: one run with its peak memory as JSON, or the reason why there is none."""
    try:
        row = run()
    except ModuleNotFoundError as fault:
        print(json.dumps({"skipped": f"{fault.name} is not installed"}))
        return
    row["peak_mb"] = peak_mb()
    if "seconds" in row:
        row["ns_per_frame"] = 1e9 * row["seconds"] / row["frames"]
    print(json.dumps(row))
