"""The database file as its one writer sees it: open, add, prune, set aside."""

import fcntl
import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from gateway.errors import StoreError
from gateway.store.rows import EstimateRow, Row, bound
from gateway.store.schema import connect_writer, pragma
from gateway.units import NS_PER_S

FILE_NAME: Final = "springscale.db"
LOCK_NAME: Final = "springscale.lock"
_DAMAGED: Final = {sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB}
_CLOCK_UNSET_NS: Final = 1_577_836_800 * NS_PER_S  # 2020: an earlier clock was never set (no RTC battery)
_PRUNE_SHARE: Final = 0.05  # of the rows, removed at a time until the size fits


@dataclass(frozen=True, slots=True)
class Retention:
    """How much is kept.

    max_age_s counts from receipt; max_bytes bounds the database without its write-ahead log (which
    stays under about 8 MB); max_held bounds the rows kept in memory while the disk refuses.
    """

    max_age_s: float = 400 * 86_400.0
    max_bytes: int = 1_000_000_000
    max_held: int = 2048

    def __post_init__(self) -> None:
        if self.max_age_s <= 0 or self.max_bytes < 1_000_000 or self.max_held < 1:
            raise StoreError(
                f"cannot keep {self}: max_age_s must be positive, max_bytes at least 1000000 and max_held at least 1"
            )


@dataclass(frozen=True, slots=True)
class Opened:
    """Whose numbers an opened database continues."""

    epoch: str
    last_seq: int


class DamagedError(sqlite3.DatabaseError):
    """SQLite's own check found the file inconsistent."""


def is_damaged(error: sqlite3.Error) -> bool:
    """True where the file itself is broken, not merely refused by the disk."""
    if isinstance(error, DamagedError):
        return True
    code = getattr(error, "sqlite_errorcode", None)  # absent on errors raised by the Python module itself
    return code is not None and (code & 0xFF) in _DAMAGED


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """All or nothing; after a failure the connection can go on."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except sqlite3.Error:
        if connection.in_transaction:  # some failures have rolled back already
            connection.execute("ROLLBACK")
        raise


def _identity(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_dev, status.st_ino


class Database:
    """One directory, one lock, one connection. Not thread-safe: the writer owns it."""

    def __init__(self, directory: Path, retention: Retention) -> None:
        self.path = directory / FILE_NAME
        self._retention = retention
        self._connection: sqlite3.Connection | None = None
        self._opened_identity = (0, 0)
        self._lock_fd: int | None = None

    @property
    def is_open(self) -> bool:
        """True while connected to the very file that lies at ``path``: not to one that was moved or deleted."""
        if self._connection is None:
            return False
        try:
            return _identity(self.path) == self._opened_identity
        except OSError:
            return False

    def open(self, new_epoch: str) -> Opened:
        """Open or create the file. Raises StoreError, OSError or sqlite3.Error; then nothing stays open."""
        self.disconnect()
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._lock()
        self._connection = connect_writer(self.path)
        try:
            self._opened_identity = _identity(self.path)
            return self._identify(self._connection, new_epoch)
        except (OSError, sqlite3.Error):
            self.disconnect()
            raise

    def add(self, rows: Sequence[Row]) -> tuple[int, int]:
        """Commit rows in one transaction -> (rows that are new, estimates that were there already)."""
        connection = self._connected()
        n_new = n_known = 0
        with _transaction(connection):
            for row in rows:
                is_new = connection.execute(row.INSERT, bound(row)).rowcount > 0
                n_new += is_new
                n_known += isinstance(row, EstimateRow) and not is_new
        return n_new, n_known

    def prune(self, now_ns: int) -> int:
        """Remove what is too old, then the oldest until the size fits -> rows removed."""
        connection = self._connected()
        n_removed = self._prune_old(connection, now_ns)
        while self.size_bytes() > self._retention.max_bytes:
            n = self._prune_share(connection)
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

    def check(self) -> None:
        """Look through the whole file. Raises DamagedError."""
        verdict = self._connected().execute("PRAGMA quick_check(1)").fetchone()[0]
        if verdict != "ok":
            raise DamagedError(verdict)

    def disconnect(self) -> None:
        """Close the connection and keep the lock."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()

    def close(self) -> None:
        """Close the connection and give the directory free."""
        self.disconnect()
        if self._lock_fd is not None:
            os.close(self._lock_fd)
            self._lock_fd = None

    def set_aside(self) -> str:
        """Rename the file and its companions out of the way -> the new name. Raises OSError."""
        self.disconnect()
        stem = f"{FILE_NAME}.damaged-{datetime.now(UTC):%Y%m%dT%H%M%S}"
        taken = len(list(self.path.parent.glob(f"{stem}*")))
        name = f"{stem}-{taken}" if taken else stem
        for suffix in ("-wal", "-shm", ""):  # the file itself last: until then the next try finds it again
            companion = self.path.with_name(FILE_NAME + suffix)
            if companion.exists():
                companion.rename(self.path.with_name(name + suffix))
        return name

    def _connected(self) -> sqlite3.Connection:
        if self._connection is None:
            raise StoreError(f"{self.path} is not open")
        return self._connection

    def _lock(self) -> None:
        if self._lock_fd is not None:
            return
        lock_fd = os.open(self.path.with_name(LOCK_NAME), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o640)
        try:
            fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock_fd)
            raise StoreError(
                f"another Springscale uses {self.path.parent}: stop it or set another [store] directory"
            ) from None
        self._lock_fd = lock_fd

    @staticmethod
    def _identify(connection: sqlite3.Connection, new_epoch: str) -> Opened:
        known = connection.execute("SELECT id FROM epochs").fetchone()
        if known is None:
            connection.execute("INSERT INTO epochs (id) VALUES (?)", (new_epoch,))
        last = connection.execute("SELECT seq FROM sqlite_sequence WHERE name = 'estimates'").fetchone()
        return Opened(new_epoch if known is None else known[0], 0 if last is None else last[0])

    def _prune_old(self, connection: sqlite3.Connection, now_ns: int) -> int:
        """Oldest first, ending at the first row young enough: a row's cost is paid once, not at every look.

        Rows received before the clock was set have no known age: only the limit of size removes them.
        """
        cut_ns = now_ns - int(self._retention.max_age_s * NS_PER_S)
        n_removed = 0
        for table, stamp in (("estimates", "received_ns"), ("events", "t_ns")):
            first_kept = connection.execute(
                f"SELECT seq FROM {table} WHERE {stamp} >= ? ORDER BY seq LIMIT 1", (cut_ns,)
            ).fetchone()
            seq = (1 << 62) if first_kept is None else first_kept[0]
            n_removed += connection.execute(
                f"DELETE FROM {table} WHERE seq < ? AND {stamp} >= ?", (seq, _CLOCK_UNSET_NS)
            ).rowcount
        return n_removed

    @staticmethod
    def _prune_share(connection: sqlite3.Connection) -> int:
        n_removed = 0
        for table in ("estimates", "events"):
            n_rows = connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]
            n_removed += connection.execute(
                f"DELETE FROM {table} WHERE seq IN (SELECT seq FROM {table} ORDER BY seq LIMIT ?)",
                (int(n_rows * _PRUNE_SHARE) + 1,),
            ).rowcount
        return n_removed
