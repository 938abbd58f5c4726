"""The reading speed of each format: the same frames by ours and by python-can's reader.

python -m benchmarks.speed.formats [--minutes 1] [--json]
"""

import argparse
import json
import tempfile
from importlib import reload
from itertools import islice
from pathlib import Path
from typing import Any

from benchmarks.speed.bus_log import FORMATS, make_log, write_as
from benchmarks.speed.decode import run_springscale
from benchmarks.speed.meter import best_of, in_own_process, print_run

PEER_FRAMES = 50_000  # chosen: python-can is slow


def run_python_can(path: Path) -> dict[str, Any]:
    """python-can's reader alone, discarding its messages; its only supported compression is gzip."""
    if path.suffix in {".zst", ".xz"}:
        return {"skipped": "python-can does not read it"}
    import can.io.mf4  # noqa: PLC0415 # after ours, which keeps asammdf out of it (gateway/bus)

    reader: Any = can.LogReader
    if path.suffix == ".mf4":
        import asammdf  # noqa: F401, PLC0415

        reader = reload(can.io.mf4).MF4Reader

    def run() -> dict[str, Any]:
        return {"frames": sum(1 for _ in islice(reader(path), PEER_FRAMES))}

    return best_of(2, run)


RUNS = {"springscale": run_springscale, "python-can": run_python_can}


def measure(minutes: float) -> dict[str, Any]:
    """Both readers on every format."""
    rows: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "bus.log"
        n_frames = make_log(log, minutes)
        for suffix in FORMATS:
            try:
                path = write_as(log, suffix)
            except ModuleNotFoundError as fault:
                rows[suffix] = {"skipped": f"{fault.name} is not installed"}
                continue
            runs = {name: in_own_process("formats", "--run", name, "--log", path) for name in RUNS}
            rows[suffix] = {"bytes_per_frame": path.stat().st_size / n_frames, **runs}
    return {"frames": n_frames, "rows": rows}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=1.0, help="length of the log that is made")
    parser.add_argument("--json", action="store_true", help="print the figures for machines")
    parser.add_argument("--run", choices=RUNS, help=argparse.SUPPRESS)
    parser.add_argument("--log", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        print_run(lambda: RUNS[options.run](options.log))
        return
    result = measure(options.minutes)
    if options.json:
        print(json.dumps(result))
        return
    for suffix, row in result["rows"].items():
        told = {
            name: row[name].get("skipped") or f"{row[name]['ns_per_frame']:9.0f} ns" for name in RUNS if name in row
        }
        print(f"{suffix:<10}", row.get("skipped") or told)


if __name__ == "__main__":
    main()
