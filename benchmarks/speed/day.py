"""A working day of the bus through `springscale estimate`: its duration, and whether memory grows with the log.

    python -m benchmarks.speed.day [--hours 8] [--json]

The drive of the demo (25 minutes) repeats until the hours are full, on a bus of about 2500 frames/s; the log is plain
candump text of roughly 400 MB an hour, in a temporary folder. Each estimator reads the whole log in a process of its
own, start of Python included; memory is compared with a log of one hour, time with that of `wc -l`.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.speed.meter import ONE_THREAD, best_of
from gateway.bus.frames import merge_frames
from gateway.bus.logs.candump_write import append_candump
from gateway.config import ESTIMATOR_NAMES
from gateway.records import Frames
from gateway.units import NS_PER_S
from gateway.workbench import demo_drive, frames_of
from gateway.workbench.wiring import unrelated_traffic

FRAMES_PER_S = 2500  # as in bus_log
CALIBRATION = Path(__file__).parents[2] / "gateway" / "demo" / "paper_van.json"


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


def written_in_own_process(path: Path, hours: float) -> int:
    """Written by another process, because a child process inherits its parent's peak of memory."""
    command = [sys.executable, "-m", "benchmarks.speed.day", "--write", str(path), "--hours", str(hours)]
    return int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def estimate(log: Path, estimator: str) -> dict[str, float]:
    """Wall time, peak memory and batches of one run of the command."""
    command = [sys.executable, "-m", "gateway", "estimate", str(log), "--signals", "springscale:reference"]
    command += ["--calibration", str(CALIBRATION), "--estimator", estimator, "--json"]
    begun_s = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, env=os.environ | ONE_THREAD)
    assert process.stdout is not None
    n_lines = sum(1 for _ in process.stdout)
    process.stdout.close()
    _, code, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(code)
    assert process.returncode == 0, command
    return {
        "clock_s": time.perf_counter() - begun_s,
        "cpu_s": used.ru_utime + used.ru_stime,
        "peak_mb": used.ru_maxrss / 1024,
        "batches": n_lines,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--json", action="store_true", help="print the figures for machines")
    parser.add_argument("--write", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.write:
        print(write_log(options.write, options.hours))
        return
    with tempfile.TemporaryDirectory() as folder:
        hour, day = Path(folder) / "hour.log", Path(folder) / "day.log"
        written_in_own_process(hour, 1.0)
        n_frames = written_in_own_process(day, options.hours)
        figures = {name: {"hour": estimate(hour, name), "day": estimate(day, name)} for name in ESTIMATOR_NAMES}
        wc_s = best_of(
            2, lambda: {"code": subprocess.run(["wc", "-l", day], check=True, capture_output=True).returncode}
        )
        size_mb = day.stat().st_size / 1e6
    if options.json:
        told = {"hours": options.hours, "frames": n_frames, "size_mb": size_mb, "wc_s": wc_s["seconds"]}
        print(json.dumps(told | {"estimators": figures}))
        return
    print(f"{options.hours:g} h, {n_frames:,} frames, {size_mb:,.0f} MB, wc -l {wc_s['seconds']:.1f} s")
    for name, runs in figures.items():
        day_s, peak_mb, hour_mb = runs["day"]["cpu_s"], runs["day"]["peak_mb"], runs["hour"]["peak_mb"]
        print(
            f"{name:16}{day_s:7.1f} s  {n_frames / day_s / 1e6:5.1f} Mframes/s  "
            f"{runs['day']['batches']:4.0f} batches  peak {peak_mb:.0f} MB (one hour: {hour_mb:.0f} MB)"
        )


if __name__ == "__main__":
    main()
