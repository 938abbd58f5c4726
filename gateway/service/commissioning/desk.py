"""The interface for commissioning a vehicle: every step is on disk before the answer."""

import time
from collections.abc import Callable
from typing import Any, Final, Protocol

from gateway.calibration.commissioning import doubts_of, vehicle_table
from gateway.calibration.kept import KeptBatch, Shelf
from gateway.core.vehicle import Vehicle as StatedVehicle
from gateway.errors import CampaignError, CommissioningRefusedError
from gateway.log import Event
from gateway.records import json_line
from gateway.service.commissioning.book import Book, OnEvent
from gateway.service.commissioning.drive import EmptyDrive, MakeWorker, Vehicle
from gateway.service.commissioning.jobs import Jobs
from gateway.service.commissioning.lines import Lines, require_alike
from gateway.service.commissioning.record import Confirmed, EmptyClaim, Ended, LineChoice, Source, Underway
from gateway.service.commissioning.steps import OpenWindow, Present, Step, lines_told, step_of, told
from gateway.service.commissioning.worker import Worker
from gateway.stated import VehicleAnswers
from gateway.stated.doubt import OF_THE_DRIVE, meant_by
from gateway.units import NS_PER_S

UPLOADED: Final = "uploaded"


class Drives(Protocol):
    """The position of the bus: the scheduler, as far as an empty drive needs it. Safe from any thread."""

    @property
    def drive_start_ns(self) -> int | None:
        """Of the drive under way."""
        ...

    @property
    def newest_ns(self) -> int | None:
        """The newest stamp of that drive."""
        ...

    @property
    def open_window_ns(self) -> tuple[int, int] | None:
        """Start of its open window, and the newest stamp in it."""
        ...


class Commissioning:
    """Thread-safe; a call may wait for the disk. No answer can be undone by a power cut."""

    def __init__(
        self,
        jobs: Jobs,
        lines: Lines,
        shelf: Shelf,
        drives: Drives,
        vehicle: Vehicle,
        *,
        on_event: OnEvent,
        clock_ns: Callable[[], int] = time.time_ns,
        make_worker: MakeWorker | None = None,
    ) -> None:
        """Reads a commissioning under way, to resume it. ``make_worker`` replaces the process that fits."""
        self._lines, self._drives, self._vehicle = lines, drives, vehicle
        self._window_s = jobs.batch.window_s
        self._book = Book(jobs.directory, on_event, clock_ns)
        active = self._book.record.active
        self._started_with = active.id if active else None
        self._drive = EmptyDrive(
            self._book, jobs, shelf, vehicle, make_worker or (lambda on_result: Worker(jobs.directory, on_result))
        )

    @property
    def book(self) -> Book:
        """The store of the calibrations made here."""
        return self._book

    @property
    def fault(self) -> str | None:
        """A fault of the record, for people."""
        return self._book.fault

    @property
    def is_due(self) -> bool:
        """Whether another calibration than at the start waits for the next drive."""
        active = self._book.record.active
        return (active.id if active else None) != self._started_with

    @property
    def wants_all(self) -> bool:
        """Whether batches that do not count are reported, too."""
        return self._book.record.underway is not None

    def start(self) -> None:
        """Resume the fit that a stop or a power cut interrupted."""
        with self._book.lock:
            self._drive.fit()

    def hear_no_more(self) -> None:
        """Batches from now on are ignored. Never waits."""
        self._drive.is_over = True

    def stop(self, _within_s: float = 0.0) -> None:
        """End; the next start resumes from the disk. May wait for a disk that hangs."""
        self._drive.stop()

    def hear(self, kept: KeptBatch) -> None:
        """Called with every batch, provisional and rejected ones too; those that count are already on the shelf."""
        self._drive.hear(kept)

    def told(self) -> str:
        """JSON: a CommissioningState."""
        with self._book.lock:
            return json_line(told(self._book.record, self._present()))

    def lines(self) -> str:
        """JSON: the LinesFound."""
        return json_line(lines_told(tuple(self._lines.found())))

    def upload(self, name: str, content: str, signature: str | None) -> str:
        """Keep a line's file -> the LinesFound with it. Raises CommissioningRefusedError."""
        self._require_allowed()
        with self._book.lock:
            self._lines.upload(name, content, signature)
        return self.lines()

    def begin(self, by: str, note: str | None) -> str:
        """Begin anew. Raises CommissioningRefusedError, as all that follow."""
        self._require_allowed()
        with self._book.lock:
            if self._book.record.underway is not None:
                raise CommissioningRefusedError(
                    "already_begun", "a commissioning is under way: cancel it to start another"
                )
            begun = Underway(begun_at=self._book.now(), by=by, note=note, signals_id=self._vehicle.signals_id)
            self._drive.forget()
            self._book.keep(begun)
            self._book.tell(Event.COMMISSIONING, {"step": Step.LINE, "by": by})
            return self.told()

    def choose_line(self, name: str | None, source: Source | None) -> str:
        """One of ``lines``; None for no line: the prior of any vehicle."""
        with self._book.lock:
            underway = self._underway()
            choice = LineChoice(name="")
            if name is not None:
                choice, content = self._lines.choose(name, source or UPLOADED)
                self._book.write(str(choice.copy_name), content)
            self._require_usable(choice, underway.vehicle)
            self._book.keep(underway.model_copy(update={"line": choice} | _anew(underway.vehicle, choice)))
            self._drive.fit()
            return self.told()

    def state_vehicle(self, answers: VehicleAnswers) -> str:
        """What was typed. Unlikely answers raise doubts, and no step follows until they are confirmed."""
        with self._book.lock:
            underway = self._underway(Step.VEHICLE)
            line = underway.line or LineChoice(name="")
            self._require_usable(line, answers)
            self._book.keep(underway.model_copy(update={"vehicle": answers} | _anew(answers, line)))
            self._drive.fit()
            return self.told()

    def confirm(self, by: str) -> str:
        """Every doubt that is open is answered: it is so all the same. Confirming a doubt from a fit puts that fit to
        use.
        """
        with self._book.lock:
            underway = self._underway(Step.VEHICLE)
            doubts = underway.open_doubts
            if not doubts:
                raise CommissioningRefusedError("nothing_doubted", "there is no doubt to confirm")
            if underway.line is not None and underway.vehicle is not None:
                require_alike(self._book.directory, underway.line, self._table(underway.vehicle, underway.line))
            kinds = tuple(dict.fromkeys(one.kind for one in doubts))
            confirmed = Confirmed(at=self._book.now(), by=by, kinds=kinds)
            is_of_drive = any(kind in OF_THE_DRIVE for kind in kinds)
            change = {"confirmed": (*underway.confirmed, confirmed), "is_fit_asked": is_of_drive}
            self._book.keep(underway.model_copy(update=change))
            self._book.tell(Event.COMMISSIONING_CONFIRMED, {"doubts": list(kinds), "by": by})
            self._drive.fit()
            return self.told()

    def is_empty(self, by: str, *, again: bool = False) -> str:
        """From now on it is driven empty; ``again`` discards the drive so far."""
        with self._book.lock:
            underway = self._underway(Step.EMPTY)
            if self._drive.looked is not None and self._drive.looked.has_fault:
                raise CommissioningRefusedError(
                    "inspection_fault",
                    "the first minutes show a fault: " + "; ".join(
                        f"{one.text}: {one.advice}" for one in self._drive.looked.findings if one.severity == "fault"
                    ),
                )  # fmt: skip
            claim = EmptyClaim(
                at=self._book.now(), by=by, drive_start_ns=self._drives.drive_start_ns, newest_ns=self._drives.newest_ns
            )
            if underway.empty is None or again:
                if underway.empty is not None:
                    self._drive.forget()
                self._book.keep(underway.model_copy(update={"empty": claim} | _not_driven(underway)))
                self._book.tell(Event.COMMISSIONING, {"step": Step.DRIVE, "by": by})
            return self.told()

    def fit_now(self, by: str) -> str:
        """Calibrate with the data so far, whether sufficient or not."""
        with self._book.lock:
            underway = self._underway(Step.DRIVE)
            if not underway.batches:
                raise CommissioningRefusedError(
                    "no_batch",
                    "no batch of the empty drive has counted yet: drive on until one has",
                )
            self._book.keep(underway.model_copy(update={"is_fit_asked": True, "fault": None}))
            self._book.tell(Event.COMMISSIONING, {"step": Step.FIT, "by": by})
            self._drive.fit()
            return self.told()

    def cancel(self, by: str) -> str:
        """Discard the commissioning under way; earlier calibrations stay."""
        with self._book.lock:
            self._underway()
            self._book.keep(None)
            self._drive.forget()
            self._book.tell(Event.COMMISSIONING_CANCELLED, {"by": by})
            return self.told()

    def undo(self, by: str, *, to_factory: bool) -> str:
        """Take the last calibration made here out of use, or all: the one before it counts from the next drive on."""
        with self._book.lock:
            standing = tuple(one for one in self._book.record.made if one.ended is None)
            if not standing:
                raise CommissioningRefusedError("nothing_made", "no calibration made on the vehicle is in use")
            chosen = standing if to_factory else standing[-1:]
            end = Ended(at=self._book.now(), by=by, why="back_to_factory" if to_factory else "undone")
            self._book.save(self._book.record.ended(chosen, end))
            self._book.tell(Event.COMMISSIONING_UNDONE, {"calibration_ids": [one.id for one in chosen], "by": by})
            return self.told()

    def _window(self) -> OpenWindow | None:
        """Of the empty drive: a window that began before the statement does not count, the next one does."""
        underway, window_ns, window_s = self._book.record.underway, self._drives.open_window_ns, self._window_s
        drive_start_ns = self._drives.drive_start_ns
        if underway is None or underway.empty is None or window_ns is None or drive_start_ns is None:
            return None
        open_s = (window_ns[1] - window_ns[0]) / NS_PER_S
        if underway.empty.covers(drive_start_ns, window_ns[0]):
            return OpenWindow(open_s, max(0.0, window_s - open_s))
        return OpenWindow(0.0, max(0.0, 2.0 * window_s - open_s))

    def _present(self) -> Present:
        return Present(
            window=self._window(),
            why_not_allowed=self._vehicle.why_not_allowed,
            is_calibrated=self._vehicle.is_calibrated,
            is_busy=self._drive.is_busy,
            driven_s=self._drive.driven_s,
            looked=self._drive.looked,
            started_with=self._started_with,
        )

    def _underway(self, least: Step = Step.LINE) -> Underway:
        """Raises CommissioningRefusedError unless one is under way and has reached ``least``."""
        self._require_allowed()
        underway = self._book.record.underway
        if underway is None:
            raise CommissioningRefusedError("not_begun", "no commissioning is under way: begin one")
        step, order = step_of(underway), list(Step)
        if order.index(step) < order.index(least):
            raise CommissioningRefusedError("wrong_step", f"{step} is still to be answered before {least}")
        if step is Step.FIT:
            raise CommissioningRefusedError("fitting", "the calibration is being made: wait for it, or cancel")
        return underway

    def _require_usable(self, line: LineChoice, answers: VehicleAnswers | None) -> None:
        """Raises CommissioningRefusedError if no vehicle follows, or one that is surely not of the line."""
        if answers is not None:
            table = self._table(answers, line)
            if not doubts_of(answers, line.facts):
                require_alike(self._book.directory, line, table)

    def _table(self, answers: VehicleAnswers, line: LineChoice) -> StatedVehicle:
        try:
            return vehicle_table(answers, self._vehicle.name)
        except CampaignError as fault:
            meant = meant_by(doubts_of(answers, line.facts))
            raise CommissioningRefusedError("vehicle_unusable", f"{fault}{meant}") from None

    def _require_allowed(self) -> None:
        if self._vehicle.why_not_allowed is not None:
            raise CommissioningRefusedError("not_allowed", self._vehicle.why_not_allowed)


def _anew(answers: VehicleAnswers | None, line: LineChoice) -> dict[str, Any]:
    """What a changed answer resets: its doubts, and the result of the drive so far."""
    doubts = () if answers is None else doubts_of(answers, line.facts)
    return {"doubts": doubts, "confirmed": (), "learned": None, "fault": None}


def _not_driven(underway: Underway) -> dict[str, Any]:
    """As before the first window."""
    doubts = underway.with_doubts_of_drive(())
    return {"batches": (), "open_batch": None, "learned": None, "fault": None, "doubts": doubts}
