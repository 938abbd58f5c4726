"""The command: measures, prints, and writes the JSON from which docs/scale.md is computed."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import benchmarks.speed.footprint as package
from benchmarks.speed.footprint import broker, kept
from benchmarks.speed.footprint import drives as logs_of
from benchmarks.speed.meter import machine, print_and_write
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_to_json
from gateway.store import Store
from gateway.uplink.outbox import Outbox, OutboxMessage


def measure(folder: Path, n_drives: int) -> dict[str, Any]:
    """Every figure of docs/scale.md that is measured."""
    written = list(logs_of.write_drives(folder, n_drives))
    logs = [path for path, _ in written]
    hours = sum(driven for _, driven in written)
    weighed = logs_of.weigh(logs, kept.VEHICLE)
    answered = sum(estimate.counted for estimate in weighed.estimates)
    return {
        "machine": machine(),
        "records": {
            "n": len(weighed.estimates),
            "n_answered": answered,
            "json_bytes": kept.json_bytes(weighed.estimates),
            "sqlite_bytes": kept.sqlite_bytes(folder, weighed.estimates),
            **kept.archive_bytes(folder, logs),
        },
        "weighing": {"hours": hours, "cpu_s": weighed.cpu_s, "cpu_s_per_answer": weighed.cpu_s / answered},
        "mapped_frames": {"gz_bytes_per_hour": sum(log.stat().st_size for log in logs) / hours},
        "whole_bus": logs_of.bytes_of_the_bus(folder),
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


def measured(drives: int) -> dict[str, Any]:
    """Measure in a folder that is thrown away; ``drives`` are simulated ones of 25 minutes."""
    with tempfile.TemporaryDirectory() as folder:
        return measure(Path(folder), drives)


if __name__ == "__main__":
    print_and_write(package.__doc__, measured, drives=12)
