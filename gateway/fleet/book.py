"""The fleet's records in one SQLite file: every record once, in its last revision."""

import json
import sqlite3
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Final, Protocol

from gateway.fleet.lines import Line, line_of

_SCHEMA: Final = """
CREATE TABLE IF NOT EXISTS vehicle (vehicle_id TEXT PRIMARY KEY, record TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS estimate (
    vehicle_id TEXT, id TEXT, t_end TEXT NOT NULL, is_weighed INTEGER NOT NULL, record TEXT NOT NULL,
    PRIMARY KEY (vehicle_id, id)
);
CREATE INDEX IF NOT EXISTS estimate_of_vehicle ON estimate (vehicle_id, is_weighed, t_end);
CREATE TABLE IF NOT EXISTS entry (
    vehicle_id TEXT, id TEXT, kind TEXT NOT NULL, revision INTEGER NOT NULL, is_active INTEGER NOT NULL,
    record TEXT NOT NULL, PRIMARY KEY (vehicle_id, id)
);
CREATE INDEX IF NOT EXISTS entry_that_stands ON entry (vehicle_id, kind, is_active);
CREATE TABLE IF NOT EXISTS unreadable (received REAL NOT NULL, topic TEXT NOT NULL, fault TEXT NOT NULL, payload BLOB);
"""
_ESTIMATE: Final = "INSERT INTO estimate VALUES (?, ?, ?, ?, ?) ON CONFLICT DO NOTHING"
_ENTRY: Final = """
INSERT INTO entry VALUES (?, ?, ?, ?, ?, ?) ON CONFLICT (vehicle_id, id) DO UPDATE
SET (revision, is_active, record) = (excluded.revision, excluded.is_active, excluded.record)
WHERE excluded.revision > entry.revision
"""
_STATUS: Final = """
INSERT INTO vehicle VALUES (?, ?) ON CONFLICT (vehicle_id) DO UPDATE
SET record = json_patch(vehicle.record, excluded.record) WHERE excluded.record <> vehicle.record
"""  # the will has fewer fields than the birth message: fields that it lacks stay as they are
_VEHICLES: Final = """
SELECT vehicle_id FROM vehicle UNION SELECT DISTINCT vehicle_id FROM estimate ORDER BY vehicle_id
"""
_LATEST: Final = "SELECT record FROM estimate WHERE vehicle_id = ? AND is_weighed = 1 ORDER BY t_end DESC LIMIT 1"
_STANDING: Final = "SELECT record FROM entry WHERE vehicle_id = ? AND kind = 'alarm' AND is_active = 1 ORDER BY id"


class Arrived(Protocol):
    """A message of the broker."""

    @property
    def topic(self) -> str: ...
    @property
    def payload(self) -> bytes: ...


@dataclass(frozen=True, slots=True)
class Message:
    """A message without a broker, for the demonstration."""

    topic: str
    payload: bytes


def address(branch: str, topic: str) -> tuple[str, str]:
    """Vehicle and kind of a record, from its topic; ``branch`` has a + at the place of the vehicle's name.

    The broker enforces the name, since each vehicle may publish below its own topic only. Raises LookupError.
    """
    at, levels = branch.split("/").index("+"), topic.split("/")
    return levels[at], levels[at + 1]


class SqliteBook:
    """Thread-safe. A message that cannot be read is stored as unreadable and does not stop the others."""

    def __init__(self, path: Path, branch: str, clock_s: Callable[[], float] = time.time) -> None:
        """Opens or creates the file. Raises sqlite3.Error."""
        self._branch = branch
        self._clock_s = clock_s
        self._lock = threading.Lock()
        self._database = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
        self._database.executescript(f"PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; {_SCHEMA}")
        self.counts: Counter[str] = Counter()

    def write(self, arrivals: Sequence[Arrived]) -> None:
        """Store all messages or none; on disk when this returns. Raises sqlite3.OperationalError if the disk fails."""
        with self._lock:
            self._database.execute("BEGIN IMMEDIATE")
            try:
                counts = Counter(self._write(arrival) for arrival in arrivals)
                self._database.execute("COMMIT")
            except BaseException:
                self._database.execute("ROLLBACK")
                raise
            self.counts += counts

    def lines(self) -> list[Line]:
        """The fleet, a line per vehicle."""
        with self._lock:
            return [self._line(vehicle) for (vehicle,) in self._database.execute(_VEHICLES).fetchall()]

    def close(self) -> None:
        with self._lock:
            self._database.close()

    def _write(self, arrival: Arrived) -> str:
        try:
            vehicle, kind = address(self._branch, arrival.topic)
            statement, row = _row(vehicle, kind, json.loads(arrival.payload))
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as fault:
            told = f"{type(fault).__name__}: {fault}"
            row = (self._clock_s(), arrival.topic, told, arrival.payload)
            self._database.execute("INSERT INTO unreadable VALUES (?, ?, ?, ?)", row)
            return "unreadable"
        return kind if self._database.execute(statement, row).rowcount else "known already"

    def _line(self, vehicle: str) -> Line:
        def records(statement: str) -> list[Any]:
            return [json.loads(text) for (text,) in self._database.execute(statement, (vehicle,)).fetchall()]

        def only(statement: str) -> Any:
            return next(iter(records(statement)), None)

        status = only("SELECT record FROM vehicle WHERE vehicle_id = ?")
        return line_of(vehicle, status, only(_LATEST), records(_STANDING), self._clock_s())


def _row(vehicle: str, kind: str, told: Any) -> tuple[str, tuple[Any, ...]]:
    """The statement and its values. Checks all that a line needs, so that the page never fails on a stored record."""
    if not isinstance(told, dict):
        raise TypeError("no JSON object")
    text = json.dumps(told)
    if kind == "status":
        str.encode(told["state"])
        return _STATUS, (vehicle, text)
    str.encode(told["id"])
    if kind == "estimates":
        line_of(vehicle, None, told, (), 0.0)
        datetime.fromisoformat(told["t_end"])
        return _ESTIMATE, (vehicle, told["id"], told["t_end"], not list(told["rejected"]), text)
    if kind not in ("events", "trips", "alarms"):
        raise LookupError(f"{kind} is no kind of record")
    if kind == "alarms":
        line_of(vehicle, None, None, (told,), 0.0)
    return _ENTRY, (
        vehicle,
        told["id"],
        kind.removesuffix("s"),
        int(told["revision"]),
        bool(told.get("is_active")),
        text,
    )
