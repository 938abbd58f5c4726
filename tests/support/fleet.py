"""Data sets of a fleet as `springscale reprocess` leaves them, made up row by row."""

import hashlib
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from gateway.archive.dataset import columns, parquet_of
from gateway.archive.receipts import Slot, text_of
from gateway.units import NS_PER_S

DAY_S = 86_400
MONDAY_S = 1_767_571_200  # 2026-01-05T00:00:00Z


def row(t_end_s: float, *rejected: str, **known: Any) -> dict[str, Any]:
    """A batch: an answer of 100 kg, or a refusal; what else is known stands over it."""
    answer = {} if rejected else {"payload_kg": 100.0, "payload_std_kg": 5.0, "payload_own_std_kg": 3.0}
    told = {"t_end_ns": round(t_end_s * NS_PER_S), "calibration_id": "sha256:1", "rejected": list(rejected)}
    return {**told, "over_limit": [], **answer, **known}


def write_table(
    dataset: Path, vehicle: str, rows: Sequence[Mapping[str, Any]], month: str = "2026-01", failed: Sequence[Any] = ()
) -> Slot:
    """A job's table and its receipt, which names the logs that failed."""
    job = hashlib.sha256(f"{vehicle} {month}".encode()).hexdigest()[:32]
    slot = Slot(vehicle, month, job)
    whole = [{**dict.fromkeys(columns()), "vehicle_id": vehicle, "job": job, **_with_instant(one)} for one in rows]
    receipt = {"job": job, "vehicle": vehicle, "month": month, "failed_logs": list(failed)}
    for name, content in ((slot.table, parquet_of(whole)), (slot.receipt, text_of(receipt))):
        (dataset / name).parent.mkdir(parents=True, exist_ok=True)
        (dataset / name).write_bytes(content)
    return slot


def _with_instant(row: Mapping[str, Any]) -> dict[str, Any]:
    return {"t_end": datetime.fromtimestamp(row["t_end_ns"] / NS_PER_S, UTC), **row}


def week(number: int, n: int = 10, *rejected: str, **known: Any) -> list[dict[str, Any]]:
    """Batches on the Monday ``number`` weeks after the first of 2026."""
    begin_s = MONDAY_S + number * 7 * DAY_S + 8 * 3600
    return [row(begin_s + 300 * (k + 1), *rejected, **known) for k in range(n)]
