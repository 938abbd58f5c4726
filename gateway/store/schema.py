"""The shape of the database and how an older one is brought up to it."""

import sqlite3
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from gateway.errors import StoreRefusedError

APPLICATION_ID: Final = 0x53505253  # "SPRS" in the file's header

# Entry i turns schema i into schema i + 1. Entries are never edited, only added.
MIGRATIONS: Final[tuple[str, ...]] = (
    """
    CREATE TABLE epochs (id TEXT NOT NULL);
    CREATE TABLE estimates (
        seq INTEGER PRIMARY KEY AUTOINCREMENT,
        id TEXT NOT NULL UNIQUE,
        t_end_ns INTEGER NOT NULL,
        vehicle_id TEXT,
        estimator TEXT NOT NULL,
        calibration_id TEXT,
        is_rejected INTEGER NOT NULL,
        received_ns INTEGER NOT NULL,
        text TEXT NOT NULL
    );
    CREATE INDEX estimates_by_time ON estimates (t_end_ns);
    CREATE INDEX estimates_by_outcome ON estimates (is_rejected, seq);
    CREATE TABLE events (
        seq INTEGER PRIMARY KEY AUTOINCREMENT,
        t_ns INTEGER NOT NULL,
        kind TEXT NOT NULL,
        text TEXT NOT NULL
    );
    CREATE TABLE calibrations (
        id TEXT PRIMARY KEY,
        received_ns INTEGER NOT NULL,
        text TEXT NOT NULL
    );
    """,
    # how far each uplink has delivered, and what retention took from it before it could
    """
    CREATE TABLE uplinks (
        name TEXT PRIMARY KEY,
        seq INTEGER NOT NULL,
        n_pruned INTEGER NOT NULL DEFAULT 0
    );
    CREATE TRIGGER pruned_before_delivery AFTER DELETE ON estimates
    BEGIN
        UPDATE uplinks SET n_pruned = n_pruned + 1 WHERE seq < OLD.seq;
    END;
    """,
    # a sum for each estimate (null: from before there were sums), a place for those that fail it, and since when the
    # wall clock is doubted
    """
    ALTER TABLE estimates ADD COLUMN checksum INTEGER;
    CREATE TABLE damaged (
        n INTEGER PRIMARY KEY AUTOINCREMENT,
        seq INTEGER NOT NULL,
        found_ns INTEGER NOT NULL,
        id BLOB,
        text BLOB
    );
    CREATE INDEX damaged_by_seq ON damaged (seq);
    CREATE TABLE clock (one INTEGER PRIMARY KEY CHECK (one = 1), doubted_since_ns INTEGER);
    DROP TRIGGER pruned_before_delivery;
    CREATE TRIGGER pruned_before_delivery AFTER DELETE ON estimates
    WHEN NOT EXISTS (SELECT 1 FROM damaged WHERE seq = OLD.seq)
    BEGIN
        UPDATE uplinks SET n_pruned = n_pruned + 1 WHERE seq < OLD.seq;
    END;
    """,
    # the number of the estimate accepted before, under its sum (null: from before there was one)
    """
    ALTER TABLE estimates ADD COLUMN previous INTEGER;
    """,
    # load events and trips, each in its last revision, numbered in one row with the estimates
    """
    CREATE TABLE entries (
        seq INTEGER PRIMARY KEY,
        id TEXT NOT NULL,
        kind TEXT NOT NULL,
        t_end_ns INTEGER NOT NULL,
        received_ns INTEGER NOT NULL,
        text TEXT NOT NULL
    );
    CREATE INDEX entries_by_id ON entries (id);
    CREATE INDEX entries_by_time ON entries (kind, t_end_ns);
    CREATE TRIGGER last_revision AFTER INSERT ON entries
    BEGIN
        DELETE FROM entries WHERE id = NEW.id AND seq < NEW.seq;
    END;
    """,
    # how many of those retention took before an uplink could deliver them; a newer revision takes nothing
    """
    ALTER TABLE uplinks ADD COLUMN n_pruned_entries INTEGER NOT NULL DEFAULT 0;
    CREATE TRIGGER entry_pruned_before_delivery AFTER DELETE ON entries
    WHEN NOT EXISTS (SELECT 1 FROM entries WHERE id = OLD.id)
    BEGIN
        UPDATE uplinks SET n_pruned_entries = n_pruned_entries + 1 WHERE seq < OLD.seq;
    END;
    """,
)
FIRST_WITH_SUMS: Final = 3
FIRST_WITH_PREVIOUS: Final = 4
FIRST_WITH_ENTRIES: Final = 5
FIRST_WITH_PRUNED_ENTRIES: Final = 6


def connect_writer(path: Path, migrations: Sequence[str] = MIGRATIONS) -> sqlite3.Connection:
    """The one connection that writes, its schema brought up to date; every commit reaches the disk.

    Raises StoreRefusedError for a file of a newer Springscale or of another program, sqlite3.Error for what
    the disk refuses.
    """
    connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False, timeout=5.0)
    try:
        _refuse_foreign(connection, path, len(migrations))
        connection.execute("PRAGMA auto_vacuum = INCREMENTAL")  # counts for a new file only
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA journal_size_limit = 4194304")
        _migrate(connection, migrations)
    except BaseException:
        connection.close()
        raise
    return connection


def connect_reader(path: Path) -> sqlite3.Connection:
    """A connection that can only read. Raises sqlite3.OperationalError where there is no file."""
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, isolation_level=None, timeout=1.0)
    connection.execute("PRAGMA query_only = ON")
    connection.text_factory = lambda text: text.decode("utf-8", "replace")  # a flipped bit must not end the question
    return connection


def pragma(connection: sqlite3.Connection, name: str) -> int:
    """One of SQLite's numbers about the file."""
    return int(connection.execute(f"PRAGMA {name}").fetchone()[0])


def _refuse_foreign(connection: sqlite3.Connection, path: Path, newest: int) -> None:
    version = pragma(connection, "user_version")
    is_empty = connection.execute("SELECT 1 FROM sqlite_schema LIMIT 1").fetchone() is None
    if pragma(connection, "application_id") != APPLICATION_ID and not (is_empty and version == 0):
        raise StoreRefusedError(f"{path} is a database of another program: give [store] directory a place of its own")
    if version > newest:
        raise StoreRefusedError(
            f"{path} has schema {version}, this Springscale knows {newest}: "
            "install the newer Springscale again or move the file away"
        )


def _migrate(connection: sqlite3.Connection, migrations: Sequence[str]) -> None:
    for version in range(pragma(connection, "user_version"), len(migrations)):
        connection.executescript(
            f"BEGIN IMMEDIATE; {migrations[version]};"
            f"PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {version + 1}; COMMIT;"
        )
