"""Queries to the journal on disk: pages of records, the newest of a kind, the position of an uplink."""

import json
import sqlite3
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from gateway.records import json_line
from gateway.store.journal import SERVICE, Delivery
from gateway.store.schema import JOURNAL_COLUMNS, JournalRow, checksum

LAST: Final = (1 << 63) - 1  # SQLite's largest integer
# Read texts as bytes: a flipped bit may break UTF-8, and the checksum covers the bytes on disk.
_STORED: Final = (
    "seq, CAST(kind AS BLOB), CAST(id AS BLOB), t_end_ns, previous, received_ns, CAST(text AS BLOB), crc, "
    f"kind = '{SERVICE}' OR (json_valid(text) AND substr(text, 1, 1) = '{{')"
)
# SQLite would abort the whole query at a text that is not JSON.
_WITHOUT_SPECTRA: Final = "CASE WHEN json_valid(text) THEN CAST(json_remove(text, '$.spectra') AS BLOB) END"

OnBad = Callable[[int], None]
Stored = tuple[Any, ...]  # a row of the journal as SQLite gives it


@dataclass(frozen=True, slots=True)
class JournalQuery:
    """Selection of records; ``after_seq`` None: from the first, or from the last if ``newest_first``."""

    kinds: tuple[str, ...]
    after_seq: int | None = None
    since_ns: int = -LAST
    until_ns: int = LAST
    newest_first: bool = False

    def holds(self, row: JournalRow) -> bool:
        if row.kind not in self.kinds or not self.since_ns <= row.t_end_ns < self.until_ns:
            return False
        if self.after_seq is None:
            return True
        return row.seq < self.after_seq if self.newest_first else row.seq > self.after_seq


def is_good(row: Stored) -> bool:
    """Whether a row has the checksum that was written with it, and is a JSON object."""
    *columns, crc, is_object = row
    return bool(is_object) and checksum(columns) == crc


def page(
    connection: sqlite3.Connection, window: JournalQuery, limit: int, on_bad: OnBad, *, with_spectra: bool = True
) -> list[JournalRow]:
    """Up to ``limit`` records with a valid checksum; the number of each other one is passed to ``on_bad``."""
    shown = "NULL" if with_spectra else _WITHOUT_SPECTRA
    good: list[JournalRow] = []
    after = window.after_seq
    while len(good) < limit:
        wanted = limit - len(good)
        found = _rows_behind(connection, window, after, wanted, shown)
        for *stored, bare in found:
            row = tuple(stored)
            if is_good(row):
                good.append(_decoded(row if bare is None else (*row[:-3], bare, *row[-2:])))
            else:
                on_bad(row[0])
        if len(found) < wanted:
            break
        after = found[-1][0]
    return good


def delivery(connection: sqlite3.Connection, uplink: str, kinds: Sequence[str]) -> Delivery:
    """The position of an uplink on disk, with the number of waiting records of these kinds."""
    epoch = connection.execute("SELECT epoch FROM state").fetchone()
    found = connection.execute("SELECT seq FROM uplinks WHERE name = ?", (uplink,)).fetchone()
    seq = found[0] if found else -1
    marks = ", ".join("?" * len(kinds))
    sql = f"SELECT coalesce(sum(n), 0) FROM pruned WHERE kind IN ({marks}) AND name = ?"
    (n_pruned,) = connection.execute(sql, (*kinds, uplink)).fetchone()
    n, first = connection.execute(
        f"SELECT count(*), min(seq) FROM journal WHERE kind IN ({marks}) AND seq > ?", (*kinds, seq)
    ).fetchone()
    oldest = connection.execute("SELECT CAST(received_ns AS INTEGER) FROM journal WHERE seq = ?", (first,)).fetchone()
    return Delivery(
        cursor=f"{epoch[0]}-{seq}" if found and epoch else None,
        n_pruned=n_pruned,
        n_waiting=n,
        oldest_ns=None if oldest is None else oldest[0],
    )


def count_pruned(connection: sqlite3.Connection, condition: str, asked: tuple[object, ...]) -> None:
    """Add the rows under ``condition``, which will be removed, to the counts of each uplink that lacks them."""
    connection.execute(
        "INSERT INTO pruned (name, kind, n) SELECT name, kind, count(*) FROM uplinks, journal"
        f" WHERE journal.seq > uplinks.seq AND {condition} GROUP BY name, kind"
        " ON CONFLICT (name, kind) DO UPDATE SET n = n + excluded.n",
        asked,
    )


def without_spectra(text: str) -> str:
    record = json.loads(text)
    record.pop("spectra", None)
    return json_line(record)


def _rows_behind(
    connection: sqlite3.Connection, window: JournalQuery, after: int | None, limit: int, shown: str
) -> list[Stored]:
    """Find the next numbers of each kind in an index, then read only the rows of the result."""
    beyond, order = ("<", "DESC") if window.newest_first else (">", "ASC")
    start = after if after is not None else (LAST if window.newest_first else -LAST)
    times: tuple[int, ...] = (window.since_ns, window.until_ns)
    index, within = "journal_by_time", "AND t_end_ns >= ? AND t_end_ns < ?"
    if times == (-LAST, LAST):
        index, within, times = "journal_by_kind", "", ()
    of_kind = (
        f"SELECT seq FROM (SELECT seq FROM journal INDEXED BY {index}"
        f" WHERE kind = ? AND seq {beyond} ? {within} ORDER BY seq {order} LIMIT ?)"
    )
    sql = f"""
        SELECT {_STORED}, {shown} FROM journal WHERE seq IN (
            SELECT seq FROM ({" UNION ALL ".join([of_kind] * len(window.kinds))}) ORDER BY seq {order} LIMIT ?
        ) ORDER BY seq {order}
        """
    asked = [value for kind in window.kinds for value in (kind, start, *times, limit)]
    return connection.execute(sql, (*asked, limit)).fetchall()


def _decoded(row: Stored) -> JournalRow:
    seq, kind, record_id, t_end_ns, previous, received_ns, text, *_ = row
    return JournalRow(seq, kind.decode(), record_id.decode(), t_end_ns, previous, received_ns, text.decode())


INSERT: Final = f"INSERT OR REPLACE INTO journal ({JOURNAL_COLUMNS}, crc) VALUES (?, ?, ?, ?, ?, ?, ?, ?)"
