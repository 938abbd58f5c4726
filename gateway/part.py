"""The parts of a service: what it starts, watches and stops, most of them with a thread of their own."""

import logging
import random
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Final

from gateway.log import Event, log_event

STOP_WITHIN_S: Final = 5.0  # chosen: for a part that is stopped alone; the service gives each its own limit
FIRST_PAUSE_S: Final = 1.0  # chosen: ceiling of the first pause before a part that failed begins anew
LAST_PAUSE_S: Final = 60.0  # chosen: ceiling of the longest


class BackOff:
    """Exponential with full jitter: uniform between nothing and a ceiling that doubles up to ``last_s``.

    Source: M. Brooker, "Exponential Backoff And Jitter", AWS Architecture Blog, 2015.
    """

    def __init__(self, first_s: float, last_s: float, draw: random.Random | None = None) -> None:
        self._first_s = first_s
        self._last_s = last_s
        self._ceiling_s = first_s
        self._draw = draw or random.Random()  # of the system's entropy: vehicles must not agree

    def next_s(self) -> float:
        pause_s = self._draw.uniform(0.0, self._ceiling_s)
        self._ceiling_s = min(2.0 * self._ceiling_s, self._last_s)
        return pause_s

    def reset(self) -> None:
        """Start again at ``first_s``, after a success."""
        self._ceiling_s = self._first_s


class ServicePart:
    """One part of the service. ``NAME`` is its name for people; the service ends with a part that ``IS_VITAL``."""

    NAME: str
    IS_VITAL = False

    def start(self) -> None:
        """Begin."""

    def stop(self, within_s: float = STOP_WITHIN_S) -> object:
        """End within this time; a part that waits for a disk or a bus may be left behind."""

    @property
    def fault(self) -> str | None:
        """The part's fault as a sentence for people; None while all is well."""
        return None

    def death(self) -> str | None:
        """Why the part has ended although nobody stopped it; None while it works."""
        return None


class ThreadPart(ServicePart, ABC):
    """A part with one thread, which works until ``_stopping`` is set.

    ``failure`` is the exception that ended the work. A vital part then stays dead; any other begins anew after a pause,
    and is at fault until it has succeeded.
    """

    def __init__(self, thread_name: str, back_off: BackOff | None = None) -> None:
        self.failure: BaseException | None = None
        self._back_off = back_off or BackOff(FIRST_PAUSE_S, LAST_PAUSE_S)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=thread_name, daemon=True)

    @abstractmethod
    def _work(self) -> None:
        """The work of the thread, until it is stopped."""

    def _failed(self, failure: Exception) -> None:
        """Report a failure of the work, and pause before it begins anew."""
        if repr(failure) != repr(self.failure):
            log_event(Event.PART_FAILED, level=logging.ERROR, part=self.NAME, failure=repr(failure))
        self.failure = failure
        self._stopping.wait(self._back_off.next_s())

    def _succeeded(self) -> None:
        """The work does what it should."""
        self.failure = None
        self._back_off.reset()

    def _run(self) -> None:
        while True:
            try:
                self._work()
            except BaseException as failure:  # noqa: BLE001 - a failure of one part is no failure of the others
                if self.IS_VITAL or not isinstance(failure, Exception):
                    log_event(Event.PART_DIED, level=logging.CRITICAL, part=self.NAME, failure=repr(failure))
                    self.failure = failure
                    return
                self._failed(failure)
            if self._stopping.is_set():
                return

    def start(self) -> None:
        self._thread.start()

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join(within_s)

    def is_alive(self) -> bool:
        return self._thread.is_alive()

    @property
    def fault(self) -> str | None:
        return None if self.failure is None else f"{self.NAME} failed: {self.failure!r}; weighing goes on"

    def death(self) -> str | None:
        if self.is_alive() or self._thread.ident is None or self._stopping.is_set():
            return None
        return f"died: {self.failure!r}" if self.failure is not None else "died"


class Repeated(ThreadPart):
    """Calls ``do`` again and again, each time after a pause of ``pause_s()`` seconds."""

    def __init__(self, name: str, do: Callable[[], object], pause_s: Callable[[], float]) -> None:
        super().__init__(name)
        self.NAME, self._do, self._pause_s = name, do, pause_s

    def _work(self) -> None:
        while not self._stopping.wait(self._pause_s()):
            self._do()
            self._succeeded()
