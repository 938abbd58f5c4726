"""What every sender is: one thread that takes letters out of an outbox, and a report of how it goes."""

import threading
import time
from abc import ABC, abstractmethod
from contextlib import suppress
from dataclasses import replace
from typing import ClassVar, Final, Generic, TypeVar

from gateway.errors import StoreError
from gateway.history import Delivery
from gateway.status import UplinkStatus, WebhookStatus
from gateway.units import NS_PER_S
from gateway.uplink.back_off import BackOff
from gateway.uplink.outbox import Outbox

LOOK_S: Final = 5.0  # how often the backlog is counted
PAGE: Final = 100  # letters asked for at once
FIRST_PAUSE_S: Final = 1.0
STOP_WITHIN_S: Final = 1.0

Report = TypeVar("Report", UplinkStatus, WebhookStatus)


class Forwarder(ABC, Generic[Report]):
    """Owns the thread, which alone writes the report; a sender says in ``_run`` what the thread does."""

    NAME: ClassVar[str]

    def __init__(self, outbox: Outbox, report: Report, back_off: BackOff | None, back_off_max_s: float) -> None:
        """``back_off`` tells the pauses; without one they grow to ``back_off_max_s``."""
        self._outbox = outbox
        self._report: Report = report
        self._back_off = back_off or BackOff(FIRST_PAUSE_S, back_off_max_s)
        self._stop = threading.Event()
        self._looked_s = -LOOK_S
        self._thread = threading.Thread(target=self._run, name=self.NAME, daemon=True)

    def start(self) -> None:
        """Begin to deliver."""
        self._thread.start()

    def stop(self, timeout_s: float = STOP_WITHIN_S) -> None:
        """End; what is not delivered goes out after the next start."""
        self._stop.set()
        self._outbox.tell_news()
        if self._thread.ident is not None:
            self._thread.join(timeout_s)

    def is_alive(self) -> bool:
        """True while the thread runs."""
        return self._thread.is_alive()

    def report(self) -> Report:
        """How it is; safe from any thread. What waits and what was pruned is of a few seconds ago."""
        return self._report

    def _run(self) -> None:
        """Deliver until asked to stop. Whatever goes wrong is told in the report and tried again."""
        while not self._stop.is_set():
            try:
                self._deliver()
            except Exception as fault:  # noqa: BLE001 - no record, disk or receiver may end the thread
                self._note(str(fault) or repr(fault))
                self._outbox.rewind()
                self._pause(self._back_off.next_s())

    @property
    def fault(self) -> str | None:
        """Nothing here: what goes wrong stands in the report."""
        return None

    @abstractmethod
    def _deliver(self) -> None:
        """Until asked to stop, or until something goes wrong."""

    @abstractmethod
    def _note(self, fault: str) -> None:
        """Keep what went wrong, and tell it where it is news."""

    def _n_pruned(self, found: Delivery) -> int:
        """How many of those that this sender would have delivered were removed before."""
        return found.n_pruned

    def _pause(self, pause_s: float) -> None:
        """Until it is time to try again, or to stop; what waits meanwhile is still counted."""
        end_s = time.monotonic() + pause_s
        while not self._stop.is_set():
            with suppress(StoreError, TimeoutError, OSError):  # told where letters are asked for
                self._look()
            left_s = end_s - time.monotonic()
            if left_s <= 0.0:
                return
            self._stop.wait(min(left_s, LOOK_S))

    def _look(self) -> None:
        """Count what waits, where the last count is old."""
        if time.monotonic() - self._looked_s < LOOK_S:
            return
        self._looked_s = time.monotonic()
        found = self._outbox.look()
        self._report = replace(
            self._report,
            n_waiting=found.n_waiting,
            waiting_age_s=_age_s(found.oldest_ns),
            n_pruned=self._n_pruned(found),
        )


def _age_s(oldest_ns: int | None) -> float | None:
    """None where none waits, and where the clock was put back since."""
    age_s = -1.0 if oldest_ns is None else (time.time_ns() - oldest_ns) / NS_PER_S
    return age_s if age_s >= 0.0 else None
