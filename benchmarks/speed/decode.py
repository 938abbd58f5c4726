"""Bulk decoding of a candump log, beside python-can + cantools and `wc -l` in the same run.

    python -m benchmarks.speed.decode [--minutes 5] [--log FILE] [--json]

Makes a log of a 500 kbit/s bus (2500 frames/s, 60 identifiers, a fifth of them 29-bit, three of them ours)
and reads it into arrays of time, acceleration, pitch rate and speed. Each path runs in a process of its own;
times leave out the start of Python, the best of five counts. Goals: at least 100 x python-can + cantools,
at most 8 x `wc -l`, under 150 MB.
"""

import argparse
import itertools
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import can
import cantools
import numpy as np
from isal import igzip

from gateway.bus.frames import merge_frames
from gateway.bus.logs import motion_of_log
from gateway.bus.logs.candump_write import append_candump
from gateway.bus.logs.packed import open_log_file
from gateway.bus.signals import load_signal_map, shipped_map
from gateway.records import EXTENDED_ID, Frames

FRAMES_PER_S = 2500
N_IDS = 60
START_NS = 1_760_146_908_000_000_000
PEER_FRAMES = 200_000
REPEATS = 5


def make_log(path: Path, minutes: float) -> int:
    """Write the log; returns how many frames it holds."""
    rng = np.random.default_rng(20261121)
    n_others = N_IDS - 3
    ids = rng.choice(np.arange(0x200, 0x7FF), n_others, replace=False).astype(np.uint32)
    ids[: N_IDS // 5] = rng.choice(1 << 28, N_IDS // 5).astype(np.uint32) | np.uint32(EXTENDED_ID)
    ours_per_s = 100 + 100 + 10
    n_total = 0
    with path.open("wb") as file:
        for second in range(round(60 * minutes)):
            begin_ns = START_NS + second * 1_000_000_000
            n = FRAMES_PER_S - ours_per_s
            others = Frames(
                begin_ns + np.arange(n) * (1_000_000_000 // n) // 1000 * 1000,
                rng.choice(ids, n),
                np.full(n, 8, np.uint8),
                rng.integers(0, 256, (n, 8), np.uint8),
            )
            ours = [_ours(rng, begin_ns, *m) for m in ((0x120, 8, 100, 10), (0x121, 8, 100, 10), (0x130, 4, 10, 100))]
            append_candump(merge_frames([others, *ours]), "can0", file)
            n_total += FRAMES_PER_S
    return n_total


def _ours(rng: np.random.Generator, begin_ns: int, can_id: int, length: int, n: int, every_ms: int) -> Frames:
    payload = np.zeros((n, 8), np.uint8)
    payload[:, :length] = rng.integers(0, 100, (n, length), np.uint8)
    payload[:, length - 1] = 3 if can_id == 0x130 else 1  # Fix, or the valid bit
    t_ns = begin_ns + 137_000 + np.arange(n) * every_ms * 1_000_000
    return Frames(t_ns, np.full(n, can_id, np.uint32), np.full(n, length, np.uint8), payload)


def run_springscale(path: Path) -> dict[str, Any]:
    """Read and decode the whole log with ours."""
    signal_map = load_signal_map("springscale:reference")
    seconds = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        chunks, report, _ = motion_of_log(path, signal_map)
        n_rows = sum(len(motion) for motion in chunks)
        seconds.append(time.perf_counter() - begun)
    assert n_rows == report.wanted
    return {"frames": report.frames, "samples": n_rows, "seconds": min(seconds)}


def run_peer(path: Path) -> dict[str, Any]:
    """The first frames with python-can's reader, mapped ones decoded by cantools."""
    database: Any = cantools.database.load_file(shipped_map("reference").with_name("springscale_reference.dbc"))
    messages = {message.frame_id: message for message in database.messages}
    columns: list[tuple[float, float]] = []
    n_frames = 0
    begun = time.perf_counter()
    with can.LogReader(path) as reader:
        for frame in itertools.islice(reader, PEER_FRAMES):
            n_frames += 1
            if not frame.is_extended_id and (message := messages.get(frame.arbitration_id)) is not None:
                decoded = message.decode(frame.data, decode_choices=False)
                columns.append((frame.timestamp, next(iter(decoded.values()))))
    return {"frames": n_frames, "samples": len(columns), "seconds": time.perf_counter() - begun}


def run_wc(path: Path) -> dict[str, Any]:
    """The physical limit of looking at every line."""
    seconds = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        n_lines = int(subprocess.run(["wc", "-l", path], check=True, capture_output=True).stdout.split()[0])
        seconds.append(time.perf_counter() - begun)
    return {"frames": n_lines, "seconds": min(seconds)}


def run_inflate(path: Path) -> dict[str, Any]:
    """What inflating alone costs, for the gzip row."""
    seconds = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        with open_log_file(path) as file:
            n_lines = sum(block.count(b"\n") for block in iter(lambda: file.read(1 << 20), b""))
        seconds.append(time.perf_counter() - begun)
    return {"frames": n_lines, "seconds": min(seconds)}


RUNS = {"springscale": run_springscale, "python-can + cantools": run_peer, "wc -l": run_wc, "inflate": run_inflate}


def in_own_process(name: str, path: Path) -> dict[str, Any]:
    """Run one path in a fresh Python; adds its peak memory."""
    command = [sys.executable, "-m", "benchmarks.speed.decode", "--run", name, "--log", str(path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def measure(path: Path) -> dict[str, Any]:
    """All rows and the ratios the goals are about."""
    rows = {name: in_own_process(name, path) for name in ("wc -l", "springscale", "python-can + cantools")}
    packed = path.with_suffix(".log.gz")
    packed.write_bytes(igzip.compress(path.read_bytes()))
    rows["inflate"] = in_own_process("inflate", packed)
    rows["springscale, gzip"] = in_own_process("springscale", packed)
    packed.unlink()
    for row in rows.values():
        row["ns_per_frame"] = 1e9 * row["seconds"] / row["frames"]
    ours = rows["springscale"]["ns_per_frame"]
    return {
        "rows": rows,
        "times_python_can": rows["python-can + cantools"]["ns_per_frame"] / ours,
        "times_wc": ours / rows["wc -l"]["ns_per_frame"],
        "peak_mb": rows["springscale"]["peak_mb"],
    }


def show(result: dict[str, Any], n_frames: int, log_mb: float) -> None:
    print(f"{n_frames:,} frames, {log_mb:.0f} MB of text\n")
    print(f"{'path':<24}{'ns/frame':>10}{'Mframes/s':>11}{'peak MB':>9}")
    for name, row in result["rows"].items():
        ns = row["ns_per_frame"]
        print(f"{name:<24}{ns:>10.1f}{1e3 / ns:>11.2f}{row['peak_mb']:>9.0f}")
    for label, figure, goal, is_met in (
        ("faster than python-can + cantools", result["times_python_can"], ">= 100", result["times_python_can"] >= 100),
        ("the time of wc -l", result["times_wc"], "<= 8", result["times_wc"] <= 8),
    ):
        print(f"\n{figure:.1f} x {label} (goal {goal}: {'met' if is_met else 'MISSED'})", end="")
    peak = result["peak_mb"]
    print(f"\n{peak:.0f} MB peak memory (goal < 150: {'met' if peak < 150 else 'MISSED'})")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=5.0, help="length of the log that is made")
    parser.add_argument("--log", type=Path, help="use this log instead of making one")
    parser.add_argument("--json", action="store_true", help="print the figures for machines")
    parser.add_argument("--run", choices=RUNS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        row = RUNS[options.run](options.log)
        row["peak_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(json.dumps(row))
        return
    with tempfile.TemporaryDirectory() as folder:
        path = options.log or Path(folder) / "bus.log"
        if options.log is None:
            make_log(path, options.minutes)
        result = measure(path)
        if options.json:
            print(json.dumps(result))
        else:
            show(result, result["rows"]["springscale"]["frames"], path.stat().st_size / 1e6)


if __name__ == "__main__":
    main()
