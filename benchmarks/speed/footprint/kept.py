"""Bytes of a record where it is kept: in the vehicle's SQLite database, and in a Parquet file of an archive."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gateway.estimate import Estimate
from gateway.estimate_json import estimate_to_json, table_row
from gateway.records import json_line
from gateway.store import Store

TIMEOUT_S = 60.0


def json_bytes(estimates: Sequence[Estimate]) -> dict[str, float]:
    """Of the record's text, on average, and how much of it are spectra."""
    whole = [estimate_to_json(estimate) for estimate in estimates]
    bare = [{name: shown for name, shown in record.items() if name != "spectra"} for record in whole]
    return {"with_spectra": _mean_length(whole), "without_spectra": _mean_length(bare)}


def sqlite_bytes(folder: Path, estimates: Sequence[Estimate]) -> float:
    """What one more record adds to the database: the second half of the records against the first."""
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


def parquet_bytes(folder: Path, estimates: Sequence[Estimate]) -> dict[str, float]:
    """Of a file of the flat columns: what it weighs without records, and what each record adds, spectra left out."""
    half = len(estimates) // 2
    first, whole = (_written(folder / f"{n}.parquet", estimates[:n]) for n in (half, len(estimates)))
    per_record = (whole - first) / (len(estimates) - half)
    return {"per_record": per_record, "per_file": first - half * per_record}


def _written(path: Path, estimates: Sequence[Estimate]) -> int:
    import pyarrow as pa  # noqa: PLC0415  # what the broker and the logs are measured by needs no Arrow
    import pyarrow.parquet as pq  # noqa: PLC0415

    pq.write_table(pa.Table.from_pylist([table_row(estimate) for estimate in estimates]), path, compression="zstd")
    return path.stat().st_size


def _mean_length(records: Sequence[dict[str, Any]]) -> float:
    return sum(len(json_line(record).encode()) for record in records) / len(records)
