"""Base class of the senders: one thread that delivers an outbox, pauses after failures, and a status report."""

import time
from abc import abstractmethod
from contextlib import suppress
from dataclasses import replace
from typing import Final, Generic, TypeVar

from gateway.errors import StoreError
from gateway.part import FIRST_PAUSE_S, STOP_WITHIN_S, BackOff, ThreadPart
from gateway.status import UplinkStatus, WebhookStatus
from gateway.units import NS_PER_S
from gateway.uplink.outbox import Outbox, OutboxMessage

LOOK_S: Final = 5.0  # chosen: how often what waits is counted
IDLE_S: Final = 5.0  # chosen: likewise where nothing comes; a new message is seen at once

Report = TypeVar("Report", UplinkStatus, WebhookStatus)


class NotTakenError(Exception):
    """The receiver did not take a message; it asks to be left alone for ``wait_s``."""

    def __init__(self, why: str, wait_s: float = 0.0) -> None:
        super().__init__(why)
        self.wait_s = wait_s


class Sender(ThreadPart, Generic[Report]):
    """Delivers one message after the other until stopped, and again from the first undelivered one after a failure.

    Its thread alone writes the report. Failures are in the report, not in ``fault``.
    """

    def __init__(self, outbox: Outbox, report: Report, back_off: BackOff | None, back_off_max_s: float) -> None:
        """``back_off`` gives the pauses; without it they grow to ``back_off_max_s``."""
        super().__init__(self.NAME, back_off or BackOff(FIRST_PAUSE_S, back_off_max_s))
        self._outbox = outbox
        self._report: Report = report
        self._looked_s = -LOOK_S

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        self._stopping.set()
        self._outbox.tell_news()
        super().stop(within_s)

    def report(self) -> Report:
        """The present report; safe from any thread. Its counts of waiting and pruned records are a few seconds old."""
        return self._report

    def _work(self) -> None:
        while not self._stopping.is_set():
            message = self._outbox.next() if self._is_ready() else None
            self._look()
            if message is None:
                self._outbox.wait(IDLE_S)
            elif self._deliver(message):
                self._outbox.delivered()

    def _is_ready(self) -> bool:
        """Whether messages can be delivered; asked before each, and when there is none. Raises NotTakenError."""
        return True

    @abstractmethod
    def _deliver(self, message: OutboxMessage) -> bool:
        """Deliver a message; True if nothing more is to be done for it. Raises NotTakenError."""

    @abstractmethod
    def _note(self, fault: str) -> None:
        """Put a failure into the report, and log it if it is new."""

    def _failed(self, failure: Exception) -> None:
        """Report the failure, and pause; what waits is counted meanwhile."""
        self._note(str(failure) or repr(failure))
        wait_s = failure.wait_s if isinstance(failure, NotTakenError) else 0.0
        end_s = time.monotonic() + max(self._back_off.next_s(), wait_s)
        while not self._stopping.is_set() and (left_s := end_s - time.monotonic()) > 0.0:
            with suppress(StoreError, TimeoutError, OSError):  # the outbox's next message reports them
                self._look()
            self._stopping.wait(min(left_s, LOOK_S))

    def _look(self) -> None:
        """Count the waiting records, at most every LOOK_S."""
        if time.monotonic() - self._looked_s < LOOK_S:
            return
        self._looked_s = time.monotonic()
        found = self._outbox.look()
        self._report = replace(
            self._report,
            n_waiting=found.n_waiting,
            waiting_age_s=_age_s(found.oldest_ns),
            n_pruned=found.n_pruned,
        )


def _age_s(oldest_ns: int | None) -> float | None:
    """Age of the oldest waiting record; None if none waits or the clock was set back since."""
    age_s = -1.0 if oldest_ns is None else (time.time_ns() - oldest_ns) / NS_PER_S
    return age_s if age_s >= 0.0 else None
