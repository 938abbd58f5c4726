"""A working day of the bus through `springscale estimate`: its duration, and whether memory grows with the log.

The drive of the demo (25 minutes) repeats until the hours are full, on a bus of about 2500 frames/s; the log is plain
candump text of roughly 400 MB an hour, in a temporary folder. Each estimator reads the whole log in a process of its
own, start of Python included; memory is compared with a log of one hour, time with that of `wc -l`.
"""

import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speed.meter import CALIBRATION, best_of, springscale
from gateway.bus.frames import merge_frames
from gateway.bus.logs.candump_write import append_candump
from gateway.config import ESTIMATOR_NAMES
from gateway.records import Frames
from gateway.units import NS_PER_S
from gateway.workbench.simulated_drives import demo_drive, frames_of
from gateway.workbench.wiring import unrelated_traffic

FRAMES_PER_S = 2500  # as in bus_log


def busy_drive() -> Frames:
    """One drive of the demo among other traffic."""
    drive = frames_of(demo_drive())
    duration_s = (int(drive.t_ns[-1]) - int(drive.t_ns[0])) / NS_PER_S
    rng = np.random.default_rng(7)
    n_ids = 57
    sample = unrelated_traffic(int(drive.t_ns[0]), 10.0, n_ids, rng)
    n_times = max(1, round((FRAMES_PER_S - len(drive) / duration_s) / (len(sample) / 10.0)))
    others = [unrelated_traffic(int(drive.t_ns[0]), duration_s, n_ids, rng) for _ in range(n_times)]
    return merge_frames([drive, *others])


def write_log(path: Path, hours: float) -> int:
    """The drive again and again, ten seconds of silence between -> frames written."""
    drive = busy_drive()
    span_ns = int(drive.t_ns[-1] - drive.t_ns[0]) + 10 * NS_PER_S
    n_total = 0
    with path.open("wb") as file:
        for n in range(max(1, round(hours * 3600 * NS_PER_S / span_ns))):
            append_candump(replace(drive, t_ns=drive.t_ns + n * span_ns), "can0", file)
            n_total += len(drive)
    return n_total


def estimate(log: Path, estimator: str) -> dict[str, float]:
    """Wall time, CPU time, peak memory and batches of one run of the command."""
    known = ("--signals", "springscale:reference", "--calibration", CALIBRATION)
    ran = springscale("estimate", log, *known, "--estimator", estimator, "--json")
    return ran | {"batches": len(ran.pop("output").splitlines())}


def measure(hours: float) -> dict[str, Any]:
    """A log of this many hours and one of a single hour, by each estimator."""
    with tempfile.TemporaryDirectory() as folder:
        hour, day = Path(folder) / "hour.log", Path(folder) / "day.log"
        write_log(hour, 1.0)
        n_frames = write_log(day, hours)
        figures = {name: {"hour": estimate(hour, name), "day": estimate(day, name)} for name in ESTIMATOR_NAMES}
        wc_s = best_of(
            2, lambda: {"code": subprocess.run(["wc", "-l", day], check=True, capture_output=True).returncode}
        )
        size_mb = day.stat().st_size / 1e6
    return {"hours": hours, "frames": n_frames, "size_mb": size_mb, "wc_s": wc_s["seconds"], "estimators": figures}
