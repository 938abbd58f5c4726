"""The store: one thread writes, no caller waits for the disk, and every lost record is counted."""

import logging
import secrets
import sqlite3
import threading
import time
from collections.abc import Callable, Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from gateway.errors import StoreError
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate
from gateway.files.reserve import Reserve
from gateway.log import Event, log_event
from gateway.part import STOP_WITHIN_S, ServicePart
from gateway.records import json_line
from gateway.status import StoreState, StoreStatus
from gateway.store.database import FILE_NAME, DamagedError, Database, is_damaged
from gateway.store.journal import BATCHES, ENTRIES, ESTIMATE, REJECTION, REMAINDER, SERVICE, Delivery
from gateway.store.reader import Follower, StoreReader
from gateway.store.retention import Retention, boot_ns
from gateway.store.schema import JournalRow, Row
from gateway.store.write_buffer import Held, WriteBuffer

IDLE_S: Final = 900.0  # chosen: without new rows: how often age is looked at
RETRY_FIRST_S: Final = 0.5  # chosen: pause after a fault of the disk; doubles up to the last
RETRY_LAST_S: Final = 30.0  # chosen: how late a disk that works again is noticed
BOOT_ID: Final = Path("/proc/sys/kernel/random/boot_id")
MOST_BAD: Final = 1000  # chosen: bad records that are counted


class Store(ServicePart):
    """Estimates and events in one directory. Every method may be called from any thread.

    If the disk is full, read-only or gone, the store keeps records in memory and says so in ``health`` and in the log.
    It retries by itself and then writes the records it kept.
    """

    NAME = "database writer"
    IS_VITAL = True

    def __init__(self, directory: Path, retention: Retention, clock_ns: Callable[[], int]) -> None:
        self.path = directory / FILE_NAME
        self._database = Database(directory, retention)
        self._reserve = Reserve(directory)
        self._clock_ns = clock_ns
        self._boot_id = _boot_id()
        self._buffer = WriteBuffer(retention.max_held, epoch=secrets.token_hex(4))
        self._closing = threading.Event()
        self._suspect = threading.Event()
        self._lost = threading.Event()
        self._bad: set[int] = set()  # hashes of the records that this program cannot use
        self._reason: str | None = None
        self._set_aside: str | None = None
        self._n_written = self._n_pruned = self._size_bytes = 0
        self._thread = threading.Thread(target=self._write_until_closed, name="store-writer", daemon=True)

    @classmethod
    def open(
        cls, directory: Path, retention: Retention | None = None, clock_ns: Callable[[], int] = time.time_ns
    ) -> "Store":
        """Open or create the database in ``directory`` and start its writer.

        Raises StoreError if continuing would do harm: a newer schema, another program's file, or another Springscale
        that uses the directory. A failing disk is no error: the store starts degraded.
        """
        store = cls(directory, retention or Retention(), clock_ns)
        try:
            store._attempt()
        except StoreError:
            store._database.close()
            raise
        store._thread.start()
        return store

    def write_estimate(self, record: Mapping[str, Any]) -> str:
        """Accept an estimate or a rejection, the object of ``estimate_to_json`` -> its cursor.

        Returns at once. A record with the same id takes the place of the earlier one.
        """
        if record.get("provisional"):
            raise ValueError("provisional estimates go to latest and the stream, not into the store")
        kind = REJECTION if record["rejected"] else ESTIMATE
        return self._append(kind, record["id"], record["t_end_ns"], json_line(record))

    def write_window(self, found: Estimate) -> None:
        """Accept a window's estimate, rejection or remainder; the last is neither shown in the history nor sent."""
        record = estimate_to_json(found)
        if found.is_remainder:
            self._append(REMAINDER, record["id"], record["t_end_ns"], json_line(record))
        else:
            self.write_estimate(record)

    def write_entry(self, kind: str, entry_id: str, t_end_ns: int, text: str) -> str:
        """Accept a new revision of a load event, trip or alarm -> its cursor; it replaces the earlier revision."""
        return self._append(kind, entry_id, t_end_ns, text)

    def write_event(self, kind: str, detail: Mapping[str, Any]) -> None:
        self._append(SERVICE, "", self._clock_ns(), f"{kind}\n{json_line(detail)}")

    def write_delivery(self, uplink: str, cursor: str) -> bool:
        """Store that ``uplink`` has delivered everything up to ``cursor``.

        Returns False and stores nothing for a cursor of a database that no longer exists.
        """
        return self._buffer.add_delivery(uplink, cursor)

    def follow(self, kinds: Sequence[str], after: str | None, on_news: Callable[[], None]) -> Follower:
        """Follow these kinds after a cursor (None: from the first record). ``on_news`` is called for each accepted
        record, in the thread that writes it, and must not block. Raises ValueError for a text that is not a cursor.
        """
        return Follower(self._buffer, self.reader(), kinds, after, on_news)

    def is_stored(self, record_id: str) -> bool:
        """Whether an accepted record is on disk."""
        return not len(self._buffer) or all(row.id != record_id for row in self._buffer.held().rows)

    def head(self) -> str:
        return self._buffer.head()

    def delivery(self, uplink: str, kinds: Sequence[str] = (*BATCHES, *ENTRIES)) -> Delivery:
        return self.reader().delivery(uplink, kinds)

    def flush(self, timeout_s: float) -> bool:
        """Wait until every accepted record is on disk; False if the time ran out."""
        return self._buffer.wait_until_empty(timeout_s)

    def reader(self) -> StoreReader:
        """A reader for any thread; it sees the records on disk and those in memory."""
        return StoreReader(self)

    def health(self) -> StoreStatus:
        return StoreStatus(
            state=StoreState.OK if self._reason is None else StoreState.DEGRADED,
            reason=self._reason,
            n_written=self._n_written,
            n_held=len(self._buffer),
            n_dropped=self._buffer.n_dropped,
            n_pruned=self._n_pruned,
            size_bytes=self._size_bytes,
            set_aside=self._set_aside,
            is_replaced=self._database.is_replaced,
            is_reserve_in_use=self._reserve.is_in_use,
            n_bad_records=len(self._bad),
        )

    def is_alive(self) -> bool:
        """False once the writer has ended, whether closed or dead."""
        return self._thread.is_alive()

    def death(self) -> str | None:
        return None if self.is_alive() else "died"

    def close(self, timeout_s: float = STOP_WITHIN_S) -> int:
        """Write the rows in memory and end the writer -> number of rows that could not be stored."""
        self._closing.set()
        self._buffer.wake()
        self._thread.join(timeout_s)
        n_lost = len(self._buffer)
        if n_lost:
            log_event(Event.STORE_LOST_ROWS, level=logging.ERROR, n_rows=n_lost, reason=self._reason or "no time")
        return n_lost

    def held(self) -> Held:
        """The records that are not on disk yet."""
        return self._buffer.held()

    def boot(self) -> tuple[str, int]:
        """Identifier of the machine's boot, and the nanoseconds since then, including sleep."""
        return self._boot_id, boot_ns()

    def suspect_file(self, *, is_damaged: bool) -> None:
        """A reader found the file damaged, or could not use it: the next attempt checks it."""
        (self._suspect if is_damaged else self._lost).set()
        self._buffer.wake()

    def note_failed_sum(self, seq: int) -> None:
        """A reader found that this record is not as it was written."""
        self._note_bad(seq, seq=seq)

    def note_unread(self, text: str, fault: Exception) -> None:
        """A record is whole, but this program cannot read it."""
        self._note_bad(text, record=text[:80], fault=repr(fault)[:200])

    def _note_refused(self, row: Row, fault: Exception) -> None:
        self._note_bad(repr(row), record=repr(row), fault=repr(fault)[:200])  # the whole record: it is nowhere else

    def _note_bad(self, which: Hashable, **told: object) -> None:
        """Log and count a record that cannot be used, once. One that is in the journal stays there."""
        mark = hash(which)
        if mark not in self._bad and len(self._bad) < MOST_BAD:
            self._bad.add(mark)
            log_event(Event.STORE_BAD_RECORD, level=logging.ERROR, **told)

    def _append(self, kind: str, record_id: str, t_end_ns: int, text: str) -> str:
        row = JournalRow(0, kind, record_id, t_end_ns, 0, self._clock_ns(), text, boot_ns())
        return self._buffer.append(row)

    def _write_until_closed(self) -> None:
        pause_s = RETRY_FIRST_S
        while True:
            is_last = self._closing.is_set()
            if self._try():
                pause_s = RETRY_FIRST_S
                if is_last and not len(self._buffer):
                    break
                self._buffer.wait_for_rows(IDLE_S, self._has_other_work)
            elif is_last:
                break
            else:
                self._closing.wait(pause_s)
                pause_s = min(2 * pause_s, RETRY_LAST_S)
        self._database.close()

    def _has_other_work(self) -> bool:
        return self._closing.is_set() or self._suspect.is_set() or self._lost.is_set()

    def _try(self) -> bool:
        try:
            return self._attempt()
        except StoreError as error:  # the file was replaced by a foreign one after the start
            return self._degrade(str(error))
        finally:
            self._buffer.rest()  # callers of flush then see the present counters and state

    def _attempt(self) -> bool:
        """Write the rows in memory; returns False and keeps them if the disk fails."""
        try:
            self._open_if_closed()
            if self._lost.is_set():
                self._lost.clear()
                self._database.require_tables()
            if self._suspect.is_set():
                self._suspect.clear()
                raise DamagedError("a reader met damage")
            self._commit()
        except StoreError:
            raise
        except Exception as error:  # noqa: BLE001 - a record was set aside already: the disk or the file is at fault
            self._buffer.give_back()
            self._lost.set()  # what failed may be a table that is missing: the next attempt looks
            if is_damaged(error):
                return self._attempt() if self._database.mend() else self._set_damaged_aside(error)
            if self._reserve.give_up():
                log_event(Event.STORE_RESERVE, level=logging.WARNING, reason=str(error))
                return self._attempt()
            return self._degrade(f"{self.path}: {error}" if isinstance(error, sqlite3.Error) else str(error))
        return True

    def _open_if_closed(self) -> None:
        if not self._database.is_open:
            self._buffer.continue_in(*self._database.open(self._buffer.epoch))

    def _commit(self) -> None:
        rows = self._buffer.take()
        if rows:
            self._n_written += self._database.add(rows, self._boot_id, self._note_refused)
        if self._reason is not None:
            log_event(Event.STORE_RECOVERED, n_held=len(rows))
            self._reason = None
        self._buffer.settle()
        self._n_pruned += self._database.prune(self._clock_ns())
        self._size_bytes = self._database.size_bytes()
        self._reserve.keep()

    def _degrade(self, reason: str) -> bool:
        """Report that the disk fails. The connection stays open, so readers need no new file."""
        if self._reason != reason:
            log_event(Event.STORE_HOLDS, level=logging.WARNING, reason=reason)
        self._reason = reason
        return False

    def _set_damaged_aside(self, error: Exception) -> bool:
        """Rename a damaged file; the next attempt starts a new one with the same numbering."""
        try:
            self._set_aside = self._database.set_aside()
        except OSError as refusal:
            return self._degrade(f"{self.path} is damaged ({error}) and cannot be set aside: {refusal}")
        fault = f"{self.path} is damaged ({error})"
        log_event(Event.STORE_DAMAGED, level=logging.ERROR, fault=fault, set_aside=self._set_aside)
        return self._degrade(f"{self.path} was damaged and set aside as {self._set_aside}; a new one is being created")


def _boot_id() -> str:
    """The kernel's identifier of this boot; a random one if the kernel gives none."""
    try:
        return BOOT_ID.read_text().strip()
    except OSError:
        return secrets.token_hex(8)
