"""Retention: limits of age and size, the removal of records beyond them, and whether the wall clock may be believed.

A clock that is years ahead for one start must not erase the history. The check compares the wall clock with the stamp
of the newest row on disk plus the time since that row was read, measured on a monotonic clock. A wall clock far ahead
of that sum is distrusted until it has advanced for BELIEVED_AFTER_NS without another leap. A vehicle that stood in a
garage for a season therefore keeps its old records a little longer.
"""

import logging
import sqlite3
import time
from dataclasses import dataclass
from typing import Final

from gateway.errors import StoreError
from gateway.log import Event, log_event
from gateway.store.journal import SERVICE
from gateway.store.queries import count_pruned
from gateway.units import NS_PER_DAY, NS_PER_S, S_PER_DAY

_SHARE: Final = 0.05  # chosen: of the rows, removed at a time until the size fits
_LAST: Final = 1 << 62  # above every number of a row


@dataclass(frozen=True, slots=True)
class Retention:
    """Limits of the store.

    ``max_age_s`` counts from receipt. ``max_bytes`` limits the database without its write-ahead log, which stays below
    about 8 MB. ``max_held`` limits the rows kept in memory while the disk fails. A record that one of the uplinks
    ``undelivered_to`` still has to deliver is not removed for its age alone.
    """

    max_age_s: float = 400.0 * S_PER_DAY
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
    delivered = [
        connection.execute("SELECT seq FROM uplinks WHERE name = ?", (name,)).fetchone() for name in kept.undelivered_to
    ]
    last = min((-1 if row is None else int(row[0]) for row in delivered), default=_LAST)  # by every uplink
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


CLOCK_UNSET_NS: Final = 1_577_836_800 * NS_PER_S  # chosen: 2020; an earlier clock was never set (no RTC battery)
LEAP_NS: Final = 30 * NS_PER_DAY  # chosen: further ahead the wall clock is doubted
BELIEVED_AFTER_NS: Final = 30 * NS_PER_DAY  # chosen: time without another leap after which it is believed again


def boot_ns() -> int:
    """Nanoseconds since the machine's boot, including sleep."""
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME)


class AgeClock:
    """Decides for one open database whether the wall clock is plausible; the database stores the distrust."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        """Reads the newest stamp by a clock that was set; create the clock before any row is added."""
        self._connection = connection
        self._read_ns = boot_ns()
        sql = "SELECT received_ns FROM journal WHERE received_ns >= ? ORDER BY seq DESC LIMIT 1"
        newest = connection.execute(sql, (CLOCK_UNSET_NS,)).fetchone()
        self._newest_ns: int | None = None if newest is None else newest[0]
        self._doubted_since_ns: int | None = connection.execute("SELECT doubted_since_ns FROM state").fetchone()[0]

    def is_believed(self, now_ns: int) -> bool:
        """Whether ``now_ns`` is plausible. Raises sqlite3.Error if the distrust cannot be stored."""
        if now_ns < CLOCK_UNSET_NS:
            return False
        passed_ns = boot_ns()
        expected_ns = now_ns if self._newest_ns is None else self._newest_ns + passed_ns - self._read_ns
        newest_ns, since_ns = max(now_ns, expected_ns), self._doubted_since_ns
        if now_ns - expected_ns > LEAP_NS:
            self._keep(now_ns)
            ahead_days = round((now_ns - expected_ns) / NS_PER_DAY, 1)
            log_event(Event.CLOCK_DOUBTED, level=logging.WARNING, ahead_days=ahead_days)
        elif since_ns is not None and not since_ns <= now_ns < since_ns + BELIEVED_AFTER_NS:
            self._keep(None)
            log_event(Event.CLOCK_BELIEVED)
            if now_ns < since_ns:  # the clock was set back: its stamps in between are no evidence
                newest_ns = now_ns
        self._newest_ns, self._read_ns = newest_ns, passed_ns
        return self._doubted_since_ns is None

    def _keep(self, since_ns: int | None) -> None:
        self._connection.execute("UPDATE state SET doubted_since_ns = ?", (since_ns,))
        self._doubted_since_ns = since_ns
