"""Runs the process that learns, one job at a time, and receives its results."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final

from pydantic import ValidationError

from gateway.calibration.learning.job import JOB, RESULT, LearnJob, LearnResult

FOLDER: Final = "learning"
MODULE: Final = "gateway.calibration.learning.work"
SAID: Final = "said.txt"
WITHIN_S: Final = 1800.0  # chosen: a small computer takes some minutes
MOST_SAID: Final = 2000  # chosen: last bytes of a failed process's output that are kept

OnResult = Callable[[LearnJob, LearnResult], None]


class Worker:
    """One process at a time. ``on_result`` is called from the worker's thread; a job that was stopped has no result."""

    def __init__(self, directory: Path, on_result: OnResult) -> None:
        """``directory`` is the service's; jobs lie in a folder below it."""
        self.folder = directory / FOLDER
        self._on_result = on_result
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def is_busy(self) -> bool:
        """Whether a job is under way."""
        with self._lock:
            return self._process is not None

    @property
    def pid(self) -> int | None:
        """Of the process under way."""
        with self._lock:
            return None if self._process is None else self._process.pid

    def start(self, job: LearnJob) -> None:
        """Begin; a job under way is stopped first. Raises OSError."""
        self.end()
        with self._lock:
            shutil.rmtree(self.folder, ignore_errors=True)
            self.folder.mkdir(parents=True)
            (self.folder / JOB).write_text(job.model_dump_json(by_alias=True), encoding="utf-8")
            with (self.folder / SAID).open("wb") as said:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", MODULE, str(self.folder)],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=said,
                    env=_environment(),
                    start_new_session=True,
                )
            threading.Thread(target=self._wait, args=(job, self._process), name="learning", daemon=True).start()

    def end(self) -> None:
        """Stop the job under way and drop its result."""
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            process.wait()

    def _wait(self, job: LearnJob, process: subprocess.Popen[bytes]) -> None:
        failed = None
        try:
            code = process.wait(WITHIN_S)
            failed = None if code == 0 else self._failed(code)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            failed = LearnResult(fault=f"learning took longer than {WITHIN_S:.0f} s and was ended")
        with self._lock:
            if self._process is not process:
                return
            result = failed or self._result(job)
            self._process = None
        self._on_result(job, result)

    def _result(self, job: LearnJob) -> LearnResult:
        try:
            result = LearnResult.model_validate_json((self.folder / RESULT).read_bytes())
        except (OSError, ValidationError) as broken:
            return LearnResult(fault=f"learning left no result that can be read: {broken}")
        if result.key != job.key:  # a process of a service that was killed ends after its service
            fault = "learning left the result of another job: it was killed, and begins anew"
            return LearnResult(fault=fault, was_killed=True)
        return result

    def _failed(self, code: int) -> LearnResult:
        if code == -signal.SIGKILL:
            why = "the machine has not enough memory for it, or somebody ended it"
            return LearnResult(fault=f"learning was killed: {why}; it begins anew", was_killed=True)
        with contextlib.suppress(OSError):
            said = (self.folder / SAID).read_bytes()[-MOST_SAID:].decode("utf-8", "replace").strip()
            if said:
                return LearnResult(fault=f"learning failed: {said.splitlines()[-1]}")
        return LearnResult(fault=f"learning failed with code {code}")


def _environment() -> dict[str, str]:
    """Our environment, with one thread for linear algebra and our import path."""
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **threads, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
