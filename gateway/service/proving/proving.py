"""All that holds the weighing against what is known: one part of the service, with a thread of its own."""

from pathlib import Path

from gateway.calibration.verification_file import VerificationRule
from gateway.config.sections import VerificationSection
from gateway.service.proving.ticket_desk import TicketDesk
from gateway.service.proving.trend_keeper import TrendKeeper, Zeros
from gateway.service.proving.verification_desk import VerificationDesk
from gateway.service.tare_desk import Subject
from gateway.store import Store


class Proving:
    """Verifications and tickets, asked for by people; the trend of the vehicle's parameters, in the background."""

    def __init__(
        self,
        directory: Path,
        wanted: VerificationSection,
        subject: Subject,
        store: Store,
        zeros: Zeros,
        tickets: TicketDesk,
    ) -> None:
        """``zeros`` tells the tares of the calibration in use."""
        self.tickets = tickets
        ask = store.reader().estimates
        self.verification = VerificationDesk(
            directory,
            subject,
            ask,
            VerificationRule(**wanted.model_dump(exclude={"every_days"})),
            every_days=wanted.every_days,
            on_event=store.write_event,
        )
        self.trend = TrendKeeper(directory, subject, ask, zeros)

    def start(self) -> None:
        """Begin to follow the trend, and to fit what tickets wait for it."""
        self.trend.start()
        self.tickets.start()

    def stop(self) -> None:
        """End both."""
        self.tickets.stop()
        self.trend.stop()

    @property
    def faults(self) -> tuple[str, ...]:
        """What is due, drifts or is broken, for people."""
        return tuple(fault for fault in (self.verification.fault, self.trend.fault, self.tickets.fault) if fault)
