"""A thread that keeps drives, starts fits and takes what they found."""

import hashlib
import json
import logging
import queue
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final, NamedTuple

from gateway.calibration.assigned import Piece, assign, moments
from gateway.calibration.kept import kept_batch_of
from gateway.calibration.learning.job import LearnJob, LearnResult
from gateway.calibration.learning.spans import can_teach, spans_of, teaching_most
from gateway.config.sections import LearningSection
from gateway.core.batch import Traits
from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationFileError, RefusedError
from gateway.log import Event, log_event
from gateway.part import STOP_WITHIN_S, BackOff, ThreadPart
from gateway.records import Batch, Motion
from gateway.service.learner.kept_drives import FOLDER, DriveFiles, Window
from gateway.service.learner.learning_file import MOST_VERSIONS, Book, LearningRecord, LearntVersion
from gateway.service.learner.learnt import Learnt
from gateway.service.learner.said import StatedLoads
from gateway.service.learner.van import LearnerVehicle, StatedVan
from gateway.service.learner.worker import OnResult, Worker
from gateway.stated.statement import StatementRecord
from gateway.units import BYTES_PER_MB
from gateway.words import counted

OnEvent = Callable[[str, Mapping[str, Any]], None]
MakeWorker = Callable[[OnResult], Worker]

MOST_WAITING: Final = 4  # chosen: windows in the queue; each has some megabytes of rows, one comes every few minutes
TURN_S: Final = 1.0  # chosen: interval between looks whether there is something to learn
FIRST_RETRY_S, LAST_RETRY_S = 60.0, 3600.0  # chosen: after a process that was ended from outside


class _Handed(NamedTuple):
    batch: Batch
    rows: Motion


class Learner(ThreadPart):
    """Keeps statements and drives, and learns the vehicle from them. Thread-safe; a call may wait for the disk.

    What is answered is on disk. A stop or a power cut during a fit loses nothing: the next start fits anew.
    """

    NAME = "learner"

    def __init__(
        self,
        directory: Path,
        settings: LearningSection,
        batch: BatchSettings,
        drives: Scheduler,
        traits: Traits,
        vehicle: LearnerVehicle,
        *,
        on_event: OnEvent,
        clock_ns: Callable[[], int] = time.time_ns,
        make_worker: MakeWorker | None = None,
    ) -> None:
        """``make_worker`` replaces the process that learns (tests)."""
        super().__init__("learner")
        self._settings, self._batch, self._scheduler = settings, batch, drives
        self._traits = traits
        self._book = Book(directory, on_event, clock_ns)
        self._files = DriveFiles(directory / FOLDER, round(settings.size_mb * BYTES_PER_MB))
        self.van = StatedVan(self._book, vehicle)
        self.loads = StatedLoads(self._book, self._files, self.van)
        self._worker = (make_worker or (lambda on_result: Worker(directory, on_result)))(self._on_result)
        self.learnt = Learnt(
            self._book,
            self._files,
            self.van,
            self.loads,
            drives,
            self._worker,
            fault=lambda: self.fault,
            n_lost=lambda: self.n_lost,
        )
        self._waiting: queue.Queue[_Handed | None] = queue.Queue(MOST_WAITING)
        self._retry = BackOff(FIRST_RETRY_S, LAST_RETRY_S)
        self._not_before_s = 0.0
        self._disk_fault: str | None = None
        self._looked: tuple[LearningRecord, tuple[Window, ...], int | None] | None = None  # nothing to learn there
        self.n_lost = 0  # windows that should have been kept and were not

    # -- the pipeline, and the thread --

    def take(self, batch: Batch, rows: Motion) -> None:
        """Queue a window, from the pipeline's thread; if the queue is full it is lost and counted."""
        if not can_teach(batch, self._batch):
            return
        try:
            self._waiting.put_nowait(_Handed(batch, rows))
        except queue.Full:
            self._lose(f"{MOST_WAITING} windows wait for the disk already")

    def flush(self) -> None:
        """Wait until every queued window is stored or lost."""
        self._waiting.join()

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        """Store the queued windows, and end the process that learns; the next start begins it anew."""
        self._worker.end()
        end_s = time.monotonic() + within_s
        self._stopping.set()
        with suppress(queue.Full):
            self._waiting.put(None, timeout=within_s)
        super().stop(max(0.0, end_s - time.monotonic()))

    def _work(self) -> None:
        while True:
            try:
                handed = self._waiting.get(timeout=TURN_S)
            except queue.Empty:
                self._learn_if_due()
                continue
            try:
                if handed is None:
                    return
                self._keep(handed)
            except Exception as failure:  # noqa: BLE001 - a failure with one window must not stop the thread
                self._lose(repr(failure))
            finally:
                self._waiting.task_done()

    def _keep(self, handed: _Handed) -> None:
        kept = kept_batch_of(handed.batch, handed.rows, self._traits)
        try:
            self._files.add(kept, self._is_stated)
        except OSError as refusal:
            self._lose(str(refusal))
        else:
            self._disk_fault = None

    def _is_stated(self, begin_ns: int, end_ns: int) -> bool:
        """Whether a statement that stands may be about this time."""
        pieces = [Piece(begin_ns, end_ns, 1)]
        vehicle = self.van.known
        return vehicle is not None and bool(assign(self._book.record.records, pieces, vehicle).holding[0])

    def _lose(self, why: str) -> None:
        """A window is lost."""
        self.n_lost += 1
        self._fail(f"drives cannot be kept to learn from: {why}")

    def _fail(self, why: str) -> None:
        if self._disk_fault is None:  # log it once until it works again
            log_event(Event.DRIVE_NOT_KEPT, level=logging.WARNING, fault=why)
        self._disk_fault = f"{why}; weighing goes on"

    @property
    def fault(self) -> str | None:
        """Faults of the record, of its vehicle, and of the disk."""
        return "; ".join(filter(None, (super().fault, self._book.fault, self.van.fault, self._disk_fault))) or None

    @property
    def is_busy(self) -> bool:
        """Whether a fit is under way."""
        return self._worker.is_busy

    # -- learning --

    def _learn_if_due(self) -> None:
        """Start a fit if something new teaches; after a process that was ended, only after a pause."""
        with self._book.lock:
            if self._stopping.is_set() or self._worker.is_busy or time.monotonic() < self._not_before_s:
                return
            looked = (self._book.record, self._files.windows(), self._scheduler.drive_start_ns)
            if self._looked is not None and self._looked[0] is looked[0] and self._looked[1:] == looked[1:]:
                return
            job, last = self._job(), self._book.record.last
            if job is None or (last is not None and last.key == job.key):
                self._looked = looked
                return
            try:
                self._worker.start(job)
            except OSError as refusal:
                self._fail(f"nothing can be learnt: {refusal}")

    def _job(self) -> LearnJob | None:
        """What there is to learn from; None if that is nothing yet."""
        record = self._book.record
        vehicle = self.van.learnt
        windows = self._finished
        if vehicle is None or not windows or self.van.given.why_not_allowed is not None:
            return None
        active = record.active
        before = self.van.given.by_file if active is None else self._book.directory / active.file_name
        settings = asdict(self._batch)
        return LearnJob(
            key=self._key(vehicle, windows, record.records),
            vehicle=vehicle,
            windows=tuple(self._files.path(one) for one in windows),
            records=tuple(record.records),
            settings=settings,
            laden=tuple(one.span for one in record.laden),
            like=self.van.named.like,
            before=before,
            is_file_before=active is None and before is not None,
            most_memory_mb=self._settings.memory_mb,
        )

    @property
    def _finished(self) -> list[Window]:
        """The windows of drives that are over."""
        under_way = self._scheduler.drive_start_ns
        return [one for one in self._files.windows() if one.drive_start_ns != under_way]

    def _key(self, vehicle: Vehicle, windows: Sequence[Window], records: Sequence[StatementRecord]) -> str:
        """Of what a fit would learn from: the vehicle, the pieces that teach most, and the statements that hold."""
        pieces = spans_of([one.span for one in windows], moments(records))
        holding = assign(records, pieces, vehicle).holding
        driven_s = (sum(_common_s(one, piece) for one in windows) for piece in pieces)
        best = teaching_most(
            [(s, piece.end_ns, bool(found)) for s, piece, found in zip(driven_s, pieces, holding, strict=True)]
        )
        held = sorted({i for piece in best for i in holding[piece]})
        content = {
            "vehicle": asdict(vehicle),
            "like": str(self.van.named.like),
            "signals": self.van.given.signals_id,
            "pieces": [(pieces[i].begin_ns, pieces[i].end_ns) for i in best],
            "records": [records[i].model_dump(mode="json", by_alias=True) for i in held],
        }
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def _on_result(self, job: LearnJob, result: LearnResult) -> None:
        """Take the result of a fit, in the worker's thread."""
        with self._book.lock:
            if self._stopping.is_set():
                return
            for name in result.damaged:
                self._files.remove(name)
            if result.was_killed:
                self._not_before_s = time.monotonic() + self._retry.next_s()
                self._book.tell(Event.NOT_LEARNT, {"fault": result.fault}, level=logging.WARNING)
                self._disk_fault = result.fault
                return
            self._retry.reset()
            self._disk_fault = None
            try:
                self._take_result(job, result)
            except (OSError, RefusedError, CalibrationFileError) as refusal:
                self._fail(f"what was learnt cannot be stored: {refusal}")

    def _take_result(self, job: LearnJob, result: LearnResult) -> None:
        record = self._book.record
        last = result.model_copy(update={"key": job.key, "calibration": None})
        changed = record.model_copy(update={"last": last})
        if result.calibration is None or result.calibration_id is None:
            self._book.save(changed)
            self._book.tell(Event.NOT_LEARNT, {"fault": result.fault}, level=logging.WARNING)
            return
        name = self._book.write_calibration(result.calibration, result.calibration_id)
        known = [one for one in record.versions if one.id != result.calibration_id]
        version = self._version(result, name, record)
        versions = (*known, version)[-MOST_VERSIONS:]
        self._book.save(changed.model_copy(update={"versions": versions}))
        self._book.tell(
            Event.LEARNT,
            {
                "calibration_id": version.id,
                "text": version.text,
                "worse": version.worse,
                "seconds": round(result.seconds, 1),
                "most_memory_mb": round(result.most_memory_mb, 1),
            },
        )
        with suppress(OSError):
            self._book.forget_others()

    def _version(self, result: LearnResult, name: str, record: LearningRecord) -> LearntVersion:
        used = [one for one in result.statements if one["state"] in ("used", "weak")]
        now_kg, active = result.learning.get("plus_minus_kg"), record.active
        since = f"{counted(len(result.drives), 'drive')} and {counted(len(used), 'statement')}"
        became = "" if now_kg is None else f": ± {now_kg:.0f} kg"
        if active is not None and active.plus_minus_kg is not None and now_kg is not None:
            became = f": ± {active.plus_minus_kg:.0f} kg became ± {now_kg:.0f} kg"
        return LearntVersion(
            id=result.calibration_id or "",
            file_name=name,
            at=self._book.now(),
            text=since + became,
            plus_minus_kg=now_kg,
            n_drives=len(result.drives),
            n_statements=len(used),
            worse=result.worse,
        )


def _common_s(window: Window, piece: Piece) -> float:
    """Driving of a window that lies in a piece, as if it were spread evenly."""
    common_ns = min(window.t_end_ns, piece.end_ns) - max(window.t_start_ns, piece.begin_ns)
    return window.usable_s * max(0, common_ns) / (window.t_end_ns - window.t_start_ns)
