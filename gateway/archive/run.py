"""One job: a vehicle's drives of a month in, a table and its receipt out, a small account of it back.

    outcome = run(job)        # on any worker, any number of times: what is done is found done

The table is written first, its receipt last, and that only where there is none.
"""

import hashlib
import platform
import time
from collections import Counter
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, Final

from gateway.archive.dataset import SCHEMA_VERSION, parquet_of, row_of
from gateway.archive.drives import Drives, followed, readable
from gateway.archive.jobs import Job, JobLog, software
from gateway.archive.receipts import Slot, text_of
from gateway.bus.logs import LogReport
from gateway.errors import ConfigurationError, LogUnreadableError
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_to_json

TOLD_FAILURES: Final = 5  # in what goes back; all of them are in the data set


class Status(StrEnum):
    """How a job ended."""

    DONE = "done"
    ALREADY = "already"  # by an earlier run, or by another worker
    FAILED = "failed"  # not one log could be read, nor did the month before leave a window: told, and no receipt
    LOST = "lost"  # a store or a worker failed: to be tried again


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a job gives back to who asked for it; everything else is in the data set."""

    slot: Slot
    status: Status
    size: int = 0  # bytes of logs
    took_s: float = 0.0
    n_batches: int = 0
    n_weighed: int = 0
    n_failed_logs: int = 0
    failures: tuple[str, ...] = ()  # the first few


def run(job: Job) -> Outcome:
    """Do a job, unless it is done. Raises PlaceError where logs or data set cannot be reached now."""
    _require_same_software(job)
    if _is_done(job):
        return Outcome(job.slot, Status.ALREADY, job.size)
    begun_s = time.monotonic()
    rows: list[dict[str, Any]] = []
    told: list[dict[str, Any]] = []
    failures = {one: one.facts.fault or "" for one in job.logs if one.facts.first_ns is None}
    drives = Drives(job)
    for one, next_ns in followed(readable(job.logs), job.next_ns):
        try:
            read = drives.take(one, next_ns)
        except LogUnreadableError as fault:
            failures[one] = str(fault)
            rows += [_row(job, before, found) for before, found in drives.break_off()]
            continue
        rows += [_row(job, one, found) for found in read.estimates]
        told.append(_told(one, read.report))
    for one, reason in failures.items():
        _tell_failure(job, one, reason)
    outcome = Outcome(
        slot=job.slot,
        status=Status.DONE if told or rows else Status.FAILED,
        size=job.size,
        took_s=time.monotonic() - begun_s,
        n_batches=len(rows),
        n_weighed=sum(not row["rejected"] for row in rows),
        n_failed_logs=len(failures),
        failures=tuple(failures.values())[:TOLD_FAILURES],
    )
    return _written(job, outcome, rows, told, failures) if told or rows else _failed(job, outcome)


def fail(job: Job, reason: str) -> Outcome:
    """Tell in the data set that a job gave nothing, and why."""
    content = {"vehicle": job.slot.vehicle, "month": job.slot.month, "job": job.slot.job, "log": None, "reason": reason}
    job.dataset.replace(job.slot.failure(), text_of(content))
    return Outcome(job.slot, Status.FAILED, job.size, failures=(reason,))


def _require_same_software(job: Job) -> None:
    if job.inputs["software"] != software():
        raise ConfigurationError(
            f"{platform.node()}: runs {software()}, the job is for {job.inputs['software']}: "
            "install the same springscale on every computer of the cluster"
        )


def _is_done(job: Job) -> bool:
    try:
        job.dataset.read(job.slot.receipt)
    except FileNotFoundError:
        return False
    return True


def _row(job: Job, one: JobLog, found: Estimate) -> dict[str, Any]:
    provenance = {
        "log": one.log.name,
        "log_sha256": one.facts.sha256,
        "signals_id": job.inputs["signals"],
        "software": job.inputs["software"],
        "job": job.slot.job,
    }
    return row_of(estimate_to_json(found)) | provenance


def _told(one: JobLog, report: LogReport) -> dict[str, Any]:
    """What a receipt says of a log."""
    told = {"log": one.log.name, "sha256": one.facts.sha256, "bytes": one.log.size, "frames": report.wanted}
    return told | {"rejected_lines": report.n_rejected, "ended_early": report.ended_early}


def _tell_failure(job: Job, one: JobLog, reason: str) -> None:
    slot = job.slot
    content = {"vehicle": slot.vehicle, "month": slot.month, "job": slot.job, "log": one.log.name, "reason": reason}
    job.dataset.replace(slot.failure(one.log.name), text_of({**content, "sha256": one.facts.sha256}))


def _failed(job: Job, outcome: Outcome) -> Outcome:
    fail(job, f"none of its {len(job.logs)} logs could be read; the first: {outcome.failures[0]}")
    return outcome


def _written(
    job: Job, outcome: Outcome, rows: list[dict[str, Any]], told: list[dict[str, Any]], failures: dict[JobLog, str]
) -> Outcome:
    """The table, then its receipt; another worker's are left as they are."""
    table = parquet_of(rows)
    if not job.dataset.create(job.slot.table, table):
        table = job.dataset.read(job.slot.table)  # of a worker that was killed before its receipt
    receipt = {
        "job": job.slot.job,
        "vehicle": job.slot.vehicle,
        "month": job.slot.month,
        "table": job.slot.table,
        "table_sha256": hashlib.sha256(table).hexdigest(),
        "schema_version": SCHEMA_VERSION,
        "n_batches": outcome.n_batches,
        "n_weighed": outcome.n_weighed,
        "rejected": dict(sorted(Counter(why for row in rows for why in row["rejected"]).items())),
        "logs": told,
        "failed_logs": [{"log": one.log.name, "sha256": one.facts.sha256, "reason": failures[one]} for one in failures],
        "inputs": {key: part for key, part in job.inputs.items() if key != "logs"},
        "run": {"bytes": job.size, "took_s": round(outcome.took_s, 3), "at": f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"},
    }
    is_ours = job.dataset.create(job.slot.receipt, text_of(receipt))
    return outcome if is_ours else replace(outcome, status=Status.ALREADY)
