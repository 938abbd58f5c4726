"""The database file for its only writer: open, add, prune, set aside."""

import fcntl
import itertools
import logging
import os
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from gateway.errors import StoreError
from gateway.log import Event, log_event
from gateway.store.journal import BATCHES, ESTIMATE, KINDS, REMAINDER, SERVICE
from gateway.store.queries import INSERT
from gateway.store.retention import AgeClock, Retention, remove_old, remove_share
from gateway.store.schema import (
    TABLES,
    DeliveryRow,
    JournalRow,
    Row,
    checksum,
    connect_writer,
    pragma,
)

FILE_NAME: Final = "springscale.db"
LOCK_NAME: Final = "springscale.lock"
_DAMAGED: Final = {sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB}
MOST_SET_ASIDE: Final = 3  # chosen: damaged databases that are kept, the newest

OnRefused = Callable[[Row, Exception], None]
# epoch, last number, last batch's number, and the newest number of each kind, of an opened database
Opened = tuple[str, int, int, dict[str, int]]


class DamagedError(sqlite3.DatabaseError):
    """SQLite's own check found the file inconsistent."""


def is_damaged(error: Exception) -> bool:
    """Whether the file itself is damaged, as opposed to a failing disk or a record."""
    if isinstance(error, DamagedError):
        return True
    code = getattr(error, "sqlite_errorcode", None)  # absent on errors raised by the Python module itself
    return code is not None and (code & 0xFF) in _DAMAGED


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """A transaction, or a part of the present one, that leaves nothing behind if it fails."""
    is_part = connection.in_transaction
    connection.execute("SAVEPOINT part" if is_part else "BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("RELEASE part" if is_part else "COMMIT")
    except BaseException:
        if connection.in_transaction:  # some failures have rolled back already
            connection.execute("ROLLBACK TO part" if is_part else "ROLLBACK")
        raise


def _identity(path: Path) -> tuple[int, int] | None:
    """Device and inode of a file; None if it does not exist or cannot be read."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino


def _last_number(connection: sqlite3.Connection, table: str) -> int:
    """The highest number ever used in a table."""
    found = connection.execute("SELECT seq FROM sqlite_sequence WHERE name = ?", (table,)).fetchone()
    return 0 if found is None else int(found[0])


class Database:
    """One directory, one lock, one connection. Not thread-safe: the writer owns it."""

    def __init__(self, directory: Path, retention: Retention) -> None:
        self.path = directory / FILE_NAME
        self._retention = retention
        self._connection: sqlite3.Connection | None = None
        self._opened_identity: tuple[tuple[int, int] | None, ...] = ()
        self._age: AgeClock | None = None
        self._is_mended = False
        self._lock_fd: int | None = None
        self.is_replaced = False  # whether somebody took the open file away, or put another in its place

    @property
    def is_open(self) -> bool:
        """Whether the connection is to the files at ``path``, and not to files that were moved or deleted."""
        return self._connection is not None and self._identities() == self._opened_identity

    def open(self, new_epoch: str) -> Opened:
        """Open or create the file. Raises StoreError, OSError or sqlite3.Error; then nothing stays open."""
        # before it is closed: a new file may get the inode of one that nobody has open
        if self._opened_identity and self._identities()[0] != self._opened_identity[0] and not self.is_replaced:
            self.is_replaced = True
            log_event(Event.STORE_REPLACED, level=logging.ERROR, path=str(self.path))
        self.disconnect()
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._lock()
        self._connection = connect_writer(self.path)
        try:
            self.require_tables()
            opened = self._identify(self._connection, new_epoch)
            self._age = AgeClock(self._connection)
            self._is_mended = False
            self._opened_identity = self._identities()
            return opened
        except (OSError, sqlite3.Error):
            self.disconnect()
            raise

    def add(self, rows: Sequence[Row], boot_id: str, on_refused: OnRefused) -> int:
        """Commit rows in one transaction -> number of records stored.

        A row that SQLite refuses, though the database is sound, is passed to ``on_refused`` and left out.
        """
        connection = self._connected()
        stored: list[JournalRow] = []
        with _transaction(connection):
            for row in rows:
                try:
                    with _transaction(connection):
                        _add_row(connection, row)
                except Exception as fault:
                    if not connection.in_transaction or is_damaged(fault) or missing_tables(connection):
                        raise
                    on_refused(row, fault)
                    continue
                if isinstance(row, JournalRow):
                    stored.append(row)
            _keep_receipt(connection, stored, boot_id)
        return sum(row.kind != SERVICE for row in stored)

    def prune(self, now_ns: int) -> int:
        """Remove records that are too old, then the oldest until the size fits -> number of rows removed."""
        connection = self._connected()
        n_removed = 0
        if self._age is not None and self._age.is_believed(now_ns):
            n_removed = remove_old(connection, self._retention, now_ns)
        while self.size_bytes() > self._retention.max_bytes:
            n = remove_share(connection)
            if n == 0:
                break
            n_removed += n
        if n_removed:
            connection.execute("PRAGMA incremental_vacuum").fetchall()
        return n_removed

    def size_bytes(self) -> int:
        """Bytes in use, free pages not counted."""
        connection = self._connected()
        n_pages = pragma(connection, "page_count") - pragma(connection, "freelist_count")
        return n_pages * pragma(connection, "page_size")

    def require_tables(self) -> None:
        """Raise DamagedError for a file that lacks one of its tables."""
        if missing := missing_tables(self._connected()):
            raise DamagedError(f"it has no table {' and no '.join(missing)}")

    def mend(self) -> bool:
        """Rebuild the indexes of a file that is otherwise sound, once for each opening -> whether it was done."""
        connection = self._connection
        if connection is None or self._is_mended:
            return False
        self._is_mended = True
        try:
            if connection.execute("PRAGMA quick_check(1)").fetchone()[0] != "ok":
                return False
            connection.execute("REINDEX")
        except sqlite3.DatabaseError:  # two rows with one id are among it
            return False
        return True

    def disconnect(self) -> None:
        """Close the connection and keep the lock."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()

    def close(self) -> None:
        """Close the connection and release the lock of the directory."""
        self.disconnect()
        self._unlock()

    def set_aside(self) -> str:
        """Rename the file with its WAL and shared-memory files -> the new name. Raises OSError."""
        self.disconnect()
        self._opened_identity = ()
        stem = f"{FILE_NAME}.damaged-{datetime.now(UTC):%Y%m%dT%H%M%S}"
        names = (f"{stem}-{n}" if n else stem for n in itertools.count())
        name = next(name for name in names if not self.path.with_name(name).exists())
        for suffix in ("-wal", "-shm", ""):  # the file itself last: until then the next try finds it again
            companion = self.path.with_name(FILE_NAME + suffix)
            if companion.exists():
                companion.rename(self.path.with_name(name + suffix))
        self._forget_oldest_aside()
        return name

    def _forget_oldest_aside(self) -> None:
        """Remove old damaged files: a failing memory card keeps producing them."""
        whole = [
            file for file in self.path.parent.glob(f"{FILE_NAME}.damaged-*") if not file.name.endswith(("-wal", "-shm"))
        ]
        for file in sorted(whole, key=lambda file: (file.stat().st_ctime_ns, file.name))[:-MOST_SET_ASIDE]:
            for suffix in ("-wal", "-shm", ""):
                file.with_name(file.name + suffix).unlink(missing_ok=True)
            log_event(Event.STORE_FORGETS, level=logging.WARNING, removed=file.name)

    def _identities(self) -> tuple[tuple[int, int] | None, ...]:
        """Identities of the file, its WAL and its shared memory: without the WAL, readers miss the newest records."""
        return tuple(_identity(self.path.with_name(FILE_NAME + suffix)) for suffix in ("", "-wal", "-shm"))

    def _connected(self) -> sqlite3.Connection:
        if self._connection is None:
            raise StoreError(f"{self.path} is not open")
        return self._connection

    def _lock(self) -> None:
        """Hold the lock file that lies in the directory now: the one held before may have been taken away."""
        path = self.path.with_name(LOCK_NAME)
        if self._lock_fd is not None:
            held = os.fstat(self._lock_fd)
            if _identity(path) == (held.st_dev, held.st_ino):
                return
            self._unlock()
        lock_fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o640)
        try:
            fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock_fd)
            raise StoreError(
                f"another Springscale uses {self.path.parent}: stop it or set another [store] directory"
            ) from None
        self._lock_fd = lock_fd

    def _unlock(self) -> None:
        lock_fd, self._lock_fd = self._lock_fd, None
        if lock_fd is not None:
            os.close(lock_fd)

    @staticmethod
    def _identify(connection: sqlite3.Connection, new_epoch: str) -> Opened:
        known = connection.execute("SELECT epoch, last_batch FROM state").fetchone()
        if known is None:
            connection.execute("INSERT INTO state (epoch) VALUES (?)", (new_epoch,))
        epoch, last_batch = known or (new_epoch, 0)
        sql = "SELECT max(seq) FROM journal WHERE kind = ?"
        newest = {kind: connection.execute(sql, (kind,)).fetchone()[0] or 0 for kind in (*KINDS, REMAINDER)}
        return epoch, _last_number(connection, "journal"), last_batch, newest


def missing_tables(connection: sqlite3.Connection) -> list[str]:
    """Tables that the file should have and has not."""
    found = {name for (name,) in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")}
    return sorted(TABLES - found)


def _add_row(connection: sqlite3.Connection, row: Row) -> None:
    if isinstance(row, DeliveryRow):
        sql = "INSERT INTO uplinks (name, seq) VALUES (?, ?) ON CONFLICT (name) DO UPDATE SET seq = excluded.seq"
        connection.execute(sql, (row.name, row.seq))
    else:
        columns = row.columns()
        connection.execute(INSERT, (*columns, checksum(columns)))


def _keep_receipt(connection: sqlite3.Connection, stored: Sequence[JournalRow], boot_id: str) -> None:
    """Store the time of receipt of the newest estimate, and the number of the newest batch."""
    batches = [row for row in stored if row.kind in BATCHES]
    if batches:
        connection.execute("UPDATE state SET last_batch = ?", (batches[-1].seq,))
    estimates = [row for row in batches if row.kind == ESTIMATE]
    if estimates:
        receipt = estimates[-1].seq, boot_id, estimates[-1].boot_ns
        connection.execute("UPDATE state SET estimate = ?, boot_id = ?, boot_ns = ?", receipt)
