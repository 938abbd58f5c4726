"""Answers from the store: read-only, bounded in time, blind to nothing that was accepted."""

import json
import sqlite3
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gateway.errors import StoreError
from gateway.history import Delivery, Page
from gateway.records import json_line
from gateway.store import records
from gateway.store.database import is_damaged
from gateway.store.delivery import delivery
from gateway.store.entries import EntryWindow, entries
from gateway.store.rows import Chain, EntryRow, EstimateRow
from gateway.store.schema import connect_reader
from gateway.units import NS_PER_S

QUERY_LIMIT_S: Final = 2.0
_STEPS_PER_LOOK: Final = 10_000  # SQLite instructions between two looks at the clock
_FIRST_NS: Final = -(1 << 63)
_LAST_NS: Final = (1 << 63) - 1

HeldEstimates = Callable[[], tuple[str, tuple[EstimateRow, ...]]]
HeldEntries = Callable[[], tuple[str, tuple[EntryRow, ...]]]


@dataclass(frozen=True, slots=True)
class Latest:
    """The last answer and the last rejection, as JSON; age_s of the answer by the wall clock."""

    estimate: str | None
    rejection: str | None
    age_s: float | None


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to the service; ``detail`` is JSON."""

    t_ns: int
    kind: str
    detail: str


class StoreReader:
    """Read-only view of a store, safe in any thread.

    Each question opens its own connection, so no handle outlives a database that was set aside. A
    question that takes longer than ``limit_s`` raises TimeoutError; a database that cannot be read
    raises StoreError. ``on_damage``, ``on_bad_records`` and ``on_lost`` hear what a question met on its way.
    """

    def __init__(
        self,
        path: Path,
        held: HeldEstimates,
        held_entries: HeldEntries,
        clock_ns: Callable[[], int],
        on_damage: Callable[[], None],
        on_bad_records: Callable[[Sequence[int]], None],
        on_lost: Callable[[], None],
        limit_s: float = QUERY_LIMIT_S,
    ) -> None:
        self._path = path
        self._held = held
        self._held_entries = held_entries
        self._clock_ns = clock_ns
        self._on_damage = on_damage
        self._on_bad_records = on_bad_records
        self._on_lost = on_lost
        self._limit_s = limit_s

    def estimates(
        self,
        *,
        since_ns: int | None = None,
        until_ns: int | None = None,
        limit: int = 100,
        cursor: str | None = None,
        newest_first: bool = False,
        with_spectra: bool = True,
    ) -> Page:
        """Estimates and rejections with since_ns <= t_end_ns < until_ns, in the order of their arrival.

        Following ``next_cursor`` misses nothing and repeats nothing while rows arrive. A cursor of a
        database that is gone begins from the first row. Raises ValueError for a cursor we never gave.
        """
        # What is held must be read before the file: a row that moves to disk meanwhile is then seen twice
        # and merged by its number, instead of not at all.
        epoch, held = self._held()
        window = records.Window(
            _seq_after(cursor, epoch),
            None if since_ns is None else _within_64_bits(since_ns),
            None if until_ns is None else _within_64_bits(until_ns),
            newest_first,
        )
        with self._connection() as connection:
            found = ({}, []) if connection is None else records.page(connection, window, limit + 1, with_spectra)
            rows, bad = found
            fresh = [row for row in _not_stored(connection, held) if window.holds(row)]
        self._tell_bad(bad)
        rows |= {
            row.seq: records.Good(row.text if with_spectra else _without_spectra(row.text), row.previous)
            for row in fresh
        }
        seqs = sorted(rows, reverse=newest_first)
        shown = seqs[:limit]
        cursors = tuple(f"{epoch}-{seq}" for seq in shown)
        newest = 0 if newest_first else -1
        return Page(
            items=tuple(rows[seq].text for seq in shown),
            cursors=cursors,
            previous=tuple(rows[seq].previous for seq in shown),
            next_cursor=cursors[-1] if len(seqs) > limit else None,
            last_cursor=cursors[newest] if shown else cursor,
        )

    def entries(
        self,
        *,
        kind: str | None = None,
        since_ns: int | None = None,
        until_ns: int | None = None,
        limit: int = 100,
        cursor: str | None = None,
        upto: str | None = None,
        newest_first: bool = False,
    ) -> Page:
        """Load events and trips, each in its last revision, with since_ns <= t_end_ns < until_ns, as they came.

        Cursors are of one row with those of estimates. Raises ValueError for a cursor we never gave.
        """
        epoch, held = self._held_entries()
        window = EntryWindow(
            kind,
            _seq_after(cursor, epoch),
            _seq_after(upto, epoch),
            None if since_ns is None else _within_64_bits(since_ns),
            None if until_ns is None else _within_64_bits(until_ns),
            newest_first,
        )
        with self._connection() as connection:
            found = entries(connection, held, window, limit + 1)
        shown = found[:limit]
        cursors = tuple(f"{epoch}-{seq}" for seq, _, _ in shown)
        return Page(
            items=tuple(text for _, _, text in shown),
            cursors=cursors,
            previous=(None,) * len(shown),
            next_cursor=cursors[-1] if len(found) > limit else None,
            last_cursor=cursors[0 if newest_first else -1] if shown else cursor,
        )

    def latest(self) -> Latest:
        """The last answer and the last rejection ever accepted."""
        _, held = self._held()
        with self._connection() as connection:
            answer, rejection = (
                _newest_held(held, is_rejected) or self._newest_stored(connection, is_rejected)
                for is_rejected in (False, True)
            )
        return Latest(
            estimate=None if answer is None else answer[1],
            rejection=None if rejection is None else rejection[1],
            age_s=None if answer is None else max(0.0, (self._clock_ns() - answer[0]) / NS_PER_S),
        )

    def events(self, limit: int = 100) -> list[Event]:
        """The last things that happened to the service and are on disk, newest first."""
        rows = self._ask("SELECT t_ns, kind, text FROM events ORDER BY seq DESC LIMIT ?", (limit,))
        return [Event(*row) for row in rows]

    def calibration(self, calibration_id: str) -> str | None:
        """A calibration's JSON by its hash."""
        rows = self._ask("SELECT text FROM calibrations WHERE id = ?", (calibration_id,))
        return rows[0][0] if rows else None

    def delivery(self, uplink: str, *, kinds: Sequence[str] = (), with_estimates: bool = True) -> Delivery:
        """How far ``uplink`` has delivered, as it is on disk; the cursor is None before its first delivery.

        What waits is counted of estimates, and of entries of these ``kinds``.
        """
        with self._connection() as connection:
            if connection is None:
                return Delivery(None, 0, 0)
            return delivery(connection, uplink, kinds, with_estimates=with_estimates, now_ns=self._clock_ns())

    def _newest_stored(self, connection: sqlite3.Connection | None, is_rejected: bool) -> tuple[int, str] | None:
        if connection is None:
            return None
        answer, bad = records.newest(connection, is_rejected)
        self._tell_bad(bad)
        return answer

    def _tell_bad(self, seqs: Sequence[int]) -> None:
        if seqs:
            self._on_bad_records(seqs)

    def _ask(self, sql: str, parameters: tuple[Any, ...]) -> list[tuple[Any, ...]]:
        with self._connection() as connection:
            return [] if connection is None else connection.execute(sql, parameters).fetchall()

    @contextmanager
    def _connection(self) -> Iterator[sqlite3.Connection | None]:
        """A connection under the time limit; None where there is no database (yet)."""
        if not self._path.exists():
            yield None
            return
        try:
            with closing(connect_reader(self._path)) as connection:
                self._limit_time(connection)
                connection.execute("BEGIN")  # one snapshot for all that one question looks at
                yield connection
        except sqlite3.Error as error:
            raise self._explained(error) from error

    def _limit_time(self, connection: sqlite3.Connection) -> None:
        end_s = time.monotonic() + self._limit_s
        connection.set_progress_handler(lambda: time.monotonic() > end_s, _STEPS_PER_LOOK)

    def _explained(self, error: sqlite3.Error) -> Exception:
        if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_INTERRUPT:
            return TimeoutError(f"the question took longer than {self._limit_s:g} s: ask for less at a time")
        if is_damaged(error):
            self._on_damage()
        else:
            self._on_lost()
        return StoreError(f"{self._path} cannot be read: {error}")


def _seq_after(cursor: str | None, epoch: str) -> int | None:
    if cursor is None:
        return None
    of_epoch, _, digits = cursor.partition("-")
    if not (of_epoch.isalnum() and digits.isascii() and digits.isdigit() and len(digits) < 19):
        raise ValueError(f"{cursor!r} is not a cursor: take next_cursor of an earlier answer as it is")
    return int(digits) if of_epoch == epoch else None


def _within_64_bits(t_ns: int) -> int:
    """Years before 1677 and after 2262 mean the first and the last instant there is."""
    return min(max(t_ns, _FIRST_NS), _LAST_NS)


def _not_stored(connection: sqlite3.Connection | None, held: Sequence[EstimateRow]) -> Iterator[EstimateRow]:
    """Those of the held rows that are not on disk: neither moved there meanwhile nor there already as another row."""
    chain = Chain()
    known: dict[str, int] = {}
    for row in map(chain.linked, held):
        on_disk = connection and connection.execute("SELECT seq FROM estimates WHERE id = ?", (row.id,)).fetchone()
        if known.setdefault(row.id, on_disk[0] if on_disk else row.seq) != row.seq:
            chain.skip(row)
        elif not on_disk:
            yield row


def _newest_held(held: tuple[EstimateRow, ...], is_rejected: bool) -> tuple[int, str] | None:
    """(received_ns, text) of the newest row of one outcome that is not on disk yet."""
    of_outcome = [row for row in held if row.is_rejected is is_rejected]
    return (of_outcome[-1].received_ns, of_outcome[-1].text) if of_outcome else None


def _without_spectra(text: str) -> str:
    record = json.loads(text)
    record.pop("spectra", None)
    return json_line(record)
