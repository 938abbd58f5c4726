"""Runs one job: a vehicle's drives of a month become a table and its receipt, with a small summary.

    outcome = run(job)        # on any worker, any number of times: a finished job is skipped

The table is written first and its receipt last, and only if there is none. A log that cannot be read is listed in the
receipt.
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
from gateway.archive.drives import JobDrives, followed, readable
from gateway.archive.jobs import ArchiveJob, JobLog, software
from gateway.archive.receipts import Slot, text_of
from gateway.bus.logs import LogReport
from gateway.errors import ConfigurationError, LogUnreadableError
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate
from gateway.model.allocator import keep_freed_memory
from gateway.units import NS_PER_S

OVERLAP_NS: Final = NS_PER_S  # chosen: longer than two logs of one recorder share
MOST_TOLD: Final = 5  # chosen: of each kind in the outcome; the receipt has all failures


class JobStatus(StrEnum):
    """The result of a job."""

    DONE = "done"
    ALREADY = "already"  # by an earlier run, or by another worker
    LOST = "lost"  # a store or a worker failed: retry


@dataclass(frozen=True, slots=True)
class JobOutcome:
    """The summary of a job; everything else is in the data set."""

    slot: Slot
    status: JobStatus
    size: int = 0  # bytes of logs
    took_s: float = 0.0
    n_batches: int = 0
    n_weighed: int = 0
    n_failed_logs: int = 0
    failures: tuple[str, ...] = ()  # the first few
    refused: tuple[str, ...] = ()  # likewise: frames of another length than the database says, values out of range
    overlaps: tuple[str, ...] = ()  # likewise: logs of the same time


def run(job: ArchiveJob) -> JobOutcome:
    """Run a job unless it is done. Raises PlaceError if logs or data set cannot be reached now."""
    keep_freed_memory()
    if job.inputs["software"] != software():
        raise ConfigurationError(
            f"{platform.node()}: runs {software()}, the job is for {job.inputs['software']}: "
            "install the same springscale on every computer of the cluster"
        )
    if _is_done(job):
        return JobOutcome(job.slot, JobStatus.ALREADY, job.size)
    begun_s = time.monotonic()
    rows: list[dict[str, Any]] = []
    told: list[dict[str, Any]] = []
    refused: list[str] = []
    overlaps: list[str] = []
    longest, end_ns = "", -1  # the log that ends last so far
    failures = {one: one.facts.fault or "" for one in job.logs if one.facts.first_ns is None}
    drives = JobDrives(job)
    for one, next_ns in followed(readable(job.logs), job.next_ns):
        try:
            estimates, report = drives.take(one, next_ns)
        except LogUnreadableError as fault:
            failures[one] = str(fault)
            rows += [_row(job, before, found) for before, found in drives.break_off()]
            continue
        rows += [_row(job, one, found) for found in estimates]
        told.append(_told(one, report))
        if report.wanted and report.span_ns[0] < end_ns - OVERLAP_NS:
            overlaps.append(f"{one.log.name}: begins before {longest} ends")
        if report.wanted and report.span_ns[1] > end_ns:
            longest, end_ns = one.log.name, report.span_ns[1]
        refused += (f"{one.log.name}: {cause.text}" for cause in report.causes())
    outcome = JobOutcome(
        slot=job.slot,
        status=JobStatus.DONE,
        size=job.size,
        took_s=time.monotonic() - begun_s,
        n_batches=len(rows),
        n_weighed=sum(not row["rejected"] for row in rows),
        n_failed_logs=len(failures),
        failures=tuple(failures.values())[:MOST_TOLD],
        refused=tuple(refused)[:MOST_TOLD],
        overlaps=tuple(overlaps)[:MOST_TOLD],
    )
    return _written(job, outcome, rows, told, failures)


def _is_done(job: ArchiveJob) -> bool:
    try:
        job.dataset.read(job.slot.receipt)
    except FileNotFoundError:
        return False
    return True


def _row(job: ArchiveJob, one: JobLog, found: Estimate) -> dict[str, Any]:
    provenance = {
        "log": one.log.name,
        "log_sha256": one.facts.sha256,
        "signals_id": job.inputs["signals"],
        "software": job.inputs["software"],
        "job": job.slot.job,
    }
    return row_of(estimate_to_json(found)) | provenance


def _told(one: JobLog, report: LogReport) -> dict[str, Any]:
    """A receipt's entry for a log."""
    told = {"log": one.log.name, "sha256": one.facts.sha256, "bytes": one.log.size, "frames": report.wanted}
    remarks = [remark.replace(str(report.path), one.log.name) for remark in report.remarks()]
    return told | {"left_out": report.left_out, "ended_early": report.ended_early, "remarks": remarks}


def _written(
    job: ArchiveJob,
    outcome: JobOutcome,
    rows: list[dict[str, Any]],
    told: list[dict[str, Any]],
    failures: dict[JobLog, str],
) -> JobOutcome:
    """Write the table, then its receipt; those of another worker are kept, unless a power cut has torn the table."""
    table = parquet_of(rows)
    if not job.dataset.create(job.slot.table, table) and job.dataset.read(job.slot.table) != table:
        job.dataset.replace(job.slot.table, table)
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
    return outcome if is_ours else replace(outcome, status=JobStatus.ALREADY)
