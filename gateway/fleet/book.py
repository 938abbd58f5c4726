"""The fleet's records in one database, SQLite or PostgreSQL: every record once, in its last revision.

A record that cannot be read or stored is set aside with the reason, and does not stop the others.
"""

import json
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Any, Final, NamedTuple, TypeVar

import sqlalchemy as sql
from pydantic import BaseModel
from sqlalchemy.dialects import postgresql, sqlite

from gateway.fleet.messages import Alarm, Arrival, Estimate, Fleet, Line, Status, read

Read = TypeVar("Read", bound=BaseModel)

_TABLES: Final = sql.MetaData()


def _table(name: str, *others: sql.schema.SchemaItem) -> sql.Table:
    """A table of records by vehicle and id."""
    key = (sql.Column(part, sql.Text, primary_key=True) for part in ("vehicle_id", "id"))
    return sql.Table(name, _TABLES, *key, *others, sql.Column("record", sql.Text, nullable=False))


VEHICLE: Final = sql.Table(
    "vehicle", _TABLES, sql.Column("vehicle_id", sql.Text, primary_key=True), sql.Column("status", sql.Text)
)
ESTIMATE: Final = _table(
    "estimate",
    sql.Column("t_end_s", sql.Double, nullable=False),  # POSIX time
    sql.Column("is_weighed", sql.Boolean, nullable=False),
    sql.Column("stream", sql.Text),  # this and the next two: the record's `sequence`
    sql.Column("number", sql.BigInteger),
    sql.Column("previous", sql.BigInteger),
    sql.Index("estimate_of_vehicle", "vehicle_id", "is_weighed", "t_end_s"),
    sql.Index("estimate_in_sequence", "vehicle_id", "stream", "number"),
)
ENTRY: Final = _table(
    "entry",
    sql.Column("kind", sql.Text, nullable=False),
    sql.Column("revision", sql.Integer, nullable=False),
    sql.Column("is_active", sql.Boolean, nullable=False),  # an alarm; false for others
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
AWAY: Final = sql.exc.SQLAlchemyError
"""What :meth:`Book.write` raises while the database is away or full: it takes not even a record that is set aside."""

BRANCH: Final = "springscale/+"  # of all vehicles, + where each has its name, as deploy/fleet/mosquitto/acl has it
NOT_KEPT: Final = ("/statements", "/latest")  # what is stated to a vehicle, and its last estimate a second time
_LATEST: Final = (
    sql.select(ESTIMATE.c.record)
    .where(ESTIMATE.c.vehicle_id == VEHICLE.c.vehicle_id, ESTIMATE.c.is_weighed)
    .order_by(ESTIMATE.c.t_end_s.desc())
    .limit(1)
    .scalar_subquery()
)
_LINES: Final = sql.select(VEHICLE.c.vehicle_id, VEHICLE.c.status, _LATEST).order_by(VEHICLE.c.vehicle_id)
_ACTIVE: Final = sql.select(ENTRY.c.vehicle_id, ENTRY.c.record).where(ENTRY.c.is_active).order_by(ENTRY.c.id)


class Message(NamedTuple):
    """A message of the broker, or one made without a broker. It can be acknowledged on its own ``connection`` alone."""

    topic: str
    payload: bytes
    connection: int = 0
    mid: int = 0


class Book:
    """Thread-safe. ``counts`` are of records since the start, by kind."""

    def __init__(self, database: str, clock_s: Callable[[], float] = time.time) -> None:
        """``database`` is a file of SQLite, or the URL of PostgreSQL."""
        url = sql.URL.create("sqlite", database=database)
        if database.startswith("postgresql:"):
            url = sql.make_url(database).set(drivername="postgresql+psycopg")
        self._engine, self._clock_s = sql.create_engine(url, pool_pre_ping=True), clock_s
        self._insert: Any = postgresql.insert
        if url.drivername == "sqlite":
            self._insert = sqlite.insert
            sql.event.listen(self._engine, "connect", _make_durable)
            sql.event.listen(self._engine, "begin", lambda connection: connection.exec_driver_sql("BEGIN"))
        self._has_tables, self._lock = False, threading.Lock()
        self.counts: Counter[str] = Counter()

    def write(self, arrivals: Sequence[Message]) -> list[tuple[str, str]]:
        """Store all messages; on disk when this returns -> topic and fault of those that were set aside.

        Raises ``AWAY``: then it is not known which are stored, and all can be written again.
        """
        try:
            return self._written(arrivals, sets_aside=False)
        except Exception:  # noqa: BLE001 - a connection from before the database was restarted, a table that is missing
            self._has_tables = False
            return self._written(arrivals, sets_aside=True)

    def _written(self, arrivals: Sequence[Message], *, sets_aside: bool) -> list[tuple[str, str]]:
        """One transaction, a savepoint for each message. What cannot be read is set aside, and with ``sets_aside`` also
        what the database refuses; if it refuses that too, the database is at fault and not the record.
        """
        counts, told = Counter[str](), []
        with self._begun() as database:
            for arrival in arrivals:
                if arrival.topic.endswith(NOT_KEPT):
                    continue
                try:
                    found = read(arrival.topic, arrival.payload)
                except Exception as fault:  # noqa: BLE001 - whatever a vehicle sends
                    told.append(self._set_aside(database, arrival, fault))
                    continue
                try:
                    with database.begin_nested():
                        counts[self._store(database, found)] += 1
                except Exception as fault:
                    if not sets_aside:
                        raise
                    told.append(self._set_aside(database, arrival, fault))
        self.counts += counts + Counter(unreadable=len(told))
        return told

    def fleet(self) -> Fleet:
        """The fleet now, a line per vehicle. A stored record that this version cannot read is left out and counted."""
        now_s, alarms, n_unread = self._clock_s(), defaultdict[str, list[Alarm]](list), 0

        def read_again(model: type[Read], text: str | None) -> Read | None:
            nonlocal n_unread
            try:
                return model.model_validate_json(text) if text else None
            except ValueError:
                n_unread += 1
                return None

        with self._begun() as database:
            for vehicle, record in database.execute(_ACTIVE):
                if (alarm := read_again(Alarm, record)) is not None:
                    alarms[vehicle].append(alarm)
            rows = database.execute(_LINES).all()
            n_unreadable = database.execute(sql.select(sql.func.count()).select_from(UNREADABLE)).scalar_one()
        lines = []
        for vehicle, status, record in rows:
            estimate = read_again(Estimate, record)
            lines.append(
                Line(
                    vehicle_id=vehicle,
                    status=read_again(Status, status),
                    estimate=estimate,
                    age_s=estimate and max(0.0, now_s - estimate.t_end.timestamp()),
                    used_share=estimate and estimate.used_share(),
                    alarms=alarms[vehicle],
                )
            )
        return Fleet(items=lines, n_unreadable=n_unreadable + n_unread)

    def close(self) -> None:
        self._engine.dispose()

    def _begun(self) -> AbstractContextManager[sql.Connection]:
        """A connection in a transaction, which the end of the block commits; the first makes the tables."""
        with self._lock:
            if not self._has_tables:
                _TABLES.create_all(self._engine)
                self._has_tables = True
        return self._engine.begin()

    def _store(self, database: sql.Connection, found: Arrival) -> str:
        """Store a record -> its kind, or "known already"."""
        vehicle, kind, record, text = found
        database.execute(self._insert(VEHICLE).values(vehicle_id=vehicle).on_conflict_do_nothing())
        if isinstance(record, Status):
            before = database.execute(sql.select(VEHICLE.c.status).where(VEHICLE.c.vehicle_id == vehicle)).scalar_one()
            known = record.model_dump(exclude_none=True)
            text = json.dumps(json.loads(before or "{}") | known)  # the will has fewer fields than the birth message
            statement = sql.update(VEHICLE).where(VEHICLE.c.vehicle_id == vehicle).values(status=text)
        elif isinstance(record, Estimate):
            new = self._insert(ESTIMATE).values(vehicle_id=vehicle, record=text, **record.columns())
            statement = new.on_conflict_do_nothing()
        else:
            row = {
                "revision": record.revision,
                "is_active": isinstance(record, Alarm) and record.is_active,
                "record": text,
            }
            new = self._insert(ENTRY).values(vehicle_id=vehicle, id=record.id, kind=kind.removesuffix("s"), **row)
            is_later = ENTRY.c.revision < record.revision
            statement = new.on_conflict_do_update(index_elements=["vehicle_id", "id"], set_=row, where=is_later)
        return kind if database.execute(statement).rowcount else "known already"

    def _set_aside(self, database: sql.Connection, arrival: Message, fault: Exception) -> tuple[str, str]:
        """Keep the message as it came, with the reason. Raises ``AWAY``."""
        told = f"{type(fault).__name__}: {fault}".encode("ascii", "backslashreplace").decode().replace("\0", "")[:1000]
        row = {"received_s": self._clock_s(), "topic": arrival.topic, "fault": told, "payload": arrival.payload}
        database.execute(sql.insert(UNREADABLE).values(row))
        return arrival.topic, told


def _make_durable(connection: Any, _record: Any) -> None:
    connection.isolation_level = None  # else the driver begins no transaction before a savepoint
    for pragma in ("journal_mode = WAL", "synchronous = FULL"):
        connection.execute(f"PRAGMA {pragma}")
