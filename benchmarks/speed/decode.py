"""Bulk decoding of a candump log, compared with `wc -l` and other decoders in the same run.

Makes a log of a busy bus (benchmarks/speed/bus_log.py) and reads it into arrays of time, acceleration, pitch rate and
speed. Each path runs in a process of its own, the start of Python left out. The slowest read a log of two minutes.
"""

import tempfile
from pathlib import Path
from typing import Any

from benchmarks.speed.bus_log import make_log, write_as
from benchmarks.speed.meter import best_of, in_own_process
from benchmarks.speed.peers import PEERS, SLOW, read_by
from gateway.bus.logs import motion_of_log
from gateway.bus.signals import load_signal_map

SHORT_MINUTES = 2.0  # chosen: of the log for the slowest
OURS = "springscale"


def run_springscale(log: str) -> dict[str, Any]:
    """Read and decode the complete log with our decoder."""
    signal_map = load_signal_map("springscale:reference")

    def run() -> dict[str, Any]:
        chunks, report = motion_of_log(Path(log), signal_map)
        n_rows = sum(len(motion) for motion in chunks)
        assert n_rows == report.wanted
        return {"frames": report.frames, "samples": n_rows}

    return best_of(5, run)


def measure(minutes: float) -> dict[str, Any]:
    """All rows and the ratios the goals are about."""
    with tempfile.TemporaryDirectory() as folder:
        long, short = Path(folder) / "long.log", Path(folder) / "short.log"
        make_log(long, minutes)
        make_log(short, min(minutes, SHORT_MINUTES))
        rows = {OURS: in_own_process(run_springscale, long)}
        try:
            write_as(short, ".mf4")
        except ModuleNotFoundError:
            rows["asammdf, from .mf4"] = {"skipped": "asammdf is not installed"}
        for name in PEERS:
            if name not in rows:
                rows[name] = in_own_process(read_by, name, short if name in SLOW else long)
    ours = rows[OURS]["ns_per_frame"]
    return {
        "minutes": minutes,
        "rows": rows,
        "times_python_can": rows["python-can + cantools"]["ns_per_frame"] / ours,
        "times_wc": ours / rows["wc -l"]["ns_per_frame"],
    }
