"""The fleet's records in one database, SQLite or PostgreSQL: every record once, in its last revision.

A record that cannot be read or stored is set aside with the reason, and does not stop the others.
"""

import json
import re
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import sqlalchemy as sql
from sqlalchemy.dialects import postgresql, sqlite

from gateway.fleet.lines import AlarmRecord, EntryRecord, EstimateRecord, Line, LineAlarm, StatusRecord, line_of

_TABLES: Final = sql.MetaData()
VEHICLE: Final = sql.Table(
    "vehicle", _TABLES, sql.Column("vehicle_id", sql.Text, primary_key=True), sql.Column("status", sql.Text)
)
ESTIMATE: Final = sql.Table(
    "estimate",
    _TABLES,
    sql.Column("vehicle_id", sql.Text, primary_key=True),
    sql.Column("id", sql.Text, primary_key=True),
    sql.Column("t_end_s", sql.Double, nullable=False),  # POSIX time
    sql.Column("is_weighed", sql.Boolean, nullable=False),
    sql.Column("stream", sql.Text),  # this and the next two: the record's `sequence`
    sql.Column("number", sql.BigInteger),
    sql.Column("previous", sql.BigInteger),
    sql.Column("record", sql.Text, nullable=False),
    sql.Index("estimate_of_vehicle", "vehicle_id", "is_weighed", "t_end_s"),
    sql.Index("estimate_in_sequence", "vehicle_id", "stream", "number"),
)
ENTRY: Final = sql.Table(
    "entry",
    _TABLES,
    sql.Column("vehicle_id", sql.Text, primary_key=True),
    sql.Column("id", sql.Text, primary_key=True),
    sql.Column("kind", sql.Text, nullable=False),
    sql.Column("revision", sql.Integer, nullable=False),
    sql.Column("is_active", sql.Boolean, nullable=False),  # an alarm; false for others
    sql.Column("record", sql.Text, nullable=False),
    sql.Index("entry_active", "is_active", "vehicle_id"),
)
UNREADABLE: Final = sql.Table(
    "unreadable",
    _TABLES,
    sql.Column("received_s", sql.Double, nullable=False),
    sql.Column("topic", sql.Text, nullable=False),
    sql.Column("fault", sql.Text, nullable=False),
    sql.Column("payload", sql.LargeBinary, nullable=False),
)
AWAY: Final = (sql.exc.OperationalError, sql.exc.InterfaceError, sql.exc.ProgrammingError, sql.exc.TimeoutError)
"""What :meth:`Book.write` raises while the database is away, full, or lacks a table or a right: try again later."""

_ENTRIES: Final[dict[str, type[EntryRecord]]] = {"alarms": AlarmRecord, "events": EntryRecord, "trips": EntryRecord}
_NAME: Final = re.compile(r"[A-Za-z0-9._-]{1,64}")  # of a vehicle, as deploy/fleet/provision.py has them
_LATEST: Final = (
    sql.select(ESTIMATE.c.record)
    .where(ESTIMATE.c.vehicle_id == VEHICLE.c.vehicle_id, ESTIMATE.c.is_weighed)
    .order_by(ESTIMATE.c.t_end_s.desc())
    .limit(1)
    .scalar_subquery()
)
_LINES: Final = sql.select(VEHICLE.c.vehicle_id, VEHICLE.c.status, _LATEST).order_by(VEHICLE.c.vehicle_id)
_ACTIVE: Final = sql.select(ENTRY.c.vehicle_id, ENTRY.c.record).where(ENTRY.c.is_active).order_by(ENTRY.c.id)


@dataclass(frozen=True, slots=True)
class Message:
    """A message of the broker, or one made without a broker. It can be acknowledged on its own ``connection`` alone."""

    topic: str
    payload: bytes
    connection: int = 0
    mid: int = 0


class Book:
    """Thread-safe. ``counts`` are of records since the start, by kind."""

    def __init__(self, database: str, branch: str, clock_s: Callable[[], float] = time.time) -> None:
        """``database`` is a file of SQLite, or the URL of PostgreSQL; ``branch`` has a + at the place of the vehicle's
        name.
        """
        self._branch, self._clock_s = branch, clock_s
        self._engine = sql.create_engine(_url_of(database), pool_pre_ping=True)
        if self._engine.dialect.name == "sqlite":
            sql.event.listen(self._engine, "connect", _make_durable)
        self._has_tables, self._lock = False, threading.Lock()
        self.counts: Counter[str] = Counter()

    def write(self, arrivals: Sequence[Message]) -> list[tuple[str, str]]:
        """Store all messages; on disk when this returns -> topic and fault of those that were set aside.

        Raises one of ``AWAY``: then it is not known which are stored, and all can be written again.
        """
        try:
            self._write(arrivals)
        except AWAY:
            raise
        except Exception as fault:  # noqa: BLE001 - one of them is at fault, so that each is tried alone
            if len(arrivals) > 1:
                return [told for arrival in arrivals for told in self.write([arrival])]
            return [self._set_aside(arrivals[0], fault)]
        return []

    def lines(self) -> list[Line]:
        """The fleet, a line per vehicle."""
        alarms: dict[str, list[LineAlarm]] = {}
        with self._connected() as database:
            for vehicle, record in database.execute(_ACTIVE):
                alarms.setdefault(vehicle, []).append(LineAlarm.model_validate_json(record))
            rows = database.execute(_LINES).all()
        return [
            line_of(
                vehicle,
                status and StatusRecord.model_validate_json(status),
                estimate and EstimateRecord.model_validate_json(estimate),
                alarms.get(vehicle, ()),
                self._clock_s(),
            )
            for vehicle, status, estimate in rows
        ]

    def n_unreadable(self) -> int:
        """Records that were set aside."""
        with self._connected() as database:
            return int(database.execute(sql.select(sql.func.count()).select_from(UNREADABLE)).scalar_one())

    def close(self) -> None:
        self._engine.dispose()

    def _connected(self) -> sql.Connection:
        with self._lock:
            if not self._has_tables:
                _TABLES.create_all(self._engine)
                self._has_tables = True
        return self._engine.connect()

    def _write(self, arrivals: Sequence[Message]) -> None:
        counts: Counter[str] = Counter()
        with self._connected() as database, database.begin():
            for arrival in arrivals:
                kind = ""
                for statement in self._statements(database, arrival):
                    kind, is_new = statement[0], bool(database.execute(statement[1]).rowcount)
                counts[kind if is_new else "known already"] += 1
        self.counts += counts

    def _statements(self, database: sql.Connection, arrival: Message) -> Iterator[tuple[str, Any]]:
        """Kind and statements of a record, the last of which stores it. Raises ValueError or LookupError."""
        insert = postgresql.insert if self._engine.dialect.name == "postgresql" else sqlite.insert
        vehicle, kind = self._address(arrival.topic)
        told = json.loads(arrival.payload, parse_constant=_refuse)
        text = json.dumps(told, allow_nan=False)  # ASCII, which no database refuses
        yield kind, insert(VEHICLE).values(vehicle_id=vehicle).on_conflict_do_nothing()
        if kind == "status":
            StatusRecord.model_validate_json(text)
            before = database.execute(sql.select(VEHICLE.c.status).where(VEHICLE.c.vehicle_id == vehicle)).scalar_one()
            known = {key: field for key, field in told.items() if field is not None}
            text = json.dumps(json.loads(before or "{}") | known)  # the will has fewer fields than the birth message
            yield kind, sql.update(VEHICLE).where(VEHICLE.c.vehicle_id == vehicle).values(status=text)
        elif kind == "estimates":
            estimate = EstimateRecord.model_validate_json(text)
            row = {"t_end_s": estimate.t_end.timestamp(), "is_weighed": not estimate.rejected, "record": text}
            place = estimate.sequence.model_dump() if estimate.sequence else {}
            yield (
                kind,
                insert(ESTIMATE).values(vehicle_id=vehicle, id=estimate.id, **row, **place).on_conflict_do_nothing(),
            )
        else:
            entry = _ENTRIES[kind].model_validate_json(text)
            is_active = isinstance(entry, AlarmRecord) and entry.is_active
            row = {"revision": entry.revision, "is_active": is_active, "record": text}
            yield (
                kind,
                insert(ENTRY)
                .values(vehicle_id=vehicle, id=entry.id, kind=kind.removesuffix("s"), **row)
                .on_conflict_do_update(
                    index_elements=["vehicle_id", "id"], set_=row, where=ENTRY.c.revision < entry.revision
                ),
            )

    def _address(self, topic: str) -> tuple[str, str]:
        """Vehicle and kind of a record, from its topic alone: the broker lets each vehicle write below its own name."""
        at, levels = self._branch.split("/").index("+"), topic.split("/")
        if not _NAME.fullmatch(levels[at]):
            raise ValueError("no name of a vehicle")
        return levels[at], levels[at + 1]

    def _set_aside(self, arrival: Message, fault: Exception) -> tuple[str, str]:
        told = f"{type(fault).__name__}: {fault}".replace("\0", "")[:1000]
        row = {"received_s": self._clock_s(), "topic": arrival.topic, "fault": told, "payload": arrival.payload}
        with self._connected() as database, database.begin():
            database.execute(sql.insert(UNREADABLE).values(**row))
        self.counts["unreadable"] += 1
        return arrival.topic, told


def _url_of(database: str) -> sql.URL:
    if database.startswith("postgresql:"):
        return sql.make_url(database).set(drivername="postgresql+psycopg")
    return sql.URL.create("sqlite", database=database)


def _make_durable(connection: Any, _record: Any) -> None:
    for pragma in ("journal_mode = WAL", "synchronous = FULL"):
        connection.execute(f"PRAGMA {pragma}")


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no JSON")
