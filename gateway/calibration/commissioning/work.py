"""The process that inspects and fits: ``python -m gateway.calibration.commissioning.work FOLDER``.

Lowest priority, one thread, bounded memory, so that weighing goes on at the same time. Faults of the drives are part of
the result; a process without a result was ended from outside, or ran out of memory.
"""

import contextlib
import os
import re
import resource
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from gateway.calibration.calibrate import calibrate_inspected
from gateway.calibration.campaign import Campaign, DraftTable
from gateway.calibration.commissioning.job import JOB, RESULT, Job, Result, findings_of, to_file
from gateway.calibration.commissioning.learned import learned_by
from gateway.calibration.file.calibration_file import load_calibration
from gateway.calibration.inspection.campaign import Inspection
from gateway.calibration.inspection.finding import Finding, Kind
from gateway.calibration.inspection.log import SplitRun
from gateway.calibration.kept.batch_file import unpacked
from gateway.calibration.kept.drive import ESTIMATORS, inspect_kept, split_run_of
from gateway.calibration.known_run import KnownRun
from gateway.core.settings import BatchSettings
from gateway.errors import SpringscaleError

LOWEST: Final = 19  # of Linux's nice values
BYTES_PER_MB: Final = 1_000_000  # SI


def main(folder: Path) -> None:
    """Do the job in ``folder``."""
    begun_s = time.monotonic()
    job = Job.model_validate_json((folder / JOB).read_bytes())
    _take_little(job.most_memory_mb)
    try:
        result = done(folder / JOB, job)
    except SpringscaleError as fault:
        result = Result(fault=str(fault))
    except MemoryError:
        result = Result(fault=f"the fit needs more than {job.most_memory_mb:g} MB")
    took = {"seconds": time.monotonic() - begun_s, "most_memory_mb": _most_memory_mb()}
    fresh = folder / f".{RESULT}"
    to_file(result.model_copy(update=took), fresh)
    fresh.rename(folder / RESULT)


def done(path: Path, job: Job) -> Result:
    """The result of the job. Raises SpringscaleError if none can be written."""
    campaign = Campaign(path, DraftTable(vehicle=job.vehicle))  # its hash in the calibration is that of the job
    inspection = inspect_kept(campaign, tuple(_runs(job)), BatchSettings(**job.settings))
    looked = Result(findings=findings_of(_findings(inspection)), refusal=inspection.refusal)
    if not job.is_fit or inspection.refusal is not None:
        return looked
    like = None if job.like is None else load_calibration(job.like)
    outcome = calibrate_inspected(campaign, inspection, estimators=ESTIMATORS, like=like, command=job.command)
    made = {
        "learned": learned_by(outcome, campaign.vehicle, job.goal_std_share),
        "calibration": outcome.file.to_json(),
        "calibration_id": outcome.file.id,
        "warnings": outcome.file.warnings,
        "doubts": outcome.doubts,
    }
    return looked.model_copy(update=made)


def _runs(job: Job) -> Iterator[SplitRun]:
    for number, drive in enumerate(job.drives, 1):
        run = KnownRun(number, drive.name, drive.payload_kg, drive.front_share_pct, (), drive.payload_left_m)
        yield split_run_of(run, [unpacked(path.read_bytes()) for path in drive.batches])


def _findings(inspection: Inspection) -> Iterator[Finding]:
    yield from (finding for verdict in inspection.verdicts for finding in verdict.findings)
    yield from (finding for finding in inspection.findings if finding.kind is not Kind.ONE_LOAD_ONLY)  # as was meant


def _take_little(most_memory_mb: float) -> None:
    """Lowest priority, bounded memory. A service manager that forbids the first limits the processor itself."""
    with contextlib.suppress(OSError):
        os.nice(LOWEST)
    most, (_, allowed) = round(most_memory_mb * BYTES_PER_MB), resource.getrlimit(resource.RLIMIT_AS)
    if allowed != resource.RLIM_INFINITY:
        most = min(most, allowed)  # to ask for more is an error
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


def _most_memory_mb() -> float:
    """Memory in use so far, by Linux's own account; 0 elsewhere. getrusage reports the service's memory if that was
    more.
    """
    with contextlib.suppress(OSError):
        found = re.search(r"^VmHWM:\s+(\d+) kB$", Path("/proc/self/status").read_text("ascii", "replace"), re.MULTILINE)
        if found:
            return int(found[1]) * 1024 / BYTES_PER_MB
    return 0.0


if __name__ == "__main__":
    main(Path(sys.argv[1]))
