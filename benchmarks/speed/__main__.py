"""All speed benchmarks in one run and one table: `make bench`.

    python -m benchmarks.speed [--only decode,formats] [--quick] [--output docs/performance.json]

Each part runs alone in a process of its own, one after the other. The figures are written as JSON, from which
docs/make.py makes docs/performance.md. It takes about a quarter of an hour, and ten gigabytes of disk for the day.
"""

import argparse
import compileall
import json
import os
import platform
import sys
import time
from collections.abc import Iterable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Any, Final

from benchmarks.speed.meter import ROOT, in_own_process
from benchmarks.speed.table import Line, lines_of

PARTS: Final[dict[str, tuple[float, ...]]] = {  # how much each measures, and how much when it is to be quick
    "decode": (10.0, 1.0),  # minutes of log
    "formats": (2.0, 0.5),  # minutes of log
    "day": (8.0, 0.5),  # hours of log
    "live": (5.0, 2.0),  # seconds a run
    "service": (75.0, 70.0),  # seconds
    "idle": (120.0, 20.0),  # seconds
    "web": (10.0, 3.0),  # seconds
    "weigh": (),
    "archive": (8, 2),  # vehicles
    "start": (),
    "simulator": (),
}
MOST_LOAD: Final = 1.0  # load average over the last minute
PACKAGES: Final = ("numpy", "python-can", "cantools", "hilspy", "asammdf", "can_decoder", "polars", "isal")


def conditions() -> dict[str, Any]:
    """The conditions of the measurement: machine, versions."""
    return {
        "machine": f"{_processor()}, {os.cpu_count()} processors",
        "python": platform.python_version(),
        "packages": {name: version for name in PACKAGES if (version := _version(name))},
        "load_average_before": os.getloadavg()[0],
    }


def _processor() -> str:
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def measure(parts: Iterable[str], *, quick: bool) -> Iterator[dict[str, Any]]:
    """The parts one after the other; after each, all the figures so far."""
    found: dict[str, Any] = {"conditions": conditions() | {"is_quick": quick}}
    compileall.compile_dir(ROOT / "gateway", quiet=1)  # as an installation does
    for part in parts:
        print(f"{time.strftime('%H:%M:%S')} {part} ...", file=sys.stderr, flush=True)
        amounts = PARTS[part][quick:][:1]
        found[part] = in_own_process(f"benchmarks.speed.{part}:measure", *amounts)
        found["conditions"]["load_average_after"] = os.getloadavg()[0]
        yield found


def show(lines: list[Line]) -> None:
    """One table."""
    widths = [
        max(len(text) for text in column) for column in zip(*((line.what, line.figure) for line in lines), strict=True)
    ]
    section = ""
    for line in lines:
        if line.section != section:
            section = line.section
            print(f"\n{section}")
        print(f"  {line.what:<{widths[0]}}  {line.figure:<{widths[1]}}  {line.verdict}".rstrip())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default=",".join(PARTS), help="these parts, by comma; others are kept as they were")
    parser.add_argument("--quick", action="store_true", help="shorter logs and times: to see that it works")
    parser.add_argument("--output", type=Path, help="where the figures go as JSON")
    options = parser.parse_args()
    chosen = options.only.split(",")
    if unknown := set(chosen) - set(PARTS):
        parser.error(f"--only {','.join(unknown)}: there are {', '.join(PARTS)}")
    if options.output and (load := os.getloadavg()[0]) > MOST_LOAD:
        raise SystemExit(
            f"nothing is written: the load average is {load:.1f}, and figures of a busy machine say little. Wait until "
            f"it is below {MOST_LOAD:g}, or leave --output out."
        )
    before = json.loads(options.output.read_text()) if options.output and options.output.is_file() else {}
    found: dict[str, Any] = {}
    for found in measure(chosen, quick=options.quick):  # kept as far as it has come: a part may fail
        if options.output:
            options.output.write_text(json.dumps(before | found, indent=1) + "\n")
    show(lines_of(found))


if __name__ == "__main__":
    main()
