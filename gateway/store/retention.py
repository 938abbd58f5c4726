"""Retention: limits of age and size, and the removal of records beyond them."""

import sqlite3
from dataclasses import dataclass
from typing import Final

from gateway.errors import StoreError
from gateway.history import SERVICE
from gateway.store.age import CLOCK_UNSET_NS
from gateway.store.queries import count_pruned
from gateway.units import NS_PER_S

_SHARE: Final = 0.05  # of the rows, removed at a time until the size fits
_LAST: Final = 1 << 62  # above every number of a row


@dataclass(frozen=True, slots=True)
class Retention:
    """Limits of the store.

    ``max_age_s`` counts from receipt. ``max_bytes`` limits the database without its write-ahead log, which stays below
    about 8 MB. ``max_held`` limits the rows kept in memory while the disk fails. A record that one of the uplinks
    ``undelivered_to`` still has to deliver is not removed for its age alone.
    """

    max_age_s: float = 400 * 86_400.0
    max_bytes: int = 1_000_000_000
    max_held: int = 2048
    undelivered_to: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.max_age_s > 0 or self.max_bytes < 1_000_000 or self.max_held < 1:
            raise StoreError(
                f"cannot keep {self}: max_age_s must be positive, max_bytes at least 1000000 and max_held at least 1"
            )


def remove_old(connection: sqlite3.Connection, kept: Retention, now_ns: int) -> int:
    """Remove records that are too old -> how many. Stops at the first record that is young enough.

    Records received before the clock was set have no known age. They, and undelivered records, are removed only by the
    limit of size.
    """
    cut_ns = now_ns - int(min(kept.max_age_s * NS_PER_S, now_ns))
    first_kept = connection.execute(
        "SELECT seq FROM journal WHERE received_ns >= ? ORDER BY seq LIMIT 1", (cut_ns,)
    ).fetchone()
    seq = _LAST if first_kept is None else first_kept[0]
    last = _last_delivered(connection, kept.undelivered_to)
    condition = f"journal.seq < ? AND received_ns >= {CLOCK_UNSET_NS} AND (journal.seq <= ? OR kind = '{SERVICE}')"
    return _remove(connection, condition, (seq, last))


def remove_share(connection: sqlite3.Connection) -> int:
    """Remove the oldest twentieth of the records -> how many."""
    n_rows = connection.execute("SELECT count(*) FROM journal").fetchone()[0]
    last = connection.execute(
        "SELECT seq FROM journal ORDER BY seq LIMIT 1 OFFSET ?", (int(n_rows * _SHARE),)
    ).fetchone()
    return 0 if last is None else _remove(connection, "journal.seq <= ?", (last[0],))


def _remove(connection: sqlite3.Connection, condition: str, asked: tuple[int, ...]) -> int:
    if connection.execute(f"SELECT 1 FROM journal WHERE {condition} LIMIT 1", asked).fetchone() is None:
        return 0
    count_pruned(connection, condition, asked)
    return connection.execute(f"DELETE FROM journal WHERE {condition}", asked).rowcount


def _last_delivered(connection: sqlite3.Connection, uplinks: tuple[str, ...]) -> int:
    """Number of the last record that every uplink has delivered."""
    known = (connection.execute("SELECT seq FROM uplinks WHERE name = ?", (name,)).fetchone() for name in uplinks)
    return min((-1 if row is None else int(row[0]) for row in known), default=_LAST)
