"""The steps of commissioning a vehicle; each is on disk before the answer."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gateway.calibration.commissioning.answers import doubts_of
from gateway.calibration.kept.batch_file import KeptBatch
from gateway.calibration.kept.shelf import Shelf
from gateway.config.sections import CommissioningSection
from gateway.core.scheduler import Scheduler
from gateway.core.settings import BatchSettings
from gateway.errors import CampaignError, NoSisterError, RefusedError
from gateway.log import Event, OnEvent
from gateway.part import STOP_WITHIN_S, ServicePart
from gateway.service.commissioning.empty_drive import EmptyDrive, MakeWorker, ServiceVehicle
from gateway.service.commissioning.record import CommissioningStep, Confirmed, EmptyClaim, RecordStore, Underway
from gateway.service.commissioning.worker import Worker
from gateway.stated.commissioning import CommissioningState, MadeEnd
from gateway.stated.doubt import meant_by
from gateway.stated.facts import VehicleAnswers
from gateway.units import NS_PER_S


class Commissioning(ServicePart):
    """Thread-safe; a call may wait for the disk. A power cut does not undo an answered step."""

    NAME = "commissioning"

    def __init__(
        self,
        directory: Path,
        settings: CommissioningSection,
        batch: BatchSettings,
        shelf: Shelf,
        drives: Scheduler,
        vehicle: ServiceVehicle,
        *,
        on_event: OnEvent,
        clock_ns: Callable[[], int] = time.time_ns,
        make_worker: MakeWorker | None = None,
    ) -> None:
        """Resumes a commissioning under way. ``make_worker`` replaces the process that fits (tests)."""
        self._drives, self._vehicle = drives, vehicle
        self._window_s = batch.window_s
        self._book = RecordStore(directory, on_event, clock_ns)
        active = self._book.record.active
        self._started_with = active.id if active else None
        make_worker = make_worker or (lambda on_result: Worker(directory, on_result))
        self._drive = EmptyDrive(self._book, settings, batch, shelf, vehicle, make_worker)

    @property
    def book(self) -> RecordStore:
        return self._book

    @property
    def fault(self) -> str | None:
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

    def ignore_batches(self) -> None:
        """Ignore batches from now on. Never waits."""
        self._drive.is_over = True

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        """Stop; the next start resumes from the disk. May wait for a hanging disk."""
        self._drive.stop()

    def hear(self, kept: KeptBatch) -> None:
        """Called with every batch, provisional and rejected ones too; those that count are already on the shelf."""
        self._drive.hear(kept)

    def state(self) -> str:
        """JSON: a CommissioningState."""
        with self._book.lock:
            record, why_not = self._book.record, self._vehicle.why_not_allowed
            has_any = record.underway is not None or record.active is not None or self._vehicle.is_calibrated
            shown = {
                "is_allowed": why_not is None,
                "why_not": why_not,
                "is_offered": why_not is None and not has_any,
                "underway": None if record.underway is None else self._shown(record.underway),
                "is_pending": self.is_due,
                "active": record.active,
                "history": record.made[::-1],
            }
            return CommissioningState.model_validate(shown).model_dump_json()

    def begin(self, by: str, note: str | None) -> str:
        """Begin a commissioning. Raises RefusedError, as all later steps."""
        self._require_allowed()
        with self._book.lock:
            if self._book.record.underway is not None:
                raise RefusedError("already_begun", "a commissioning is under way: cancel it to start another")
            begun = Underway(begun_at=self._book.now(), by=by, note=note, signals_id=self._vehicle.signals_id)
            self._drive.forget()
            self._book.keep_underway(begun)
            self._book.tell(Event.COMMISSIONING, {"step": CommissioningStep.VEHICLE, "by": by})
            return self.state()

    def state_vehicle(self, answers: VehicleAnswers) -> str:
        """State the vehicle's figures. Unlikely answers raise doubts, which must be confirmed before the next step."""
        with self._book.lock:
            underway = self._underway(CommissioningStep.VEHICLE)
            self._require_usable(answers)
            doubts = doubts_of(answers, self._vehicle.sister)
            anew = {"vehicle": answers, "doubts": doubts, "confirmed": (), "learned": None, "fault": None}
            self._book.keep_underway(underway.model_copy(update=anew))
            self._drive.fit()
            return self.state()

    def confirm(self, by: str) -> str:
        """Confirm all open doubts: the stated facts are right. If a fit raised the doubt, its calibration is used."""
        with self._book.lock:
            underway = self._underway(CommissioningStep.VEHICLE)
            doubts = underway.open_doubts
            if not doubts:
                raise RefusedError("nothing_doubted", "there is no doubt to confirm")
            if underway.vehicle is not None:
                self._require_usable(underway.vehicle)
            kinds = tuple(dict.fromkeys(one.kind for one in doubts))
            confirmed = Confirmed(at=self._book.now(), by=by, kinds=kinds)
            is_of_drive = any(one.is_of_drive for one in doubts)
            change = {"confirmed": (*underway.confirmed, confirmed), "is_fit_asked": is_of_drive}
            self._book.keep_underway(underway.model_copy(update=change))
            self._book.tell(Event.COMMISSIONING_CONFIRMED, {"doubts": list(kinds), "by": by})
            self._drive.fit()
            return self.state()

    def is_empty(self, by: str, *, again: bool = False) -> str:
        """State that the vehicle is empty from now on; ``again`` discards the drive so far."""
        with self._book.lock:
            underway = self._underway(CommissioningStep.EMPTY)
            if self._drive.looked is not None and self._drive.looked.has_fault:
                raise RefusedError(
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
                self._book.keep_underway(underway.model_copy(update={"empty": claim} | _not_driven(underway)))
                self._book.tell(Event.COMMISSIONING, {"step": CommissioningStep.DRIVE, "by": by})
            return self.state()

    def fit_now(self, by: str) -> str:
        """Calibrate with the data so far, whether sufficient or not."""
        with self._book.lock:
            underway = self._underway(CommissioningStep.DRIVE)
            if not underway.batches:
                raise RefusedError(
                    "no_batch",
                    "no batch of the empty drive has counted yet: drive on until one has",
                )
            self._book.keep_underway(underway.model_copy(update={"is_fit_asked": True, "fault": None}))
            self._book.tell(Event.COMMISSIONING, {"step": CommissioningStep.FIT, "by": by})
            self._drive.fit()
            return self.state()

    def cancel(self, by: str) -> str:
        """Discard the commissioning under way; earlier calibrations stay."""
        with self._book.lock:
            self._underway()
            self._book.keep_underway(None)
            self._drive.forget()
            self._book.tell(Event.COMMISSIONING_CANCELLED, {"by": by})
            return self.state()

    def undo(self, by: str, *, to_factory: bool) -> str:
        """Withdraw the last calibration made here, or all; the one before it is used from the next drive on."""
        with self._book.lock:
            standing = tuple(one for one in self._book.record.made if one.ended is None)
            if not standing:
                raise RefusedError("nothing_made", "no calibration made on the vehicle is in use")
            chosen = standing if to_factory else standing[-1:]
            end = MadeEnd(at=self._book.now(), by=by, why="back_to_factory" if to_factory else "undone")
            self._book.save(self._book.record.ended(chosen, end))
            self._book.tell(Event.COMMISSIONING_UNDONE, {"calibration_ids": [one.id for one in chosen], "by": by})
            return self.state()

    def _shown(self, underway: Underway) -> dict[str, Any]:
        """The commissioning under way for the web."""
        window = self._window()
        return {
            **dict(underway),
            "step": underway.step,
            "inspection": self._drive.looked,
            "n_batches": len(underway.batches),
            "driven_s": self._drive.driven_s + (window[0] if window else 0.0),
            "next_window_s": window[1] if window else None,
            "doubts": underway.open_doubts,
            "confirmed": [one for one in underway.doubts if one not in underway.open_doubts],
            "is_fitting": self._drive.is_busy,
        }

    def _window(self) -> tuple[float, float] | None:
        """Seconds of the open window of the empty drive that count so far, and until the next window that counts.

        None between drives, and before the vehicle is called empty. A window that began before that does not count.
        """
        underway, window_ns, window_s = self._book.record.underway, self._drives.open_window_ns, self._window_s
        drive_start_ns = self._drives.drive_start_ns
        if underway is None or underway.empty is None or window_ns is None or drive_start_ns is None:
            return None
        open_s = (window_ns[1] - window_ns[0]) / NS_PER_S
        if underway.empty.covers(drive_start_ns, window_ns[0]):
            return open_s, max(0.0, window_s - open_s)
        return 0.0, max(0.0, 2.0 * window_s - open_s)

    def _underway(self, least: CommissioningStep = CommissioningStep.VEHICLE) -> Underway:
        """The commissioning under way. Raises RefusedError unless it has reached ``least``."""
        self._require_allowed()
        underway = self._book.record.underway
        if underway is None:
            raise RefusedError("not_begun", "no commissioning is under way: begin one")
        step, order = underway.step, list(CommissioningStep)
        if order.index(step) < order.index(least):
            raise RefusedError("wrong_step", f"{step} is still to be answered before {least}")
        if step is CommissioningStep.FIT:
            raise RefusedError("fitting", "the calibration is being made: wait for it, or cancel")
        return underway

    def _require_usable(self, answers: VehicleAnswers) -> None:
        """Raises RefusedError if the answers describe no vehicle, or surely not one of its sister's model."""
        try:
            self._vehicle.stated(answers)
        except NoSisterError as fault:
            raise RefusedError("not_its_sister", str(fault)) from None
        except CampaignError as fault:
            meant = meant_by(doubts_of(answers, self._vehicle.sister))
            raise RefusedError("vehicle_unusable", f"{fault}{meant}") from None

    def _require_allowed(self) -> None:
        if self._vehicle.why_not_allowed is not None:
            raise RefusedError("not_allowed", self._vehicle.why_not_allowed)


def _not_driven(underway: Underway) -> dict[str, Any]:
    """Fields that restart the drive, as before its first window."""
    doubts = underway.with_doubts_of_drive(())
    return {"batches": (), "open_batch": None, "learned": None, "fault": None, "doubts": doubts}
