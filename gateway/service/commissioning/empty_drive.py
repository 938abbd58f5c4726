"""The empty drive: batches are counted, inspected and fitted, until the accuracy is sufficient."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from gateway.calibration.commissioning.answers import doubts_of, vehicle_table
from gateway.calibration.commissioning.job import Drive, Job, Result
from gateway.calibration.kept.batch_file import KeptBatch, packed
from gateway.calibration.kept.shelf import Shelf
from gateway.calibration.sister import require_alike
from gateway.config.sections import CommissioningSection
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.errors import CalibrationFileError, RefusedError
from gateway.log import Event
from gateway.records import Why
from gateway.service.commissioning.record import MADE, MadeCalibration, RecordStore, Underway
from gateway.service.commissioning.worker import Worker
from gateway.stated.commissioning import FindingTold
from gateway.stated.facts import VehicleAnswers

COMMAND: Final = "commissioned on the vehicle"
EMPTY: Final = "empty drive"
OWNER: Final = "commissioning"  # of the batches that the shelf must not give away
LEAST_BATCHES: Final = 2  # chosen: a single batch may be an outlier; a requested fit may use one
LOOKED_AT: Final = "looked-at.batch"

MakeWorker = Callable[[Callable[[Job, Result], None]], Worker]


@dataclass(frozen=True, slots=True)
class ServiceVehicle:
    """The vehicle as the service knows it, and whether the service may make a calibration.

    ``like`` is the calibration file of its sister, ``sister`` the vehicle in it; None without one.
    """

    name: str
    signals_id: str
    is_calibrated: bool
    why_not_allowed: str | None = None
    is_name_fixed: bool = False
    like: Path | None = None
    sister: Vehicle | None = None

    def stated(self, answers: VehicleAnswers) -> Vehicle:
        """The vehicle that follows from a fitter's answers. Raises CampaignError, NoSisterError."""
        table = vehicle_table(answers, self.name, self.sister)
        if self.sister is not None and not doubts_of(answers, self.sister):
            require_alike(self.sister, table)
        return replace(table, name=self.name) if self.is_name_fixed else table


@dataclass(frozen=True, slots=True)
class LastInspection:
    """The last findings of inspection, and the seconds of driving they cover."""

    findings: tuple[FindingTold, ...]
    seconds: float

    @property
    def has_fault(self) -> bool:
        """Whether a finding must be mended first."""
        return any(one.severity == "fault" for one in self.findings)


class EmptyDrive:
    """Receives every batch, and the results of the process that fits. Thread-safe by the store's lock."""

    def __init__(
        self,
        book: RecordStore,
        settings: CommissioningSection,
        batch: BatchSettings,
        shelf: Shelf,
        vehicle: ServiceVehicle,
        make_worker: MakeWorker,
    ) -> None:
        """Resumes a commissioning under way."""
        self.looked: LastInspection | None = None
        self._book, self._settings, self._batch, self._shelf, self._vehicle = book, settings, batch, shelf, vehicle
        self._worker = make_worker(self._on_result)
        self._job: Job | None = None
        self.is_over = False
        self._resume()

    @property
    def is_busy(self) -> bool:
        """Whether a fit or an inspection is under way."""
        return self._worker.is_busy

    @property
    def driven_s(self) -> float:
        """Seconds of the complete windows that count."""
        underway = self._book.record.underway
        if underway is None:
            return 0.0
        mine = set(underway.batches)
        return sum(entry.duration_s for entry in self._shelf.entries() if entry.id in mine)

    def stop(self) -> None:
        """Ignore later batches and end the process that fits."""
        self.is_over = True
        self._worker.end()

    def forget(self) -> None:
        """Drop the drive at the end of a commissioning."""
        self._worker.end()
        self._job = self.looked = None
        with suppress(OSError):
            self._shelf.let_go(OWNER)

    def hear(self, kept: KeptBatch) -> None:
        """Called with every batch, provisional and rejected ones too; those that count are already on the shelf."""
        with self._book.lock:
            underway = self._book.record.underway
            if self.is_over or underway is None or underway.vehicle is None:
                return
            batch = kept.batch
            is_of_drive = underway.empty is not None and underway.empty.covers(batch.drive_start_ns, batch.t_start_ns)
            try:
                has_grown = is_of_drive and self._remember(underway, kept)
            except (OSError, RefusedError) as refusal:
                self._book.cannot_store(refusal)
                return
            if has_grown:
                self.fit()
            elif (
                not self._worker.is_busy and Why.TOO_SHORT not in batch.rejected
            ):  # where a drive ended: no fault of it
                place = self._worker.folder / LOOKED_AT
                self._start(underway, {place: kept.batch.duration_s}, {LOOKED_AT: packed(kept)}, is_fit=False)

    def _resume(self) -> None:
        """Resume after a start: close the open window; drop batches that are gone or have another signal map."""
        underway = self._book.record.underway
        if underway is None:
            return
        there = {entry.id for entry in self._shelf.entries()}
        found = [*underway.batches, *([underway.open_batch] if underway.open_batch else [])]
        change: dict[str, Any] = {"batches": tuple(one for one in found if one in there), "open_batch": None}
        if underway.signals_id != self._vehicle.signals_id:
            change |= {"batches": (), "empty": None, "learned": None, "is_fit_asked": False}
            change |= {"signals_id": self._vehicle.signals_id, "fault": "the signal map was changed: drive again"}
        elif underway.empty is not None:  # whatever drive was under way is over
            change["empty"] = underway.empty.model_copy(update={"drive_start_ns": None, "newest_ns": None})
        try:
            self._book.keep_underway(underway.model_copy(update=change))
        except RefusedError as refusal:
            self._book.cannot_store(refusal)

    def _remember(self, underway: Underway, kept: KeptBatch) -> bool:
        """Add a batch to the drive; True if one counted. Raises OSError, RefusedError."""
        batch, before = kept.batch, underway.open_batch
        change: dict[str, Any] = {"open_batch": None}
        if batch.is_provisional and not batch.rejected:
            self._shelf.add(kept)
            change["open_batch"] = kept.id
        elif batch.is_provisional:
            return False
        elif not batch.rejected and kept.id not in underway.batches:
            change["batches"] = (*underway.batches, kept.id)
        now = underway.model_copy(update=change)
        if now != underway:
            self._book.keep_underway(now)
            self._shelf.hold(OWNER, [*now.batches, *([now.open_batch] if now.open_batch else [])])
        if before is not None and before != now.open_batch:
            self._shelf.remove(before)
        return "batches" in change

    def fit(self) -> None:
        """Start the fit of the whole drive, if there are batches."""
        underway = self._book.record.underway
        if underway is None or underway.is_vehicle_doubted:
            return
        there = {entry.id: entry for entry in self._shelf.entries()}
        kept = [there[one] for one in underway.batches if one in there]
        if kept:
            self._start(underway, {self._shelf.path(one): one.duration_s for one in kept}, {}, is_fit=True)

    def _start(
        self, underway: Underway, durations_s: Mapping[Path, float], files: Mapping[str, bytes], *, is_fit: bool
    ) -> None:
        """Start a job on batches, by path. Its window is at most as long as the longest of them."""
        if self.is_over or underway.vehicle is None:
            return
        vehicle = self._vehicle.stated(underway.vehicle)
        window_s = min(self._batch.window_s, max(durations_s.values()))
        share_pct = front_share_pct(vehicle, 0.0, None)
        self._job = Job(
            vehicle=vehicle,
            drives=(Drive(name=EMPTY, front_share_pct=share_pct, batches=tuple(durations_s)),),
            settings=asdict(self._batch) | {"window_s": window_s},
            like=self._vehicle.like,
            is_fit=is_fit,
            goal_std_share=self._settings.goal_pct / 100.0,
            most_memory_mb=self._settings.memory_mb,
            command=COMMAND,
        )
        try:
            self._worker.start(self._job, files)
        except OSError as refusal:
            self._book.cannot_store(refusal)

    def _on_result(self, job: Job, result: Result) -> None:
        """Process the result of a job, in the worker's thread."""
        with self._book.lock:
            underway = self._book.record.underway
            if self.is_over or underway is None or underway.vehicle is None or job is not self._job:
                return
            if result.fault is None:
                self.looked = LastInspection(
                    result.findings, float(job.settings["window_s"]) * len(job.drives[0].batches)
                )
            if not job.is_fit:
                return
            try:
                self._take(underway, underway.vehicle, result)
            except (RefusedError, CalibrationFileError) as refusal:
                self._book.cannot_store(refusal)

    def _take(self, underway: Underway, vehicle: VehicleAnswers, result: Result) -> None:
        """Use a fit if it is accurate enough or was requested; else the drive continues."""
        has_enough = result.learned is not None and result.learned.is_enough
        is_wanted = underway.is_fit_asked or (has_enough and len(underway.batches) >= LEAST_BATCHES)
        doubts = underway.with_doubts_of_drive(result.doubts)
        doubted = underway.model_copy(update={"doubts": doubts})
        if result.calibration is None or result.calibration_id is None or not is_wanted or doubted.open_doubts:
            fault = result.fault or result.refusal
            change = {"learned": result.learned, "fault": fault, "is_fit_asked": False}
            self._book.keep_underway(doubted.model_copy(update=change))
            return
        name = self._book.write_calibration(result.calibration, result.calibration_id)
        made = MadeCalibration(
            id=result.calibration_id,
            file_name=name,
            at=self._book.now(),
            by=underway.by,
            note=underway.note,
            sister=self._vehicle.sister.name if self._vehicle.sister else None,
            vehicle=self._vehicle.stated(vehicle),
            batches=underway.batches,
            learned=result.learned,
            warnings=(*result.warnings, *(one.sentence for one in doubts if one not in result.doubts)),
        )
        self._book.save(self._book.record.with_made(made))
        with suppress(OSError):
            self._shelf.hold(made.file_name, made.batches)
            self._shelf.let_go(OWNER)
            for owner in self._shelf.owners - {one.file_name for one in self._book.record.made}:
                if owner.startswith(MADE):  # others hold batches too
                    self._shelf.let_go(owner)
            self._book.forget_others()
        self._book.tell(Event.COMMISSIONED, {"calibration_id": made.id, "by": made.by, "n_batches": len(made.batches)})
