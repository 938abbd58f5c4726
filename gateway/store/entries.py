"""Load events and trips on disk: the last revision of each, numbered in one row with the estimates they came from."""

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Final

from gateway.store.rows import EntryRow
from gateway.store.schema import FIRST_WITH_ENTRIES, pragma

_LAST: Final = (1 << 63) - 1


@dataclass(frozen=True, slots=True)
class EntryWindow:
    """Which entries are asked for; ``kind`` None: all. Numbers (after, upto] or, newest first, [.., after)."""

    kind: str | None = None
    after_seq: int | None = None
    upto_seq: int | None = None
    since_ns: int | None = None
    until_ns: int | None = None
    newest_first: bool = False

    def holds(self, row: EntryRow) -> bool:
        if self.kind is not None and row.kind != self.kind:
            return False
        if not (self.since_ns or -_LAST) <= row.t_end_ns < (_LAST if self.until_ns is None else self.until_ns):
            return False
        if self.upto_seq is not None and row.seq > self.upto_seq:
            return False
        if self.after_seq is None:
            return True
        return row.seq < self.after_seq if self.newest_first else row.seq > self.after_seq


def entries(
    connection: sqlite3.Connection | None, held: Sequence[EntryRow], window: EntryWindow, limit: int
) -> list[tuple[int, str, str]]:
    """Number, kind and JSON of up to ``limit`` entries, each in its last revision, stored or still held."""
    newest = {row.id: row for row in held}
    stored = [] if connection is None else _stored(connection, window, limit + len(newest))
    rows = [(seq, kind, text) for seq, entry_id, kind, text in stored if entry_id not in newest]
    rows += [(row.seq, row.kind, row.text) for row in newest.values() if window.holds(row)]
    return sorted(rows, reverse=window.newest_first)[:limit]


def _stored(connection: sqlite3.Connection, window: EntryWindow, limit: int) -> list[tuple[int, str, str, str]]:
    """The first so many on disk whose JSON is whole; none in a file from before there were any.

    A broken one is passed over before they are counted: a page with a gap would look like the last.
    """
    if pragma(connection, "user_version") < FIRST_WITH_ENTRIES:
        return []
    beyond, order = ("<", "DESC") if window.newest_first else (">", "ASC")
    start = window.after_seq if window.after_seq is not None else (_LAST if window.newest_first else -_LAST)
    sql = f"""SELECT seq, id, kind, text FROM entries
        WHERE seq {beyond} ? AND seq <= ? AND t_end_ns >= ? AND t_end_ns < ? AND (? IS NULL OR kind = ?)
        ORDER BY seq {order}"""
    asked = (
        start,
        _LAST if window.upto_seq is None else window.upto_seq,
        -_LAST if window.since_ns is None else window.since_ns,
        _LAST if window.until_ns is None else window.until_ns,
        window.kind,
        window.kind,
    )
    return list(islice((row for row in connection.execute(sql, asked) if _is_whole(row[-1])), limit))


def _is_whole(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except ValueError:
        return False
