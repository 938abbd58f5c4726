"""A part that follows the journal: it starts where it stopped, and neither waits for the weighing nor hurts it."""

import logging
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from gateway.estimates.as_json import read_estimate
from gateway.estimates.batch_estimate import Estimate
from gateway.log import Event, log_event
from gateway.part import STOP_WITHIN_S, ThreadPart
from gateway.store import Store, restored
from gateway.store.journal import BATCHES, REMAINDER

WINDOWS: Final = (*BATCHES, REMAINDER)
PAGE: Final = 20  # chosen: records in memory at a time


class JournalReader(ThreadPart):
    """Hands each stored window to ``take``, once and in order, and keeps its place in the store under its name.

    What ``take`` raises is this reader's fault until a later window succeeds; the window is passed over.
    """

    def __init__(self, name: str, store: Store, take: Callable[[Estimate], None]) -> None:
        super().__init__(f"journal {name}")
        self.NAME, self._store, self._take = name, store, take
        self._news = threading.Event()
        self._is_waiting = False
        self._follower = store.follow(WINDOWS, place_of(store, name) or store.head(), self._news.set)

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        """Read what is in the journal by now, and end."""
        self._stopping.set()
        self._news.set()
        super().stop(within_s)

    @property
    def has_caught_up(self) -> bool:
        """Whether it has taken every record."""
        return self._is_waiting and self._follower.place == self._store.head()

    def _work(self) -> None:
        self._store.write_delivery(self.NAME, self._follower.place)
        while True:
            self._is_waiting = False
            self._news.clear()
            is_last = self._stopping.is_set()
            while records := self._follower.read(PAGE):
                for record in records:
                    for found in self._store.reader().understood([record.text], read_estimate):
                        self._hear(replace(found, is_remainder=record.kind == REMAINDER))
                    self._store.write_delivery(self.NAME, record.cursor)
            if is_last:
                return
            self._is_waiting = True
            self._news.wait()

    def _hear(self, found: Estimate) -> None:
        try:
            self._take(found)
        except Exception as failure:  # noqa: BLE001 - the next window may succeed
            if self.failure is None:
                log_event(Event.PART_FAILED, level=logging.ERROR, part=self.NAME, failure=repr(failure))
            self.failure = failure
        else:
            self._succeeded()


def place_of(store: Store, name: str) -> str | None:
    """Cursor of the last record that a reader of this name has taken; None if it has taken none."""
    return restored(lambda: store.delivery(name).cursor, None)
