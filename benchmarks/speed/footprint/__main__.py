"""The command: measures, prints, and writes the JSON from which docs/scale.md is computed."""

import argparse
import json
import platform
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import benchmarks.speed.footprint as package
from benchmarks.speed.footprint import broker, drives, kept
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_to_json
from gateway.store import Store
from gateway.uplink.outbox import Outbox, OutboxMessage


def measure(folder: Path, n_drives: int) -> dict[str, Any]:
    """Every figure of docs/scale.md that is measured."""
    written = list(drives.write_drives(folder, n_drives))
    logs = [path for path, _ in written]
    hours = sum(driven for _, driven in written)
    weighed = drives.weigh(logs, kept.VEHICLE)
    answered = sum(estimate.counted for estimate in weighed.estimates)
    return {
        "machine": f"{platform.machine()}, Python {platform.python_version()}",
        "records": {
            "n": len(weighed.estimates),
            "n_answered": answered,
            "json_bytes": kept.json_bytes(weighed.estimates),
            "sqlite_bytes": kept.sqlite_bytes(folder, weighed.estimates),
            **kept.archive_bytes(folder, logs),
        },
        "weighing": {"hours": hours, "cpu_s": weighed.cpu_s, "cpu_s_per_answer": weighed.cpu_s / answered},
        "mapped_frames": {"gz_bytes_per_hour": sum(log.stat().st_size for log in logs) / hours},
        "whole_bus": drives.bytes_of_the_bus(folder),
        "uplink": broker.measure(folder, letters_of(folder / "outbox", weighed.estimates)),
    }


def letters_of(folder: Path, estimates: Sequence[Estimate]) -> list[OutboxMessage]:
    """The records as the uplink sends them: out of a store."""
    store = Store.open(folder)
    try:
        for estimate in estimates:
            store.write_estimate(estimate_to_json(estimate))
        store.flush(kept.TIMEOUT_S)
        return Outbox(store, "measured").next_messages(len(estimates))
    finally:
        store.close()


def main() -> None:
    """Measure in a folder that is thrown away."""
    parser = argparse.ArgumentParser(prog=package.__name__, description=(package.__doc__ or "").splitlines()[0])
    parser.add_argument("--drives", type=int, default=12, help="simulated drives of 25 minutes")
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        figures = measure(Path(folder), asked.drives)
    text = json.dumps(figures, indent=1)
    print(text)
    if asked.output:
        asked.output.write_text(text + "\n")


if __name__ == "__main__":
    main()
