"""How much is kept, and the removal of what is beyond."""

import sqlite3
from dataclasses import dataclass
from typing import Final

from gateway.errors import StoreError
from gateway.store.age import CLOCK_UNSET_NS
from gateway.units import NS_PER_S

_SHARE: Final = 0.05  # of the rows, removed at a time until the size fits
_LAST: Final = 1 << 62  # above every number of a row


@dataclass(frozen=True, slots=True)
class Retention:
    """How much is kept.

    max_age_s counts from receipt; max_bytes bounds the database without its write-ahead log (which
    stays under about 8 MB); max_held bounds the rows kept in memory while the disk refuses. Age alone
    removes nothing that one of the uplinks ``undelivered_to`` has still to deliver.
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
    """Rows removed for their age: oldest first, ending at the first one young enough, so that each is paid for once.

    Rows received before the clock was set have no known age, and what still has to be delivered is not removed
    for its age: only the limit of size removes them.
    """
    cut_ns = now_ns - int(min(kept.max_age_s * NS_PER_S, now_ns))
    n_removed = 0
    for table, stamp, last in (
        ("estimates", "received_ns", _last_delivered(connection, kept.undelivered_to)),
        ("entries", "received_ns", _last_delivered(connection, kept.undelivered_to)),
        ("events", "t_ns", _LAST),
    ):
        first_kept = connection.execute(
            f"SELECT seq FROM {table} WHERE {stamp} >= ? ORDER BY seq LIMIT 1", (cut_ns,)
        ).fetchone()
        seq = _LAST if first_kept is None else first_kept[0]
        n_removed += connection.execute(
            f"DELETE FROM {table} WHERE seq < ? AND seq <= ? AND {stamp} >= ?", (seq, last, CLOCK_UNSET_NS)
        ).rowcount
    return n_removed


def remove_share(connection: sqlite3.Connection) -> int:
    """The oldest rows, some of each table -> how many."""
    n_removed = 0
    for table in ("estimates", "entries", "events"):
        n_rows = connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]
        n_removed += connection.execute(
            f"DELETE FROM {table} WHERE seq IN (SELECT seq FROM {table} ORDER BY seq LIMIT ?)",
            (int(n_rows * _SHARE) + 1,),
        ).rowcount
    return n_removed


def _last_delivered(connection: sqlite3.Connection, uplinks: tuple[str, ...]) -> int:
    """Number of the last row that nobody waits for."""
    known = (connection.execute("SELECT seq FROM uplinks WHERE name = ?", (name,)).fetchone() for name in uplinks)
    return min((-1 if row is None else int(row[0]) for row in known), default=_LAST)
