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
from pathlib import Path
from typing import Final

import numpy as np

from gateway.calibration.assigned import moments
from gateway.calibration.calibrate import drive_name
from gateway.calibration.file import CalibrationFile, load_calibration
from gateway.calibration.judgement.advice import verdicts_of
from gateway.calibration.judgement.assessment import assess_calibration
from gateway.calibration.kept import KeptBatch, unpacked
from gateway.calibration.learning.drives import pieces
from gateway.calibration.learning.job import JOB, RESULT, LearnJob, LearnResult
from gateway.calibration.learning.learn import Learnt, learn, matched
from gateway.calibration.learning.spans import standing
from gateway.calibration.learning.told import drives_record, learning_record, statements_record
from gateway.calibration.left_out import LeftOut
from gateway.core.settings import BatchSettings
from gateway.errors import CalibrationFileError, KeptBatchError, SpringscaleError
from gateway.units import BYTES_PER_MB
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
    errors = found.outcome.cross_spectrum.errors
    gains = []
    for number, one in enumerate(found.drives, 1):
        left_out = [error for error in errors if error.run == drive_name(number)]
        started = next(drive.t_start for drive in found.outcome.file.provenance.drives if drive.number == number)
        if not left_out or started in met:
            continue
        stated_kg, load = found.loads[number].stated_kg, found.loads[number]
        by_old = _score_by(before, found, number, stated_kg, load.stated_std_kg)
        if by_old is not None and len(one.batches):
            gains.append(float(np.mean([_score_of(error) for error in left_out])) - by_old)
    if len(gains) < LEAST_COMPARED and job.is_file_before:
        return f"the calibration of the settings stands until {LEAST_COMPARED} drives with a statement compare both"
    if len(gains) < LEAST_COMPARED or float(np.mean(gains)) > -WORSE_BY:
        return None
    return f"it predicts the loads of {len(gains)} drives that were left out worse than the calibration before it"


def _score_of(error: LeftOut) -> float:
    """Logarithmic score of a batch that was left out."""
    variance = float(error.posterior.covariance[0, 0]) + float(error.stated_std[0]) ** 2
    return _log_score(float(error.error[0]), variance)


def _score_by(file: CalibrationFile, found: Learnt, number: int, stated_kg: float, std_kg: float) -> float | None:
    """The mean score of a calibration on the batches of a drive; None if it answers none."""
    calibrated = file.for_core()
    scores = []
    for batch in found.drives[number - 1].batches:
        answer = estimate(batch, calibrated, "cross_spectrum")
        if answer.posterior is not None and answer.counted:
            variance = float(answer.posterior.covariance[0, 0]) + std_kg**2
            scores.append(_log_score(float(answer.posterior.mean[0]) - stated_kg, variance))
    return float(np.mean(scores)) if scores else None


def _log_score(error_kg: float, variance: float) -> float:
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
