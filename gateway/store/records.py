"""Stored estimates with the sum that tells whether they are as they were written; bad ones are passed over."""

import json
import sqlite3
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from gateway.store.rows import EstimateRow
from gateway.store.schema import FIRST_WITH_PREVIOUS, FIRST_WITH_SUMS, pragma

_LAST: Final = (1 << 63) - 1
_COLUMNS: Final = (
    "seq, CAST(id AS BLOB), t_end_ns, CAST(vehicle_id AS BLOB), CAST(estimator AS BLOB),"
    " CAST(calibration_id AS BLOB), is_rejected, {previous}, received_ns, CAST(text AS BLOB), {checksum}"
)
_PREVIOUS: Final = 7  # its place among them
# SQLite would end the whole question over a text that is no JSON
_WITHOUT_SPECTRA: Final = "CASE WHEN json_valid(text) THEN CAST(json_remove(text, '$.spectra') AS BLOB) END"

Stored = tuple[Any, ...]  # a row as SQLite gives it: every text as bytes, for a flipped bit makes it no UTF-8


@dataclass(frozen=True, slots=True)
class Good:
    """What a good row holds. ``previous`` is None for one from before the chain."""

    text: str
    previous: int | None


@dataclass(frozen=True, slots=True)
class Window:
    """Which rows are asked for; ``after_seq`` None: from the first, or the last."""

    after_seq: int | None
    since_ns: int | None
    until_ns: int | None
    newest_first: bool

    def holds(self, row: EstimateRow) -> bool:
        if not (self.since_ns or -_LAST) <= row.t_end_ns < (_LAST if self.until_ns is None else self.until_ns):
            return False
        if self.after_seq is None:
            return True
        return row.seq < self.after_seq if self.newest_first else row.seq > self.after_seq


def checksum(fields: Sequence[Any]) -> int:
    """CRC-32 of a row's fields, the sum itself left out: finds every single flipped bit, and any burst of 32."""
    return zlib.crc32(b"\x1f".join(_as_bytes(field) for field in fields))


def _as_bytes(field: Any) -> bytes:
    if isinstance(field, bytes):
        return field
    return b"\x00" if field is None else str(int(field) if isinstance(field, bool) else field).encode()


def is_good(row: Stored) -> bool:
    """Whether a row is as it was written: by its sum; from before there were sums, by what its JSON repeats."""
    *fields, known = row
    if fields[_PREVIOUS] is None:  # from before there was one: its sum knows nothing of it
        del fields[_PREVIOUS]
    return checksum(fields) == known if known is not None else _agrees_with_its_json(fields)


def _agrees_with_its_json(fields: Sequence[Any]) -> bool:
    try:
        _, record_id, t_end_ns, vehicle_id, estimator, calibration_id, is_rejected, received_ns, text = fields
        record = json.loads(text.decode())
        said = (record["id"], record["vehicle_id"], record["estimator"], record["calibration_id"])
        in_columns = tuple(column and column.decode() for column in (record_id, vehicle_id, estimator, calibration_id))
        is_same = (record["t_end_ns"], bool(record["rejected"])) == (t_end_ns, bool(is_rejected))
        return said == in_columns and is_same and isinstance(received_ns, int)
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError):
        return False


def page(
    connection: sqlite3.Connection, window: Window, limit: int, with_spectra: bool
) -> tuple[dict[int, Good], list[int]]:
    """Up to ``limit`` good rows by number, and the numbers of bad ones met on the way."""
    good: dict[int, Good] = {}
    bad: list[int] = []
    shown = "NULL" if with_spectra else _WITHOUT_SPECTRA
    after = window.after_seq
    while len(good) < limit:
        wanted = limit - len(good)
        found = _rows_behind(connection, window, after, wanted, shown)
        for *row, without_spectra in found:
            text = row[-2] if with_spectra else without_spectra
            if text is not None and is_good(tuple(row)):
                good[row[0]] = Good(text.decode(), row[_PREVIOUS])
            else:
                bad.append(row[0])
        if len(found) < wanted:
            break
        after = found[-1][0]
    return good, bad


def newest(connection: sqlite3.Connection, is_rejected: bool) -> tuple[tuple[int, str] | None, list[int]]:
    """(received_ns, text) of the newest good row of one outcome, and the numbers of bad ones met on the way."""
    bad: list[int] = []
    last = _LAST
    sql = f"""SELECT {_columns(connection)} FROM estimates
        WHERE is_rejected = ? AND seq < ? ORDER BY seq DESC LIMIT 1"""
    while (row := connection.execute(sql, (is_rejected, last)).fetchone()) is not None:
        if is_good(row):
            return (row[-3], row[-2].decode()), bad
        last = row[0]
        bad.append(last)
    return None, bad


def stored_row(connection: sqlite3.Connection, seq: int) -> Stored | None:
    """One row as it is in the file."""
    sql = f"SELECT {_columns(connection)} FROM estimates WHERE seq = ?"
    found: Stored | None = connection.execute(sql, (seq,)).fetchone()
    return found


def _rows_behind(
    connection: sqlite3.Connection, window: Window, after: int | None, limit: int, shown: str
) -> list[tuple[Any, ...]]:
    beyond, order = ("<", "DESC") if window.newest_first else (">", "ASC")
    is_timed = window.since_ns is not None or window.until_ns is not None
    index = "INDEXED BY estimates_by_time" if is_timed else "NOT INDEXED"
    start = after if after is not None else (_LAST if window.newest_first else -_LAST)
    since_ns = -_LAST if window.since_ns is None else window.since_ns
    until_ns = _LAST if window.until_ns is None else window.until_ns
    sql = f"""
        SELECT {_columns(connection)}, {shown} FROM estimates WHERE seq IN (
            SELECT seq FROM estimates {index}
            WHERE seq {beyond} ? AND t_end_ns >= ? AND t_end_ns < ? ORDER BY seq {order} LIMIT ?
        ) ORDER BY seq {order}
        """
    return connection.execute(sql, (start, since_ns, until_ns, limit)).fetchall()


def _columns(connection: sqlite3.Connection) -> str:
    """An older file on a disk that refuses to be written has not been brought up to date."""
    version = pragma(connection, "user_version")
    return _COLUMNS.format(
        previous="previous" if version >= FIRST_WITH_PREVIOUS else "NULL",
        checksum="checksum" if version >= FIRST_WITH_SUMS else "NULL",
    )
