"""Whether the wall clock may be believed when records are removed for their age.

A clock that is years ahead for one start must not erase a history. Evidence that only goes up: the stamp of the newest
row on disk, and the time since it was read, on a clock that never steps. A wall clock far ahead of both is doubted
until it has gone on for a while without another leap; a vehicle that stood in a garage for a season just keeps its old
records a little longer.
"""

import logging
import sqlite3
import time
from collections.abc import Callable
from typing import Final

from gateway.log import Event, log_event
from gateway.units import NS_PER_S

CLOCK_UNSET_NS: Final = 1_577_836_800 * NS_PER_S  # 2020: an earlier clock was never set (no RTC battery)
NS_PER_DAY: Final = 86_400 * NS_PER_S
LEAP_NS: Final = 30 * NS_PER_DAY
BELIEVED_AFTER_NS: Final = 30 * NS_PER_DAY


def _boot_ns() -> int:
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME)


class AgeClock:
    """One opened database's view of the time; what is doubted outlives a restart, in the table ``clock``."""

    def __init__(self, connection: sqlite3.Connection, boot_ns: Callable[[], int] = _boot_ns) -> None:
        """Reads the evidence: to be made before any row is added."""
        self._connection = connection
        self._boot_ns = boot_ns
        self._read_ns = boot_ns()
        self._newest_ns = _newest_stamp_ns(connection)
        found = connection.execute("SELECT doubted_since_ns FROM clock").fetchone()
        self._doubted_since_ns: int | None = None if found is None else found[0]

    def is_believed(self, now_ns: int) -> bool:
        """Whether what is too old by ``now_ns`` is too old. Raises sqlite3.Error where a doubt cannot be kept."""
        if now_ns < CLOCK_UNSET_NS:
            return False
        boot_ns = self._boot_ns()
        expected_ns = now_ns if self._newest_ns is None else self._newest_ns + boot_ns - self._read_ns
        newest_ns, since_ns = max(now_ns, expected_ns), self._doubted_since_ns
        if now_ns - expected_ns > LEAP_NS:
            self._keep(now_ns)
            ahead_days = round((now_ns - expected_ns) / NS_PER_DAY, 1)
            log_event(Event.CLOCK_DOUBTED, level=logging.WARNING, ahead_days=ahead_days)
        elif since_ns is not None and not since_ns <= now_ns < since_ns + BELIEVED_AFTER_NS:
            self._keep(None)
            log_event(Event.CLOCK_BELIEVED)
            if now_ns < since_ns:  # it has come back: what it said meanwhile is no evidence
                newest_ns = now_ns
        self._newest_ns, self._read_ns = newest_ns, boot_ns
        return self._doubted_since_ns is None

    def _keep(self, since_ns: int | None) -> None:
        self._connection.execute("INSERT OR REPLACE INTO clock (one, doubted_since_ns) VALUES (1, ?)", (since_ns,))
        self._doubted_since_ns = since_ns


def _newest_stamp_ns(connection: sqlite3.Connection) -> int | None:
    """When the newest record came that was received under a clock that was set."""
    sql = "SELECT received_ns FROM journal WHERE received_ns >= ? ORDER BY seq DESC LIMIT 1"
    found = connection.execute(sql, (CLOCK_UNSET_NS,)).fetchone()
    return None if found is None else int(found[0])
