"""Bulk decoding of a candump log, compared with `wc -l` and other decoders in the same run.

    python -m benchmarks.speed.decode [--minutes 5] [--json]

Makes a log of a busy bus (benchmarks/speed/bus_log.py) and reads it into arrays of time, acceleration, pitch rate and
speed. Each path runs in a process of its own, the start of Python left out. The slowest read a log of two minutes.
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.speed.bus_log import make_log, write_as
from benchmarks.speed.meter import best_of, in_own_process, print_run
from benchmarks.speed.peers import PEERS, SLOW
from gateway.bus.logs import motion_of_log
from gateway.bus.signals import load_signal_map

SHORT_MINUTES = 2.0  # chosen: of the log for the slowest
OURS = "springscale"


def run_springscale(path: Path) -> dict[str, Any]:
    """Read and decode the complete log with our decoder."""
    signal_map = load_signal_map("springscale:reference")

    def run() -> dict[str, Any]:
        chunks, report, _ = motion_of_log(path, signal_map)
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
        rows = {OURS: in_own_process("decode", "--run", long)}
        try:
            write_as(short, ".mf4")
        except ModuleNotFoundError:
            rows["asammdf, from .mf4"] = {"skipped": "asammdf is not installed"}
        for name in PEERS:
            if name not in rows:
                rows[name] = in_own_process("peers", "--run", name, "--log", short if name in SLOW else long)
    ours = rows[OURS]["ns_per_frame"]
    return {
        "minutes": minutes,
        "rows": rows,
        "times_python_can": rows["python-can + cantools"]["ns_per_frame"] / ours,
        "times_wc": ours / rows["wc -l"]["ns_per_frame"],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=5.0, help="length of the log that is made")
    parser.add_argument("--json", action="store_true", help="print the figures for machines")
    parser.add_argument("--run", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        print_run(lambda: run_springscale(options.run))
        return
    result = measure(options.minutes)
    if options.json:
        print(json.dumps(result))
        return
    for name, row in result["rows"].items():
        print(f"{name:<24}", row.get("skipped") or f"{row['ns_per_frame']:10.1f} ns/frame {row['peak_mb']:6.0f} MB")
    print(f"{result['times_python_can']:.0f} x python-can + cantools, {result['times_wc']:.1f} times wc -l")


if __name__ == "__main__":
    main()
