"""Fits the vehicle's own calibration anew with its tickets, in a process of low priority, and puts it to use."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from gateway.calibration.commissioning import Job, Result
from gateway.calibration.kept import Shelf
from gateway.calibration.ticket_file import Ticket, TicketFit, TicketHistory
from gateway.core.vehicle import front_share_pct
from gateway.errors import CalibrationFileError, CommissioningRefusedError
from gateway.service.commissioning import Book, Jobs, Worker
from gateway.service.commissioning.jobs import EMPTY, BatchFile
from gateway.service.commissioning.record import Ended, Made
from gateway.service.tare_desk import SERVICE

MakeWorker = Callable[[Callable[[Job, Result], None]], Worker]
OnFit = Callable[[TicketFit], None]


class Refit:
    """One fit at a time. The book of commissionings keeps what comes of it, as it keeps what a commissioning made."""

    def __init__(self, book: Book, jobs: Jobs, shelf: Shelf, make_worker: MakeWorker, on_fit: OnFit) -> None:
        """``on_fit`` hears of each that ended, in the worker's thread, the book's lock held."""
        self._book, self._jobs, self._shelf = book, jobs, shelf
        self._worker = make_worker(self._on_result)
        self._on_fit = on_fit
        self._wanted: tuple[Made, tuple[Ticket, ...]] | None = None
        self._job: Job | None = None
        self._is_over = False

    @property
    def is_busy(self) -> bool:
        """Whether a fit is under way."""
        return self._worker.is_busy

    def base(self, history: TicketHistory) -> Made | None:
        """The commissioning whose calibration tickets improve; None where the calibration came by file."""
        refits = {fit.calibration_id for fit in history.fits if fit.ticket_ids}
        made = reversed(self._book.record.made)
        return next((one for one in made if one.ended is None and one.id not in refits), None)

    def begin(self, base: Made, tickets: tuple[Ticket, ...]) -> None:
        """Fit the empty drive with these; what is under way is ended first. Raises OSError."""
        if self._is_over:
            return
        there = {entry.id: entry for entry in self._shelf.entries()}

        def files(batch_ids: tuple[str, ...]) -> list[BatchFile]:
            kept = [there[one] for one in batch_ids if one in there]
            return [BatchFile(self._shelf.path(one), one.t_start_ns, one.t_end_ns) for one in kept]

        empty_share = front_share_pct(base.vehicle.stated, 0.0, None)
        drives = [(EMPTY, 0.0, empty_share, files(base.batches))]
        drives += [(one.id, one.payload_kg, one.front_share_pct or 0.0, files(one.batch_ids)) for one in tickets]
        whole = [drive for drive in drives if drive[3]]
        self._wanted = (base, tickets)
        if len(whole) < len(drives):
            lost = "batches that it needs are no longer kept: commission the vehicle again, or withdraw the ticket"
            self._told(TicketFit(**self._names(base, tickets), fault=lost))
            return
        self._job = self._jobs.refit(base.vehicle, base.line, whole)
        self._worker.start(self._job, {})

    def end(self) -> None:
        """Stop what is under way, and begin nothing more; it is begun again at the next start."""
        self._wanted, self._is_over = None, True
        self._worker.end()

    def leave_only(self, fit: TicketFit | None, history: TicketHistory, base: Made) -> bool:
        """Take every refit of ``base`` but this out of use; False where this is none that stands.

        Raises CommissioningRefusedError.
        """
        refits = {one.calibration_id for one in history.fits if one.ticket_ids and one.base_id == base.id}
        standing = tuple(one for one in self._book.record.made if one.ended is None and one.id in refits)
        wanted = [one for one in standing if fit is not None and one.id == fit.calibration_id]
        others = tuple(one for one in standing if one not in wanted)
        if others and (wanted or fit is None):
            end = Ended(at=self._book.now(), by=SERVICE, why="undone")
            self._book.save(self._book.record.ended(others, end))
        return bool(wanted)

    def _names(self, base: Made, tickets: tuple[Ticket, ...]) -> dict[str, Any]:
        return {"at": self._book.now(), "base_id": base.id, "ticket_ids": tuple(one.id for one in tickets)}

    def _on_result(self, job: Job, result: Result) -> None:
        with self._book.lock:
            if self._wanted is None or job is not self._job:  # another was begun while its end waited for the lock
                return
            base, tickets = self._wanted
            fault = result.fault or result.refusal
            try:
                if tickets and result.calibration is not None and result.calibration_id is not None:
                    self._take(base, tickets, result, result.calibration, result.calibration_id)
            except (CommissioningRefusedError, CalibrationFileError) as refusal:
                fault = str(refusal)
            fit = TicketFit(
                **self._names(base, tickets),
                calibration_id=None if fault else result.calibration_id,
                planned=result.planned,
                fault=fault,
            )
            self._told(fit)

    def _told(self, fit: TicketFit) -> None:
        self._wanted = None
        self._on_fit(fit)

    def _take(
        self, base: Made, tickets: tuple[Ticket, ...], result: Result, calibration: str, calibration_id: str
    ) -> None:
        """Keep it, to be used from the next drive on."""
        name = self._book.write_calibration(calibration, calibration_id)
        made = Made(
            id=calibration_id,
            file_name=name,
            at=self._book.now(),
            by=SERVICE,
            note="with one ticket" if len(tickets) == 1 else f"with {len(tickets)} tickets",
            line=base.line,
            vehicle=base.vehicle,
            batches=base.batches,
            learned=result.learned,
            warnings=result.warnings,
        )
        self._book.save(self._book.record.with_refit(made))
        with suppress(OSError):
            self._shelf.hold(made.file_name, made.batches)
