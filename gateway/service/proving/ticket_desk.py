"""Where tickets are handed in: known weights that the vehicle's own calibration learns from, with history and undo."""

import logging
from contextlib import suppress
from typing import Any, Final

from gateway.calibration.kept import Shelf
from gateway.calibration.known_weight import WeightRefusal, known_weight_of
from gateway.calibration.ticket_file import FILE_NAME, Ticket, TicketFit, TicketHistory, Withdrawal
from gateway.core.weights import NOT_CALIBRATED
from gateway.errors import CommissioningRefusedError, WeightRefusedError
from gateway.log import Event, log_event, tell_event
from gateway.records import iso_utc, json_line, ns_of
from gateway.service.commissioning import Book, Jobs
from gateway.service.commissioning.record import Made
from gateway.service.proving.epochs import Ask, WeighedEpoch, epoch_at, epochs_around
from gateway.service.proving.history_file import HistoryFile
from gateway.service.proving.refit import MakeWorker, Refit
from gateway.service.tare_desk import OnEvent, Subject
from gateway.stated_weight import StatedWeight

OWNER: Final = "tickets"  # of the batches that the shelf must not give away
BY_FILE: Final = (
    "tickets improve a calibration that was made on the vehicle (commissioning); where it came by file, the loads "
    "belong into a campaign at a desk"
)


class TicketDesk:
    """Thread-safe by the book's lock; a call may wait for the disk. A ticket is on disk before it is answered."""

    def __init__(
        self,
        book: Book,
        jobs: Jobs,
        shelf: Shelf,
        subject: Subject,
        ask: Ask,
        *,
        on_event: OnEvent,
        make_worker: MakeWorker,
        why_not_allowed: str | None = None,
    ) -> None:
        """``ask`` is the store's question after estimates; ``why_not_allowed`` as for commissioning."""
        self._book, self._shelf, self._subject, self._ask = book, shelf, subject, ask
        self._on_event = on_event
        self._why_not_allowed = why_not_allowed
        self._file = HistoryFile(book.directory / FILE_NAME, TicketHistory())
        self._refit = Refit(book, jobs, shelf, make_worker, self._on_fit)

    @property
    def fault(self) -> str | None:
        """What is wrong with the file, for people."""
        return self._file.fault

    def start(self) -> None:
        """Go on with a fit that a stop or a power cut interrupted."""
        with self._book.lock:
            self._fit_if_wanted(has_changed=False)

    def stop(self) -> None:
        """A fit that is under way is begun again at the next start."""
        with self._book.lock:
            self._refit.end()

    def told(self) -> str:
        """JSON: a TicketState."""
        with self._book.lock:
            return json_line(self._state())

    def add(self, by: str, note: str | None, stated: StatedWeight) -> str:
        """Attach a known weight to the load of its time, and learn from it -> the Ticket. Raises WeightRefusedError."""
        base = self._base()
        at_ns = ns_of(stated.at)
        epoch = epoch_at(epochs_around(self._ask, at_ns), at_ns, stated.drive)
        calibrated = self._subject.calibrated
        unsprung = NOT_CALIBRATED if calibrated is None else calibrated.unsprung
        known = known_weight_of(stated, base.vehicle.stated, unsprung)
        with self._book.lock:
            ticket = Ticket(
                id="",
                at=self._book.now(),
                by=by,
                note=note,
                base_id=base.id,
                stated=stated,
                t_start=iso_utc(epoch.t_start_ns),
                t_end=iso_utc(epoch.t_end_ns),
                batch_ids=self._kept(epoch),
                payload_kg=known.payload_kg,
                front_share_pct=known.front_share_pct,
            )
            ticket = ticket.model_copy(update={"id": ticket.content_id()})
            self._require_new(ticket, base)
            self._keep(self._file.history.with_ticket(ticket), base)
            tell_event(
                Event.TICKET_ADDED, {"ticket_id": ticket.id, "by": by, "payload_kg": ticket.payload_kg}, self._on_event
            )
            self._fit_if_wanted()
            return json_line(ticket.model_dump(mode="json"))

    def withdraw(self, by: str, ticket_id: str) -> str:
        """Take a ticket back: the calibration is made anew without it -> the TicketState. Raises WeightRefusedError."""
        with self._book.lock:
            found = next((one for one in self._file.history.tickets if one.id == ticket_id), None)
            if found is None or found.withdrawn is not None:
                raise WeightRefusedError(WeightRefusal.NO_SUCH_TICKET, "there is no such ticket that still stands")
            end = Withdrawal(at=self._book.now(), by=by)
            self._keep(self._file.history.withdrawn(ticket_id, end), self._refit.base(self._file.history))
            tell_event(Event.TICKET_WITHDRAWN, {"ticket_id": ticket_id, "by": by}, self._on_event)
            self._fit_if_wanted()
            return json_line(self._state())

    def _base(self) -> Made:
        if self._why_not_allowed is not None:
            raise WeightRefusedError(WeightRefusal.NOT_COMMISSIONED, self._why_not_allowed)
        with self._book.lock:
            base = self._refit.base(self._file.history)
        if base is None:
            raise WeightRefusedError(WeightRefusal.NOT_COMMISSIONED, BY_FILE)
        return base

    def _kept(self, epoch: WeighedEpoch) -> tuple[str, ...]:
        """The batches of that load that are still there, rejected by an estimator or not."""
        entries = self._shelf.entries()
        found = tuple(
            one.id for one in entries if epoch.t_start_ns <= one.t_start_ns and one.t_end_ns <= epoch.t_end_ns
        )
        if not found:
            raise WeightRefusedError(
                WeightRefusal.NOT_KEPT,
                f"the batches of {epoch.told()} are no longer kept ([keep] batches, size_mb): hand tickets in sooner",
            )
        return found

    def _require_new(self, ticket: Ticket, base: Made) -> None:
        standing = (one for one in self._file.history.tickets if one.withdrawn is None and one.base_id == base.id)
        other = next((one for one in standing if set(one.batch_ids) & set(ticket.batch_ids)), None)
        if other is not None:
            raise WeightRefusedError(
                WeightRefusal.TOO_MANY,
                f"that load has a ticket already ({other.id[:19]}, {other.payload_kg:.0f} kg): withdraw it first",
            )

    def _keep(self, history: TicketHistory, base: Made | None) -> None:
        """On disk, its batches held. Raises WeightRefusedError; then nothing has changed."""
        teaching = () if base is None else history.teaching(base.id)
        held = {batch_id for one in teaching for batch_id in one.batch_ids}
        try:
            if not self._shelf.hold(OWNER, held):
                raise WeightRefusedError(
                    WeightRefusal.TOO_MANY,
                    "the batches of so many tickets cannot be kept: withdraw one, or raise [keep] batches and size_mb",
                )
            self._file.keep(history)
        except OSError as fault:
            raise WeightRefusedError(
                WeightRefusal.NOT_STORED, f"the ticket cannot be kept, so nothing has changed: {fault}"
            ) from None

    def _fit_if_wanted(self, *, has_changed: bool = True) -> None:
        """Begin the fit of what stands, unless it was made already or a commissioning is under way.

        One that somebody took out of use is made again with the next change only.
        """
        history = self._file.history
        base = self._refit.base(history)
        if base is None or self._why_not_allowed is not None or self._book.record.underway is not None:
            return
        teaching = history.teaching(base.id)
        fit = history.fit_of(base.id, teaching)
        try:
            if not teaching:
                self._refit.leave_only(None, history, base)
            if fit is None or (has_changed and teaching and not self._refit.leave_only(fit, history, base)):
                self._refit.begin(base, teaching)
        except (OSError, CommissioningRefusedError) as refusal:
            log_event(Event.NOT_REFITTED, level=logging.WARNING, fault=str(refusal))

    def _on_fit(self, fit: TicketFit) -> None:
        """Of each that ended; in the book's lock."""
        with suppress(OSError):  # it is made again after the next start
            self._file.keep(self._file.history.with_fit(fit))
        if fit.fault is not None:
            log_event(Event.NOT_REFITTED, level=logging.WARNING, fault=fit.fault)
        elif fit.ticket_ids:
            told = {"calibration_id": fit.calibration_id, "n_tickets": len(fit.ticket_ids)}
            tell_event(Event.REFITTED, told, self._on_event)

    def _state(self) -> dict[str, Any]:
        history = self._file.history
        base = self._refit.base(history)
        teaching = () if base is None else history.teaching(base.id)
        fit = None if base is None else history.fit_of(base.id, teaching)
        known = [one for one in history.fits if base is not None and one.base_id == base.id and one.planned]
        planned = fit.planned if fit is not None and fit.planned else (known[-1].planned if known else None)
        why_not = self._why_not_allowed or (BY_FILE if base is None else None)
        return {
            "is_possible": why_not is None,
            "why_not": why_not,
            "is_busy": self._refit.is_busy,
            "n_teaching": len(teaching),
            "is_provisional": planned is None or not planned.is_enough,
            "planned": None if planned is None else planned.model_dump(mode="json"),
            "fault": self._file.fault or (None if fit is None else fit.fault),
            "history": [one.model_dump(mode="json") for one in reversed(history.tickets)],
        }
