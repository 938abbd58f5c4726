"""The bounded waiting room between the pipeline and the disk."""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from gateway.store.rows import DeliveryRow, EntryRow, EstimateRow, Row

SEQ_STRIDE: Final = 1 << 20  # each opening of a database begins a new stride


class Held:
    """Rows accepted but not yet on disk, oldest first, and the numbering of estimates.

    While the disk works a row stays here for milliseconds; while it refuses, this is the memory the
    store degrades to. Over ``capacity`` the oldest row that is not just being written gives way and is
    counted. Thread-safe.

    ``epoch`` and ``seq`` make the cursor of an estimate. Numbers go up and are never used twice within
    an epoch, not even after a kill that lost rows somebody has read: each opening jumps to a new stride.
    """

    def __init__(self, capacity: int, epoch: str, last_seq: int = 0) -> None:
        self._capacity = capacity
        self._changed = threading.Condition()
        self._waiting: deque[Row] = deque()
        self._in_flight: tuple[Row, ...] = ()
        self._is_at_work = False
        self._epoch = epoch
        self._number_behind(last_seq)
        self.n_dropped = 0

    @property
    def epoch(self) -> str:
        return self._epoch

    def rebase(self, epoch: str, last_seq: int) -> None:
        """Go on in a database that was found later, behind what it already holds."""
        with self._changed:
            self._epoch = epoch
            self._number_behind(last_seq)
            kept = (row for row in self._waiting if not isinstance(row, DeliveryRow))  # in numbers that are void now
            self._waiting = deque(self._renumbered(row) for row in kept)

    def add(self, row: Row) -> None:
        """Accept an event or a calibration."""
        with self._changed:
            self._append(row)

    def add_delivery(self, name: str, cursor: str) -> bool:
        """Accept how far an uplink has delivered, in place of what waits of it; False for another epoch's cursor."""
        with self._changed:
            epoch, _, digits = cursor.partition("-")
            if epoch != self._epoch:
                return False
            newest = DeliveryRow(name, int(digits))
            self._waiting = deque(
                row for row in self._waiting if not (isinstance(row, DeliveryRow) and row.name == newest.name)
            )
            self._append(newest)
            return True

    def add_estimate(self, make_row: Callable[[int, int], EstimateRow]) -> str:
        """Accept an estimate made with the number it gets here and the one before it; its cursor."""
        with self._changed:
            row = make_row(*self._take_numbers())
            self._append(row)
            return f"{self._epoch}-{row.seq}"

    def add_entry(self, make_row: Callable[[int], EntryRow]) -> str:
        """Accept an event or a trip; its cursor. Its number is in one row with the estimates', which skip it."""
        with self._changed:
            row = make_row(self._take_number_between())
            self._append(row)
            return f"{self._epoch}-{row.seq}"

    def wait_for_rows(self, timeout_s: float, has_other_work: Callable[[], bool]) -> None:
        """Sleep until a row waits, ``wake`` finds other work, or the time is out."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._waiting) or has_other_work(), timeout_s)

    def take(self) -> tuple[Row, ...]:
        """All that waits, now in flight: end with ``settle`` or ``give_back``, and then ``rest``."""
        with self._changed:
            self._is_at_work = True
            self._in_flight = tuple(self._waiting)
            self._waiting.clear()
            return self._in_flight

    def settle(self) -> None:
        """What was in flight is on disk."""
        with self._changed:
            self._in_flight = ()

    def rest(self) -> None:
        """Nothing is done to the disk until rows wait again or other work is found."""
        with self._changed:
            self._is_at_work = False
            self._changed.notify_all()

    def give_back(self) -> None:
        """What was in flight could not be written: it waits again, in its old order."""
        with self._changed:
            self._waiting.extendleft(reversed(self._in_flight))
            self._in_flight = ()
            self._drop_over_capacity()

    def wake(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def wait_until_empty(self, timeout_s: float) -> bool:
        """True once all is on disk and the disk is left alone."""
        with self._changed:
            return self._changed.wait_for(
                lambda: not self._waiting and not self._in_flight and not self._is_at_work, timeout_s
            )

    def estimates(self) -> tuple[str, tuple[EstimateRow, ...]]:
        """The epoch and the estimates not yet on disk, oldest first."""
        with self._changed:
            rows = (*self._in_flight, *self._waiting)
            return self._epoch, tuple(row for row in rows if isinstance(row, EstimateRow))

    def entries(self) -> tuple[str, tuple[EntryRow, ...]]:
        """The epoch and the events and trips not yet on disk, oldest first."""
        with self._changed:
            rows = (*self._in_flight, *self._waiting)
            return self._epoch, tuple(row for row in rows if isinstance(row, EntryRow))

    def __len__(self) -> int:
        with self._changed:
            return len(self._in_flight) + len(self._waiting)

    def _append(self, row: Row) -> None:
        self._waiting.append(row)
        self._drop_over_capacity()
        self._changed.notify_all()

    def _drop_over_capacity(self) -> None:
        while self._waiting and len(self._in_flight) + len(self._waiting) > self._capacity:
            self._waiting.popleft()
            self.n_dropped += 1

    def _number_behind(self, last_seq: int) -> None:
        """The next number is the first of the stride behind ``last_seq``, which is the one before it."""
        self._last_seq, self._next_seq = last_seq, (last_seq // SEQ_STRIDE + 1) * SEQ_STRIDE

    def _take_numbers(self) -> tuple[int, int]:
        """A new number, and the one given before it."""
        seq, previous = self._next_seq, self._last_seq
        self._last_seq, self._next_seq = seq, seq + 1
        return seq, previous

    def _take_number_between(self) -> int:
        """A new number that no estimate is linked to."""
        seq, self._next_seq = self._next_seq, self._next_seq + 1
        return seq

    def _renumbered(self, row: Row) -> Row:
        if isinstance(row, EntryRow):
            return replace(row, seq=self._take_number_between())
        if not isinstance(row, EstimateRow):
            return row
        seq, previous = self._take_numbers()
        return replace(row, seq=seq, previous=previous)
