"""Checks of the weighing against known loads: one part of the service, with a thread of its own."""

from pathlib import Path

from gateway.calibration.verification_file import VerificationRule
from gateway.config.sections import VerificationSection
from gateway.service.pipeline import Pipeline
from gateway.service.proving.known_weights import KnownWeightService
from gateway.service.proving.trend_keeper import TrendKeeper
from gateway.service.proving.verification_desk import VerificationDesk
from gateway.service.subject import Subject
from gateway.store import Store


class Proving:
    """Known weights and verifications, stated by people; the trend of the vehicle's parameters, in the background."""

    def __init__(
        self,
        directory: Path,
        wanted: VerificationSection,
        subject: Subject,
        pipeline: Pipeline,
        store: Store,
        *,
        stale_after_s: float,
    ) -> None:
        """Applies known weights in ``pipeline``."""
        ask = store.reader().estimates
        self.known_weights = KnownWeightService(
            directory, subject, pipeline, ask, stale_after_s=stale_after_s, on_event=store.write_event
        )
        self.verification = VerificationDesk(
            directory,
            subject,
            ask,
            VerificationRule(**wanted.model_dump(exclude={"every_days"})),
            payload_without=self.known_weights.payload_without,
            every_days=wanted.every_days,
            on_event=store.write_event,
        )
        self.trend = TrendKeeper(directory, subject, ask, self.known_weights.zeros)

    def start(self) -> None:
        """Begin to follow the trend."""
        self.trend.start()

    def stop(self) -> None:
        """End that."""
        self.trend.stop()

    @property
    def faults(self) -> tuple[str, ...]:
        """A due verification, a drift or a fault, for people."""
        return tuple(fault for fault in (self.known_weights.fault, self.verification.fault, self.trend.fault) if fault)
