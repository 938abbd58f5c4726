"""The tables of the database, the rows written to them, and how the file is opened."""

import re
import sqlite3
import zlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from secrets import token_hex
from typing import Any, Final

from gateway.errors import StoreRefusedError

APPLICATION_ID: Final = 0x53505253  # "SPRS" in the file's header
VERSION: Final = 9  # of the tables; a file of another version is refused

_TABLES: Final = f"""
BEGIN IMMEDIATE;
-- one row: what is true of the whole database
CREATE TABLE state (
    epoch TEXT NOT NULL,
    last_batch INTEGER NOT NULL DEFAULT 0,  -- number of the newest batch
    estimate INTEGER,                       -- number of the newest estimate, and when it was received
    boot_id TEXT,                           -- in which boot of the machine
    boot_ns INTEGER,                        -- how long after it, by a clock that never steps
    doubted_since_ns INTEGER                -- since when the wall clock is doubted
);
CREATE TABLE journal (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    kind TEXT NOT NULL,
    id TEXT NOT NULL UNIQUE,        -- a later record with an id replaces the earlier one
    t_end_ns INTEGER NOT NULL,
    previous INTEGER NOT NULL,      -- number of the batch before this one, 0 where there is none
    received_ns INTEGER NOT NULL,
    text TEXT NOT NULL,
    crc INTEGER NOT NULL            -- CRC-32 of the other columns
);
CREATE INDEX journal_by_kind ON journal (kind, seq);
CREATE INDEX journal_by_time ON journal (kind, t_end_ns);
-- how far each uplink has delivered
CREATE TABLE uplinks (name TEXT PRIMARY KEY, seq INTEGER NOT NULL);
-- how many records retention took from an uplink before it could deliver them
CREATE TABLE pruned (name TEXT, kind TEXT, n INTEGER NOT NULL, PRIMARY KEY (name, kind));
PRAGMA application_id = {APPLICATION_ID};
PRAGMA user_version = {VERSION};
COMMIT;
"""


TABLES: Final = frozenset(re.findall(r"CREATE TABLE (\w+)", _TABLES))


def connect_writer(path: Path) -> sqlite3.Connection:
    """Open the only connection that writes; every commit reaches the disk.

    Raises StoreRefusedError for a file of another version or of another program, sqlite3.Error if the disk fails.
    """
    connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False, timeout=5.0)
    try:
        is_new = _is_new(connection, path)
        connection.execute("PRAGMA auto_vacuum = INCREMENTAL")  # counts for a new file only
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA journal_size_limit = 4194304")
        if is_new:
            connection.executescript(_TABLES)
    except BaseException:
        connection.close()
        raise
    return connection


def why_no_database(directory: Path) -> str | None:
    """Why an existing directory cannot hold a database, found by making one and removing it; None if it can."""
    path = directory / f".springscale-check-{token_hex(8)}.db"
    try:
        connect_writer(path).close()
    except (OSError, sqlite3.Error) as fault:
        return str(fault)
    finally:
        for name in (path.name, f"{path.name}-journal", f"{path.name}-wal", f"{path.name}-shm"):
            with suppress(OSError):
                (directory / name).unlink()
    return None


def connect_reader(path: Path) -> sqlite3.Connection:
    """Open a read-only connection. Raises sqlite3.OperationalError if there is no file."""
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, isolation_level=None, timeout=1.0)
    connection.execute("PRAGMA query_only = ON")
    connection.text_factory = lambda text: text.decode("utf-8", "replace")  # a flipped bit must not abort the query
    return connection


def pragma(connection: sqlite3.Connection, name: str) -> int:
    return int(connection.execute(f"PRAGMA {name}").fetchone()[0])


def _is_new(connection: sqlite3.Connection, path: Path) -> bool:
    """Whether the tables must be created. Raises StoreRefusedError for a file of another program or version."""
    version = pragma(connection, "user_version")
    is_empty = connection.execute("SELECT 1 FROM sqlite_schema LIMIT 1").fetchone() is None
    if is_empty and version == 0:
        return True
    if pragma(connection, "application_id") != APPLICATION_ID:
        raise StoreRefusedError(f"{path} is a database of another program: give [store] directory a place of its own")
    if version != VERSION:
        which = "the newer Springscale again" if version > VERSION else "the Springscale that wrote it"
        raise StoreRefusedError(
            f"{path} has schema {version}, this Springscale knows {VERSION}: install {which} or move the file away"
        )
    return False


@dataclass(frozen=True, slots=True)
class JournalRow:
    """One record. ``seq`` orders all records and never repeats; ``previous`` links batches into a chain.

    ``boot_ns`` is the time of receipt on a monotonic clock (table ``state``); it is no column of the journal.
    """

    seq: int
    kind: str
    id: str
    t_end_ns: int
    previous: int
    received_ns: int
    text: str
    boot_ns: int = 0

    def columns(self) -> tuple[Any, ...]:
        """All but the checksum, in the order of the table."""
        return self.seq, self.kind, self.id, self.t_end_ns, self.previous, self.received_ns, self.text


@dataclass(frozen=True, slots=True)
class DeliveryRow:
    """How far an uplink has delivered: every record up to number ``seq``."""

    name: str
    seq: int


Row = JournalRow | DeliveryRow

JOURNAL_COLUMNS: Final = "seq, kind, id, t_end_ns, previous, received_ns, text"


def checksum(columns: Sequence[Any]) -> int:
    """CRC-32 of a row's columns without the sum itself. Detects every single-bit error and every burst of 32 bits."""
    parts = (column if isinstance(column, bytes) else str(column).encode() for column in columns)
    return zlib.crc32(b"\x1f".join(parts))
