"""The parts of a service: what it starts, watches and stops, most of them with a thread of their own."""

import threading
from abc import ABC, abstractmethod
from typing import ClassVar, Final

STOP_WITHIN_S: Final = 5.0  # chosen: for a part that is stopped alone; the service gives each its own limit


class ServicePart:
    """One part of the service. ``NAME`` is its name for people."""

    NAME: ClassVar[str]

    def start(self) -> None:
        """Begin."""

    def stop(self, within_s: float = STOP_WITHIN_S) -> object:
        """End within this time; a part that waits for a disk or a bus may be left behind."""

    @property
    def fault(self) -> str | None:
        """What is wrong, for people; None while all is well."""
        return None

    def death(self) -> str | None:
        """Why the part has ended although nobody stopped it; None while it works."""
        return None

    def shown_fault(self) -> str | None:
        """The fault to show if the service can do without this part: its death, else its fault."""
        death = self.death()
        return self.fault if death is None else f"the {self.NAME} {death}; weighing goes on, a restart brings it back"


class ThreadPart(ServicePart, ABC):
    """A part with one thread, which runs until ``_stopping`` is set. An exception that ends it is in ``failure``."""

    def __init__(self, thread_name: str) -> None:
        self.failure: BaseException | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=thread_name, daemon=True)

    @abstractmethod
    def _run(self) -> None:
        """The work of the thread."""

    def start(self) -> None:
        self._thread.start()

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join(within_s)

    def is_alive(self) -> bool:
        return self._thread.is_alive()

    def death(self) -> str | None:
        if self.failure is not None:
            return f"died: {self.failure!r}"
        has_begun = self._thread.ident is not None
        return "died" if has_begun and not self.is_alive() and not self._stopping.is_set() else None
