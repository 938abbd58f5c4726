"""Plausibility check of the wall clock before records are removed for their age.

A clock that is years ahead for one start must not erase the history. The check compares the wall clock with the stamp
of the newest row on disk plus the time since that row was read, measured on a monotonic clock. A wall clock far ahead
of that sum is distrusted until it has advanced for BELIEVED_AFTER_NS without another leap. A vehicle that stood in a
garage for a season therefore keeps its old records a little longer.
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
    """Decides for one open database whether the wall clock is plausible; the table ``clock`` stores the distrust."""

    def __init__(self, connection: sqlite3.Connection, boot_ns: Callable[[], int] = _boot_ns) -> None:
        """Reads the newest stamp; create the clock before any row is added."""
        self._connection = connection
        self._boot_ns = boot_ns
        self._read_ns = boot_ns()
        self._newest_ns = _newest_stamp_ns(connection)
        found = connection.execute("SELECT doubted_since_ns FROM clock").fetchone()
        self._doubted_since_ns: int | None = None if found is None else found[0]

    def is_believed(self, now_ns: int) -> bool:
        """Whether ``now_ns`` is plausible. Raises sqlite3.Error if the distrust cannot be stored."""
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
            if now_ns < since_ns:  # the clock was set back: its stamps in between are no evidence
                newest_ns = now_ns
        self._newest_ns, self._read_ns = newest_ns, boot_ns
        return self._doubted_since_ns is None

    def _keep(self, since_ns: int | None) -> None:
        self._connection.execute("INSERT OR REPLACE INTO clock (one, doubted_since_ns) VALUES (1, ?)", (since_ns,))
        self._doubted_since_ns = since_ns


def _newest_stamp_ns(connection: sqlite3.Connection) -> int | None:
    """Time of receipt of the newest record that was received while the clock was set."""
    sql = "SELECT received_ns FROM journal WHERE received_ns >= ? ORDER BY seq DESC LIMIT 1"
    found = connection.execute(sql, (CLOCK_UNSET_NS,)).fetchone()
    return None if found is None else int(found[0])
