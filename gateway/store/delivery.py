"""How far an uplink has come, what waits for it, and what retention took from it."""

import sqlite3
from collections.abc import Sequence

from gateway.history import Delivery
from gateway.store.schema import FIRST_WITH_ENTRIES, FIRST_WITH_PRUNED_ENTRIES, pragma
from gateway.units import NS_PER_S


def delivery(
    connection: sqlite3.Connection, uplink: str, kinds: Sequence[str], *, with_estimates: bool, now_ns: int
) -> Delivery:
    """As it is on disk; what waits is counted of estimates, and of entries of these kinds."""
    version = pragma(connection, "user_version")
    pruned = "n_pruned_entries" if version >= FIRST_WITH_PRUNED_ENTRIES else "0"
    epoch = connection.execute("SELECT id FROM epochs").fetchone()
    found = connection.execute(f"SELECT seq, n_pruned, {pruned} FROM uplinks WHERE name = ?", (uplink,)).fetchone()
    seq, n_pruned, n_pruned_entries = found or (-1, 0, 0)
    waiting = [_waiting(connection, "estimates WHERE seq > ?", (seq,))] if with_estimates else []
    if kinds and version >= FIRST_WITH_ENTRIES:
        marks = ", ".join("?" * len(kinds))
        waiting.append(_waiting(connection, f"entries WHERE seq > ? AND kind IN ({marks})", (seq, *kinds)))
    oldest_ns = min((oldest for _, oldest in waiting if oldest is not None), default=None)
    return Delivery(
        cursor=f"{epoch[0]}-{seq}" if found and epoch else None,
        n_pruned=n_pruned,
        n_waiting=sum(n for n, _ in waiting),
        waiting_age_s=None if oldest_ns is None else max(0.0, (now_ns - oldest_ns) / NS_PER_S),
        n_pruned_entries=n_pruned_entries,
    )


def _waiting(connection: sqlite3.Connection, of: str, asked: tuple[object, ...]) -> tuple[int, int | None]:
    """How many, and when the oldest was received."""
    n, oldest_ns = connection.execute(f"SELECT count(*), CAST(min(received_ns) AS INTEGER) FROM {of}", asked).fetchone()
    return int(n), oldest_ns
