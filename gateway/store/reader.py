"""Reading the journal: read-only queries, limited in time, and followers that receive each record as it is accepted."""

import logging
import sqlite3
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass
from functools import partialmethod
from typing import TYPE_CHECKING, Any, Final, TypeVar

from gateway.errors import StoreError
from gateway.log import Event, log_event
from gateway.store import queries
from gateway.store.database import is_damaged
from gateway.store.journal import BATCHES, ENTRIES, ESTIMATE, REJECTION, Delivery, HistoryPage, JournalRecord
from gateway.store.queries import LAST, JournalQuery, without_spectra
from gateway.store.schema import JournalRow, connect_reader
from gateway.store.write_buffer import Held, WriteBuffer
from gateway.units import NS_PER_S

if TYPE_CHECKING:
    from gateway.store.writer import Store

T = TypeVar("T")

QUERY_LIMIT_S: Final = 2.0  # chosen: of one page; a client is to ask for less at a time
_STEPS_PER_LOOK: Final = 10_000  # chosen: SQLite instructions between two looks at the clock


@dataclass(frozen=True, slots=True)
class Latest:
    """The last answer and the last rejection, as JSON.

    ``age_s`` is the age of the answer on a monotonic clock; None if the machine has been restarted since, because no
    clock then knows the age.
    """

    estimate: str | None
    rejection: str | None
    age_s: float | None


class StoreReader:
    """Read-only view of a store, safe in any thread.

    Each query opens its own connection, so no handle outlives a database that was set aside. A query that takes longer
    than ``limit_s`` raises TimeoutError; a database that cannot be read raises StoreError.
    """

    def __init__(self, store: "Store", limit_s: float = QUERY_LIMIT_S) -> None:
        self._store = store
        self._limit_s = limit_s

    def page(
        self,
        kinds: Sequence[str],
        *,
        since_ns: int | None = None,
        until_ns: int | None = None,
        limit: int = 100,
        cursor: str | None = None,
        newest_first: bool = False,
        with_spectra: bool = True,
    ) -> HistoryPage:
        """Records of these kinds with since_ns <= t_end_ns < until_ns, in the order of their arrival.

        Following ``next_cursor`` neither misses nor repeats a record while records arrive. A cursor of a database that
        no longer exists starts at the first record. Raises ValueError for a text that is not a cursor.
        """
        held = self._store.held()
        window = JournalQuery(
            tuple(kinds),
            seq_after(cursor, held.epoch),
            -LAST if since_ns is None else _within_64_bits(since_ns),
            LAST if until_ns is None else _within_64_bits(until_ns),
            newest_first,
        )
        rows = self.rows(window, held, limit + 1, with_spectra=with_spectra)
        shown = rows[:limit]
        return HistoryPage(
            items=tuple(row.text if with_spectra or not row.boot_ns else without_spectra(row.text) for row in shown),
            next_cursor=f"{held.epoch}-{shown[-1].seq}" if len(rows) > limit else None,
            last_cursor=f"{held.epoch}-{max(row.seq for row in shown)}" if shown else cursor,
        )

    def rows(
        self, window: JournalQuery, held: Held, limit: int, *, with_spectra: bool = True, with_disk: bool = True
    ) -> list[JournalRow]:
        """The first records of a window in their last revision, in memory and, ``with_disk``, on disk.

        ``held`` is taken before: a record that moves to disk in between is then found twice instead of being missed.
        """
        with self._connection() if with_disk else nullcontext() as connection:
            stored = self._stored(connection, window, limit + len(held.rows), with_spectra=with_spectra)
        newest = {row.id: row for row in sorted((*stored, *held.rows), key=lambda row: row.seq)}
        chosen = [row for row in newest.values() if window.holds(row)]
        return sorted(chosen, key=lambda row: row.seq, reverse=window.newest_first)[:limit]

    def understood(self, texts: Iterable[str], parse: Callable[[str], T]) -> list[T]:
        """What ``parse`` makes of each record. One that it cannot read is left out, logged and counted."""
        found = []
        for text in texts:
            try:
                found.append(parse(text))
            except Exception as fault:  # noqa: BLE001 - whatever a record of another shape provokes
                self._store.note_unread(text, fault)
        return found

    estimates = partialmethod(page, BATCHES)  # and rejections

    def entries(self, *, kind: str | None = None, **question: Any) -> HistoryPage:
        """Load events, trips and alarms, each in its last revision, as ``page``; ``kind`` None: all."""
        return self.page(ENTRIES if kind is None else (kind,), **question)

    def follow(self, kinds: Sequence[str], after: str | None, on_news: Callable[[], None]) -> "Follower":
        return self._store.follow(kinds, after, on_news)

    def head(self) -> str:
        return self._store.head()

    def latest(self) -> Latest:
        """The last answer and the last rejection ever accepted."""
        held = self._store.held().rows
        with self._connection() as connection:
            answer, rejection = (self._newest(connection, held, kind) for kind in (ESTIMATE, REJECTION))
            age_s = self._age_s(connection, answer) if answer else None
        return Latest(answer.text if answer else None, rejection.text if rejection else None, age_s)

    def delivery(self, uplink: str, kinds: Sequence[str] = (*BATCHES, *ENTRIES)) -> Delivery:
        """The position up to which ``uplink`` has delivered, as on disk; the cursor is None before its first delivery.

        Waiting records are counted for these ``kinds``.
        """
        with self._connection() as connection:
            return Delivery(None, 0, 0) if connection is None else queries.delivery(connection, uplink, kinds)

    def _stored(
        self, connection: sqlite3.Connection | None, window: JournalQuery, limit: int, *, with_spectra: bool = True
    ) -> list[JournalRow]:
        """Records on disk; none if there is no database yet."""
        if connection is None:
            return []
        return queries.page(connection, window, limit, self._store.note_failed_sum, with_spectra=with_spectra)

    def _newest(
        self, connection: sqlite3.Connection | None, held: Sequence[JournalRow], kind: str
    ) -> JournalRow | None:
        fresh = [row for row in held if row.kind == kind]
        if fresh:
            return fresh[-1]
        found = self._stored(connection, JournalQuery((kind,), newest_first=True), 1)
        return found[0] if found else None

    def _age_s(self, connection: sqlite3.Connection | None, answer: JournalRow) -> float | None:
        boot_id, now_ns = self._store.boot()
        if answer.boot_ns:  # accepted by this very store
            return (now_ns - answer.boot_ns) / NS_PER_S
        if connection is None:
            return None
        sql = "SELECT boot_ns FROM state WHERE estimate = ? AND boot_id = ?"
        found = connection.execute(sql, (answer.seq, boot_id)).fetchone()
        age_s = -1.0 if found is None else (now_ns - int(found[0])) / NS_PER_S
        return age_s if age_s >= 0.0 else None

    @contextmanager
    def _connection(self) -> Iterator[sqlite3.Connection | None]:
        """A connection with the time limit; None if there is no database yet."""
        if not self._store.path.exists():
            yield None
            return
        try:
            with closing(connect_reader(self._store.path)) as connection:
                end_s = time.monotonic() + self._limit_s
                connection.set_progress_handler(lambda: time.monotonic() > end_s, _STEPS_PER_LOOK)
                connection.execute("BEGIN")  # one snapshot for the whole query
                yield connection
        except sqlite3.Error as error:
            raise self._explained(error) from error

    def _explained(self, error: sqlite3.Error) -> Exception:
        if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_INTERRUPT:
            return TimeoutError(f"the question took longer than {self._limit_s:g} s: ask for less at a time")
        self._store.suspect_file(is_damaged=is_damaged(error))
        return StoreError(f"{self._store.path} cannot be read: {error}")


def restored(read: Callable[[], T], otherwise: T) -> T:
    """What ``read`` takes from the journal at a start; ``otherwise``, with a line in the log, if that fails."""
    try:
        return read()
    except Exception as fault:  # noqa: BLE001 - nothing in the journal keeps the service from starting
        log_event(Event.NOT_RESTORED, level=logging.WARNING, fault=str(fault) or repr(fault))
        return otherwise


def seq_after(cursor: str | None, epoch: str) -> int | None:
    """The number in a cursor; None for one of another database. Raises ValueError for a text that is not a cursor."""
    if cursor is None:
        return None
    of_epoch, _, digits = cursor.partition("-")
    if not (of_epoch.isalnum() and digits.isascii() and digits.isdigit() and len(digits) < 19):
        raise ValueError(f"{cursor!r} is not a cursor: take next_cursor of an earlier answer as it is")
    return int(digits) if of_epoch == epoch else None


def _within_64_bits(t_ns: int) -> int:
    """Clip a time to 64 bits: the years 1677 to 2262."""
    return min(max(t_ns, -LAST - 1), LAST)


class Follower:
    """A read position in the journal. One thread reads; any thread may close it.

    An idle follower costs nothing: it has no thread, no connection and sends no query. It reads from disk
    only what is no longer in memory. If a database that was out of reach comes back, records in memory get new numbers
    and the position moves with them. A position in a database that no longer exists starts again at the first record.
    """

    def __init__(
        self,
        buffer: WriteBuffer,
        reader: StoreReader,
        kinds: Sequence[str],
        after: str | None,
        on_news: Callable[[], None],
    ) -> None:
        """Raises ValueError if ``after`` is not a cursor of this program."""
        seq_after(after, buffer.epoch)
        self._buffer, self._reader = buffer, reader
        self._kinds = tuple(kinds)
        self._after = after
        buffer.listen(self, on_news)

    @property
    def place(self) -> str:
        """Cursor of the last record read, or of the place from which it follows."""
        return self._after or f"{self._buffer.epoch}-0"

    def read(self, limit: int) -> list[JournalRecord]:
        """The next records of its kinds in order of their numbers; none if there is nothing new.

        Raises StoreError or TimeoutError.
        """
        held = self._buffer.held()
        seq = self._seq(held.epoch)
        found: list[JournalRecord] = []
        if seq < self._buffer.newest(self._kinds):
            window = JournalQuery(self._kinds, seq)
            rows = self._reader.rows(window, held, limit, with_disk=seq < held.floor)
            found = [JournalRecord(f"{held.epoch}-{row.seq}", row.kind, row.id, row.previous, row.text) for row in rows]
        # After a whole page more may come; otherwise everything up to ``head`` was looked through.
        last = found[-1].number if found else seq
        self._after = f"{held.epoch}-{last if len(found) == limit else max(last, held.head)}"
        return found

    def go_to(self, cursor: str | None) -> None:
        """Continue after another cursor; None: from the first record."""
        self._after = cursor

    def close(self) -> None:
        self._buffer.unlisten(self)

    def _seq(self, epoch: str) -> int:
        seq = seq_after(self._after, epoch)
        if seq is None and self._after is not None:
            before, _, digits = self._after.partition("-")
            seq = self._buffer.place_of(before, int(digits))
        return 0 if seq is None else seq
