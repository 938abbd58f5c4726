"""Runs the process that inspects and fits, one job at a time, and receives its results."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from pydantic import ValidationError

from gateway.calibration.commissioning.job import JOB, RESULT, Job, Result, to_file

FOLDER: Final = "commissioning"
MODULE: Final = "gateway.calibration.commissioning.work"
SAID: Final = "said.txt"
WITHIN_S: Final = 1800.0  # chosen: a small computer takes some minutes
MOST_SAID: Final = 2000  # chosen: last bytes of a failed process's output that are kept

OnResult = Callable[[Job, Result], None]


class Worker:
    """One process at a time. ``on_result`` is called from the worker's thread; a job that was stopped has no result."""

    def __init__(self, directory: Path, on_result: OnResult) -> None:
        """``directory`` is the service's; jobs lie in a folder below it."""
        self.folder = directory / FOLDER
        self._on_result = on_result
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._thread: threading.Thread | None = None

    @property
    def is_busy(self) -> bool:
        with self._lock:
            return self._process is not None

    def start(self, job: Job, files: Mapping[str, bytes]) -> None:
        """Begin, with ``files`` in its folder; a job under way is stopped first. Raises OSError."""
        self.end()
        with self._lock:
            shutil.rmtree(self.folder, ignore_errors=True)
            self.folder.mkdir(parents=True)
            for name, content in files.items():
                (self.folder / name).write_bytes(content)
            to_file(job, self.folder / JOB)
            with (self.folder / SAID).open("wb") as said:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", MODULE, str(self.folder)],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=said,
                    env=_environment(),
                    start_new_session=True,
                )
            self._thread = threading.Thread(
                target=self._wait, args=(job, self._process), name="commissioning", daemon=True
            )
            self._thread.start()

    def end(self) -> None:
        """Stop the job under way and drop its result."""
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            process.wait()

    def _wait(self, job: Job, process: subprocess.Popen[bytes]) -> None:
        fault = None
        try:
            code = process.wait(WITHIN_S)
            fault = None if code == 0 else self._why(code)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            fault = f"the fit took longer than {WITHIN_S:.0f} s and was ended"
        with self._lock:
            if self._process is not process:
                return
            result = self._result(fault)
            self._process = None
        self._on_result(job, result)

    def _result(self, fault: str | None) -> Result:
        if fault is not None:
            return Result(fault=fault)
        try:
            return Result.model_validate_json((self.folder / RESULT).read_bytes())
        except (OSError, ValidationError) as broken:
            return Result(fault=f"the fit left no result that can be read: {broken}")

    def _why(self, code: int) -> str:
        if code == -signal.SIGKILL:
            return "the fit was killed: the machine has not enough memory for it, or somebody ended it"
        with contextlib.suppress(OSError):
            said = (self.folder / SAID).read_bytes()[-MOST_SAID:].decode("utf-8", "replace").strip()
            if said:
                return f"the fit failed: {said.splitlines()[-1]}"
        return f"the fit failed with code {code}"


def _environment() -> dict[str, str]:
    """Our environment, with one thread for linear algebra and our import path."""
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **threads, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
