"""Bytes of a stored record: in the vehicle's SQLite database, and in an archive's tables and receipts."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.speed.footprint.drives import SIGNALS
from benchmarks.speed.meter import CALIBRATION
from gateway.archive import place_of, slots_done
from gateway.archive.manifest import load_manifest
from gateway.archive.reprocess import reprocess
from gateway.archive.workers import local_workers
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_to_json
from gateway.records import json_line
from gateway.store import Store

TIMEOUT_S = 60.0  # chosen
VEHICLE = "van-17"
MANIFEST = """\
signals = "{signals}"
calibration = "{calibration}"
[[vehicles]]
id = "{vehicle}"
"""


def json_bytes(estimates: Sequence[Estimate]) -> dict[str, float]:
    """Mean length of a record's text, and the part of its spectra."""
    whole = [estimate_to_json(estimate) for estimate in estimates]
    bare = [{name: shown for name, shown in record.items() if name != "spectra"} for record in whole]
    return {"with_spectra": _mean_length(whole), "without_spectra": _mean_length(bare)}


def sqlite_bytes(folder: Path, estimates: Sequence[Estimate]) -> float:
    """Increase of the database per record: the second half of the records against the first."""
    half = len(estimates) // 2
    store = Store.open(folder)
    try:
        sizes = [_stored(store, folder, part) for part in (estimates[:half], estimates[half:])]
    finally:
        store.close()
    return (sizes[1] - sizes[0]) / (len(estimates) - half)


def _stored(store: Store, folder: Path, estimates: Sequence[Estimate]) -> int:
    """Bytes of the database once these are in it, its write-ahead log left out."""
    for estimate in estimates:
        store.write_estimate(estimate_to_json(estimate))
    if not store.flush(TIMEOUT_S):
        raise TimeoutError("the store did not write")
    return store.health().size_bytes


def archive_bytes(folder: Path, logs: Sequence[Path]) -> dict[str, dict[str, float]]:
    """Size of the table and the receipt that `springscale reprocess` writes for one month of a vehicle's logs.

    Each has a fixed size and a size per record and log: half of the logs are compared with all of them.
    """
    half, whole = (_reprocessed(folder / f"of-{n}", logs[:n]) for n in (len(logs) // 2, len(logs)))
    per_record = (whole.table_bytes - half.table_bytes) / (whole.n_batches - half.n_batches)
    per_log = (whole.receipt_bytes - half.receipt_bytes) / (len(logs) - len(logs) // 2)
    return {
        "parquet_bytes": {"per_record": per_record, "per_file": whole.table_bytes - whole.n_batches * per_record},
        "receipt_bytes": {"per_log": per_log, "per_file": whole.receipt_bytes - len(logs) * per_log},
    }


@dataclass(frozen=True, slots=True)
class _Month:
    table_bytes: int
    receipt_bytes: int
    n_batches: int


def _reprocessed(folder: Path, logs: Sequence[Path]) -> _Month:
    (folder / "archive" / VEHICLE).mkdir(parents=True)
    for log in logs:
        (folder / "archive" / VEHICLE / log.name).symlink_to(log)
    manifest = folder / "archive/archive.toml"
    manifest.write_text(MANIFEST.format(signals=SIGNALS, calibration=CALIBRATION, vehicle=VEHICLE))
    dataset = place_of(folder / "dataset")
    with local_workers(1) as workers:
        reprocess(load_manifest(str(manifest)), dataset, workers)
    [slot] = slots_done(dataset)
    receipt = dataset.read(slot.receipt)
    return _Month(len(dataset.read(slot.table)), len(receipt), json.loads(receipt)["n_batches"])


def _mean_length(records: Sequence[dict[str, Any]]) -> float:
    return sum(len(json_line(record).encode()) for record in records) / len(records)
