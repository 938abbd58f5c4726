"""The process that learns: ``python -m gateway.calibration.learning.work FOLDER``.

Lowest priority, one thread, bounded memory, so that weighing goes on at the same time. Faults of the drives are part of
the result; a process without a result was ended from outside, or ran out of memory.
"""

import contextlib
import os
import re
import resource
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from gateway.calibration.assigned import moments
from gateway.calibration.file import load_calibration
from gateway.calibration.found import FoundLoad
from gateway.calibration.judgement.advice import verdicts_of
from gateway.calibration.judgement.assessment import assess_calibration
from gateway.calibration.kept import KeptBatch, unpacked
from gateway.calibration.learning.from_pieces import Learnt, learn, matched
from gateway.calibration.learning.job import JOB, RESULT, LearnJob, LearnResult
from gateway.calibration.learning.spans import standing
from gateway.calibration.learning.told import drives_record, learning_record, statements_record
from gateway.calibration.learning.windows import pieces
from gateway.calibration.stated_drive import drive_name
from gateway.core.batch_settings import BatchSettings
from gateway.errors import CalibrationFileError, KeptBatchError, SpringscaleError
from gateway.estimates.posterior import Posterior
from gateway.records import Batch
from gateway.units import BYTES_PER_MB
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.weighing.estimator import estimate

LOWEST: Final = 19  # of Linux's nice values
LEAST_COMPARED: Final = 3  # chosen: drives with a statement; fewer decide nothing
WORSE_BY: Final = 0.5  # chosen: mean difference of logarithmic scores a drive, beyond which chance is unlikely


def main(folder: Path) -> None:
    """Do the job in ``folder``."""
    begun_s = time.monotonic()
    job = LearnJob.model_validate_json((folder / JOB).read_bytes())
    _take_little(job.most_memory_mb)
    try:
        result = done(job)
    except SpringscaleError as fault:
        result = LearnResult(fault=str(fault))
    except MemoryError:
        result = LearnResult(fault=f"learning needs more than {job.most_memory_mb:g} MB")
    took = {"key": job.key, "seconds": time.monotonic() - begun_s, "most_memory_mb": _most_memory_mb()}
    fresh = folder / f".{RESULT}"
    fresh.write_text(result.model_copy(update=took).model_dump_json(), encoding="utf-8")
    fresh.rename(folder / RESULT)


def done(job: LearnJob) -> LearnResult:
    """The result of the job. Raises SpringscaleError if no drive can teach."""
    settings, records = BatchSettings(**job.settings), standing(job.records)
    windows, damaged = _windows(job)
    driven = pieces(windows, moments(records), settings).driven
    assigned = matched(records, driven, job.vehicle)
    like = None if job.like is None else load_calibration(job.like)
    found = learn(job.vehicle, driven, assigned, settings, like=like)
    verdict = verdicts_of(assess_calibration(found.outcome))[0]
    file = found.outcome.file
    return LearnResult(
        calibration=file.to_json(),
        calibration_id=file.id,
        learning=learning_record(found, verdict),
        statements=tuple(statements_record(records, assigned, found)),
        drives=tuple(drives_record(found)),
        looks_empty=found.looking_empty(job.laden),
        damaged=damaged,
        worse=_why_worse(job, found),
    )


def _windows(job: LearnJob) -> tuple[list[KeptBatch], tuple[str, ...]]:
    """The windows that can be read, and the names of the files of the others."""
    windows, damaged = [], []
    for path in job.windows:
        try:
            windows.append(unpacked(path.read_bytes()))
        except (OSError, KeptBatchError):
            damaged.append(path.name)
    return windows, tuple(damaged)


def _why_worse(job: LearnJob, found: Learnt) -> str | None:
    """Why the calibration before is better; None if it is not, or nothing tells.

    Both are asked for drives with a statement that neither has learnt: of the new one each drive is left out, the old
    one has not met them. A logarithmic score counts the error and the claimed accuracy.
    """
    if job.before is None or found.outcome.cross_spectrum is None:
        return None
    try:
        before = load_calibration(job.before)
    except CalibrationFileError:
        return None
    met = {one.t_start for one in before.provenance.drives if one.statement.is_of_payload}
    started = {one.number: one.t_start for one in found.outcome.file.provenance.drives}
    gains = []
    for drive in found.drives:
        left_out = [one for one in found.outcome.cross_spectrum.errors if one.run == drive_name(drive.number)]
        if not left_out or drive.load is None or started[drive.number] in met:
            continue
        by_old = _scores_by(before.for_core(), drive.driven.batches, drive.load)
        if by_old:
            by_new = [_log_score(float(one.error[0]), one.posterior, float(one.stated_std[0])) for one in left_out]
            gains.append(float(np.mean(by_new)) - float(np.mean(by_old)))
    if len(gains) < LEAST_COMPARED and job.is_file_before:
        return f"the calibration of the settings stands until {LEAST_COMPARED} drives with a statement compare both"
    if len(gains) < LEAST_COMPARED or float(np.mean(gains)) > -WORSE_BY:
        return None
    return f"it predicts the loads of {len(gains)} drives that were left out worse than the calibration before it"


def _scores_by(before: CalibratedVehicle, batches: Sequence[Batch], load: FoundLoad) -> list[float]:
    """The scores of a calibration on the batches of a drive that it answers, by what is stated of the load."""
    answers = [estimate(batch, before, "cross_spectrum") for batch in batches]
    return [
        _log_score(float(one.posterior.mean[0]) - load.stated_kg, one.posterior, load.stated_std_kg)
        for one in answers
        if one.posterior is not None and one.counted
    ]


def _log_score(error_kg: float, posterior: Posterior, std_kg: float) -> float:
    """Of an answer whose truth is known to within a standard deviation."""
    variance = float(posterior.covariance[0, 0]) + std_kg**2
    return -0.5 * (error_kg**2 / variance + float(np.log(variance)))


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
