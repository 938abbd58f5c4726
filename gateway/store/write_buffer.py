"""The bounded buffer between writers and the disk. It numbers the records and notifies the followers."""

import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final, NamedTuple

from gateway.store.journal import KINDS
from gateway.store.schema import DeliveryRow, JournalRow, Row

SEQ_STRIDE: Final = 1 << 20  # chosen: each opening of a database begins a new stride


class Held(NamedTuple):
    """The records that are not on disk yet, oldest first, as they were at one moment.

    Records up to number ``floor`` are on disk; ``head`` is the newest number given. Both count within ``epoch``.
    """

    epoch: str
    floor: int
    head: int
    rows: tuple[JournalRow, ...]


class WriteBuffer:
    """Rows accepted but not yet on disk, oldest first, and the numbers of all records. Thread-safe.

    A row stays here for milliseconds while the disk works, and until it recovers while it fails. Beyond ``capacity``
    the oldest row that is not being written is dropped and counted.

    One lock numbers and publishes the records, so every follower sees them in order. A cursor consists of ``epoch`` and
    number. A number is never used twice within an epoch, not even after a kill that lost records which a client had
    read: each opening of the database starts a new stride.
    """

    def __init__(self, capacity: int, epoch: str) -> None:
        self._capacity = capacity
        self._changed = threading.Condition()
        self._waiting: deque[Row] = deque()
        self._in_flight: tuple[Row, ...] = ()
        self._is_at_work = False
        self._listeners: dict[object, Callable[[], None]] = {}
        self._newest: dict[str, int] = {}
        self._rebased: tuple[str, Mapping[int, int]] = ("", {})
        self._epoch = epoch
        self._floor = 0
        self._number_behind(0, 0)
        self.n_dropped = 0

    @property
    def epoch(self) -> str:
        return self._epoch

    def continue_in(self, epoch: str, last_seq: int, last_batch: int, newest: Mapping[str, int]) -> None:
        """Continue after the last record of the database that was opened, unless its numbers are those of this
        buffer.
        """
        with self._changed:
            if epoch == self._epoch and last_seq < self._next_seq:
                return
            before, first_seq = self._epoch, last_seq
            self._epoch, self._newest = epoch, dict(newest)
            self._number_behind(last_seq, last_batch)
            moved = {0: first_seq}
            kept: deque[Row] = deque()
            for row in self._waiting:
                if isinstance(row, DeliveryRow):  # its number is no longer valid
                    continue
                if isinstance(row, JournalRow):
                    again = self._numbered(row)
                    moved[row.seq], row = again.seq, again  # noqa: PLW2901 - the same record under its new number
                kept.append(row)
            self._waiting = kept
            self._rebased = (before, moved)

    def place_of(self, epoch: str, seq: int) -> int | None:
        """The new number of a position of the epoch before ``rebase``; None for any other epoch."""
        with self._changed:
            before, moved = self._rebased
            if epoch != before:
                return None
            return moved[max((known for known in moved if known <= seq), default=0)]

    def append(self, row: JournalRow) -> str:
        """Accept a record under the next number, which replaces ``seq`` of the given row -> its cursor."""
        with self._changed:
            numbered = self._numbered(row)
            self._add(numbered)
            for on_news in self._listeners.values():
                with suppress(Exception):  # whoever follows has faults of its own, and no part in the writing
                    on_news()
            return f"{self._epoch}-{numbered.seq}"

    def add_delivery(self, name: str, cursor: str) -> bool:
        """Accept the position up to which an uplink has delivered, replacing a waiting one; False for another epoch."""
        with self._changed:
            epoch, _, digits = cursor.partition("-")
            if epoch != self._epoch:
                return False
            newest = DeliveryRow(name, int(digits))
            self._waiting = deque(
                row for row in self._waiting if not (isinstance(row, DeliveryRow) and row.name == newest.name)
            )
            self._add(newest)
            return True

    def listen(self, key: object, on_news: Callable[[], None]) -> None:
        """Call ``on_news`` with each record that is accepted, until ``unlisten``."""
        with self._changed:
            self._listeners[key] = on_news

    def unlisten(self, key: object) -> None:
        with self._changed:
            self._listeners.pop(key, None)

    def newest(self, kinds: Sequence[str]) -> int:
        """The newest number given to any of these kinds, 0 if there is none."""
        with self._changed:
            return max((self._newest.get(kind, 0) for kind in kinds), default=0)

    def head(self) -> str:
        with self._changed:
            return f"{self._epoch}-{self._next_seq - 1}"

    def held(self) -> Held:
        """The records not yet on disk, with the numbers around them."""
        with self._changed:
            rows = (row for row in (*self._in_flight, *self._waiting) if isinstance(row, JournalRow))
            return Held(self._epoch, self._floor, self._next_seq - 1, tuple(rows))

    def wait_for_rows(self, timeout_s: float, has_other_work: Callable[[], bool]) -> None:
        """Sleep until a row waits, ``wake`` finds other work, or the time is out."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._waiting) or has_other_work(), timeout_s)

    def take(self) -> tuple[Row, ...]:
        """Take all waiting rows for writing; the caller ends with ``settle`` or ``give_back``, and then ``rest``."""
        with self._changed:
            self._is_at_work = True
            self._in_flight = tuple(self._waiting)
            self._waiting.clear()
            return self._in_flight

    def settle(self) -> None:
        """The rows taken are on disk."""
        with self._changed:
            written = (row.seq for row in self._in_flight if isinstance(row, JournalRow))
            self._floor = max(written, default=self._floor)
            self._in_flight = ()

    def rest(self) -> None:
        """The writer pauses until rows wait or other work appears."""
        with self._changed:
            self._is_at_work = False
            self._changed.notify_all()

    def give_back(self) -> None:
        """The rows taken could not be written: put them back in their order."""
        with self._changed:
            self._waiting.extendleft(reversed(self._in_flight))
            self._in_flight = ()
            self._drop_over_capacity()

    def wake(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def wait_until_empty(self, timeout_s: float) -> bool:
        """Wait until every row is on disk and the writer pauses; False if the time ran out."""
        with self._changed:
            return self._changed.wait_for(
                lambda: not self._waiting and not self._in_flight and not self._is_at_work, timeout_s
            )

    def __len__(self) -> int:
        with self._changed:
            return len(self._in_flight) + len(self._waiting)

    def _add(self, row: Row) -> None:
        self._waiting.append(row)
        self._drop_over_capacity()
        self._changed.notify_all()

    def _drop_over_capacity(self) -> None:
        while self._waiting and len(self._in_flight) + len(self._waiting) > self._capacity:
            self._waiting.popleft()
            self.n_dropped += 1

    def _number_behind(self, last_seq: int, last_batch: int) -> None:
        """Set the next number to the first of the stride after ``last_seq``."""
        self._floor, self._last_batch = last_seq, last_batch
        self._next_seq = (last_seq // SEQ_STRIDE + 1) * SEQ_STRIDE

    def _numbered(self, row: JournalRow) -> JournalRow:
        """The row with the next number; a batch is linked to the one accepted before it."""
        seq, self._next_seq = self._next_seq, self._next_seq + 1
        self._newest[row.kind] = seq
        is_batch = row.kind in KINDS and not KINDS[row.kind].is_revised
        previous = self._last_batch if is_batch else 0
        if is_batch:
            self._last_batch = seq
        record_id = row.id or f"{row.kind}-{seq}"
        return replace(row, seq=seq, previous=previous, id=record_id)
