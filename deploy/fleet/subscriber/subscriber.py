"""From the fleet's broker into a database: every record once, acknowledged to the broker when it is on disk; and the
page of the fleet, /fleet.

    subscriber.py            # settings from the environment, see Settings

The database is a file of SQLite, or PostgreSQL where FLEET_DATABASE begins with postgresql: (postgresql:// alone leaves
the rest to libpq's PGHOST, PGUSER, ...). Only Grafana's dashboards need PostgreSQL.

The broker keeps what comes while this is away (a session without end), and hands out again what was not acknowledged;
primary keys make one row of it. Where the database is away, nothing is acknowledged.
"""

import json
import os
import queue
import signal
import sqlite3
import ssl
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

import paho.mqtt.client as mqtt
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from gateway.fleet import FleetPage, Line, SqliteBook, address, fleet_app, line_of

AWAY: tuple[type[Exception], ...] = (sqlite3.OperationalError,)  # the database, for now
if os.environ.get("FLEET_DATABASE", "").startswith("postgresql:"):
    import psycopg
    from psycopg.types.json import Jsonb

    AWAY = (psycopg.OperationalError,)

NEVER: Final = 0xFFFFFFFF  # MQTT 5, 3.1.2.11.2: a session that does not expire
UNDER_WAY: Final = 2000  # messages the broker hands out before one of them is acknowledged
MOST_AT_ONCE: Final = 500  # messages of one transaction
PAUSE_S: Final = 1.0
TOLD_EVERY_S: Final = 60.0

ESTIMATE: Final = """
INSERT INTO estimate
SELECT %(vehicle)s, r->>'id', r->>'vin', (r->>'t_start')::timestamptz, (r->>'t_end')::timestamptz, now(),
    (r->>'payload_kg')::float8, (r->>'payload_std_kg')::float8, (r#>>'{weights,gross,kg}')::float8,
    (r#>>'{weights,gross,limit_kg}')::float8, (r#>>'{weights,front_axle,kg}')::float8,
    (r#>>'{weights,rear_axle,kg}')::float8, jsonb_path_exists(r, '$.weights.*.is_over_limit ? (@ == true)'),
    (r->>'mean_speed_mps')::float8, ARRAY(SELECT jsonb_array_elements_text(r->'rejected')), r->>'calibration_id',
    r#>>'{sequence,stream}', (r#>>'{sequence,number}')::bigint, (r#>>'{sequence,previous}')::bigint, r
FROM (SELECT %(record)s::jsonb) AS told (r)
ON CONFLICT (vehicle_id, id) DO NOTHING
"""
ENTRY: Final = """
INSERT INTO entry
SELECT %(vehicle)s, r->>'id', %(kind)s, (r->>'revision')::int, (r->>'t_start')::timestamptz,
    (r->>'t_end')::timestamptz, now(), r
FROM (SELECT %(record)s::jsonb) AS told (r)
ON CONFLICT (vehicle_id, id) DO UPDATE
SET (revision, t_start, t_end, received, record)
    = (excluded.revision, excluded.t_start, excluded.t_end, excluded.received, excluded.record)
WHERE excluded.revision > entry.revision
"""
STATUS: Final = """
INSERT INTO vehicle
SELECT %(vehicle)s, r->>'state', r->>'reason', r->>'vin', r->>'version', r->>'calibration_id', now()
FROM (SELECT %(record)s::jsonb) AS told (r)
ON CONFLICT (vehicle_id) DO UPDATE
SET (state, reason, vin, version, calibration_id, since) = (
    excluded.state, excluded.reason, coalesce(excluded.vin, vehicle.vin), coalesce(excluded.version, vehicle.version),
    coalesce(excluded.calibration_id, vehicle.calibration_id), excluded.since
)
WHERE (excluded.state, excluded.reason, excluded.version, excluded.calibration_id)
    IS DISTINCT FROM (vehicle.state, vehicle.reason, vehicle.version, vehicle.calibration_id)
"""
LINES: Final = """
SELECT vehicle.vehicle_id, jsonb_build_object('state', vehicle.state, 'vin', vehicle.vin), latest.record, coalesce(
    (
        SELECT jsonb_agg(entry.record ORDER BY entry.id)
        FROM entry
        WHERE entry.vehicle_id = vehicle.vehicle_id AND kind = 'alarm' AND (entry.record->>'is_active')::boolean
    ), '[]'
)
FROM vehicle
LEFT JOIN latest USING (vehicle_id)
ORDER BY vehicle.vehicle_id
"""
UNREADABLE: Final = "INSERT INTO unreadable (topic, fault, payload) VALUES (%s, %s, %s)"
STATEMENTS: Final = {"estimates": ESTIMATE, "events": ENTRY, "trips": ENTRY, "alarms": ENTRY, "status": STATUS}


@dataclass(frozen=True)
class Settings:
    """From the environment: MQTT_HOST, MQTT_PORT, MQTT_CA (absent: the system's authorities), MQTT_USERNAME,
    MQTT_PASSWORD_FILE, MQTT_TOPIC (the branch of all vehicles, + where each has its name); FLEET_DATABASE (see above),
    FLEET_HOST and FLEET_PORT (of the page, which asks nobody for a token: keep a proxy that does before it)."""

    host: str
    port: int
    ca: str | None
    username: str
    password_file: Path
    topic: str
    database: str
    page_host: str
    page_port: int

    @classmethod
    def of(cls, environment: Mapping[str, str]) -> "Settings":
        return cls(
            environment["MQTT_HOST"],
            int(environment.get("MQTT_PORT", "8883")),
            environment.get("MQTT_CA"),
            environment.get("MQTT_USERNAME", "fleet-subscriber"),
            Path(environment["MQTT_PASSWORD_FILE"]),
            environment.get("MQTT_TOPIC", "springscale/+"),
            environment.get("FLEET_DATABASE", "fleet.sqlite"),
            environment.get("FLEET_HOST", "127.0.0.1"),
            int(environment.get("FLEET_PORT", "8080")),
        )


@dataclass(frozen=True)
class Arrival:
    """A message, and on which connection it came: only there can it be acknowledged."""

    connection: int
    mid: int
    topic: str
    payload: bytes


class Link:
    """The broker's messages in a queue; paho's own thread connects again whenever the connection breaks."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._arrivals: queue.SimpleQueue[Arrival] = queue.SimpleQueue()
        self._connection = 0
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, settings.username, protocol=mqtt.MQTTv5)
        self._client.manual_ack_set(True)
        self._client.reconnect_delay_set(1, 30)
        self._client.username_pw_set(settings.username, settings.password_file.read_text().strip())
        self._client.tls_set_context(ssl.create_default_context(cafile=settings.ca))
        self._client.on_connect = self._on_connect
        self._client.on_disconnect = lambda *_: tell("disconnected")
        self._client.on_message = self._on_message

    def start(self) -> None:
        """Begin to connect and to receive."""
        session = Properties(PacketTypes.CONNECT)
        session.SessionExpiryInterval = NEVER
        session.ReceiveMaximum = UNDER_WAY
        self._client.connect_async(self._settings.host, self._settings.port, clean_start=False, properties=session)
        self._client.loop_start()

    def stop(self) -> None:
        """Leave; the broker keeps the session."""
        self._client.disconnect()
        self._client.loop_stop()

    def some(self, timeout_s: float) -> list[Arrival]:
        """What has come, at most one transaction's worth; waits for the first."""
        found: list[Arrival] = []
        try:
            found.append(self._arrivals.get(timeout=timeout_s))
            while len(found) < MOST_AT_ONCE:
                found.append(self._arrivals.get_nowait())
        except queue.Empty:
            pass
        return found

    def acknowledge(self, arrivals: list[Arrival]) -> None:
        """They are safe; of a connection that broke meanwhile they come again."""
        for arrival in arrivals:
            if arrival.connection == self._connection:
                self._client.ack(arrival.mid, qos=1)

    def _on_connect(self, client: mqtt.Client, _userdata: Any, flags: Any, code: Any, _told: Any) -> None:
        self._connection += 1
        tell("connected", answer=str(code), session_present=bool(flags.session_present))
        if not code.is_failure:
            client.subscribe(f"{self._settings.topic}/#", qos=1)

    def _on_message(self, _client: mqtt.Client, _userdata: Any, message: mqtt.MQTTMessage) -> None:
        self._arrivals.put(Arrival(self._connection, message.mid, message.topic, bytes(message.payload)))


class Book(Protocol):
    """The database. A message that it cannot take is written down as such, so that the rest goes on."""

    counts: Counter[str]

    def write(self, arrivals: Sequence[Arrival]) -> None: ...
    def lines(self) -> list[Line]: ...


class PostgresBook:
    """In PostgreSQL, by schema.sql."""

    def __init__(self, database: str, topic: str) -> None:
        self._where = database
        self._topic = topic
        self._database: psycopg.Connection | None = None
        self.counts: Counter[str] = Counter()

    def lines(self) -> list[Line]:
        """The fleet, a line per vehicle; over a connection of its own, from any thread."""
        with psycopg.connect(self._where, connect_timeout=10) as database:
            rows = database.execute(LINES).fetchall()
        return [line_of(*row, time.time()) for row in rows]

    def write(self, arrivals: Sequence[Arrival]) -> None:
        """All of them, or none. Raises psycopg.OperationalError where the database is away."""
        if self._database is None or self._database.closed:
            self._database = psycopg.connect(self._where, connect_timeout=10)
        counts: Counter[str] = Counter()
        try:
            with self._database.transaction():
                for arrival in arrivals:
                    counts[self._write(self._database, arrival)] += 1
        except psycopg.OperationalError:
            self._database.close()
            raise
        self.counts += counts

    def _write(self, database: "psycopg.Connection", arrival: Arrival) -> str:
        try:
            vehicle, branch = address(self._topic, arrival.topic)
            record = json.loads(arrival.payload)
            fields = {"vehicle": vehicle, "record": Jsonb(record), "kind": branch.removesuffix("s")}
            with database.transaction():  # a savepoint: what fails takes nothing with it
                written = database.execute(STATEMENTS[branch], fields).rowcount
        except (ValueError, LookupError, RecursionError, psycopg.DataError, psycopg.IntegrityError) as fault:
            told = f"{type(fault).__name__}: {fault}".replace("\0", "")
            database.execute(UNREADABLE, (arrival.topic, told, arrival.payload))
            tell("unreadable", topic=arrival.topic, fault=told)
            return "unreadable"
        return branch if written else "known already"


def tell(event: str, **fields: Any) -> None:
    """One JSON line on standard error."""
    print(json.dumps({"event": event, **fields}), file=sys.stderr, flush=True)


def pauses() -> Iterator[float]:
    """Twice as long each time, up to half a minute."""
    pause_s = PAUSE_S
    while True:
        yield pause_s
        pause_s = min(2.0 * pause_s, 30.0)


def book_of(settings: Settings) -> Book:
    """The database that FLEET_DATABASE names."""
    if settings.database.startswith("postgresql:"):
        return PostgresBook(settings.database, settings.topic)
    return SqliteBook(Path(settings.database), settings.topic)


def serve(link: Link, book: Book, stopping: threading.Event) -> None:
    """Write what comes, then acknowledge it, until told to stop."""
    waiting: list[Arrival] = []
    pause, told_s = pauses(), time.monotonic()
    while not stopping.is_set():
        waiting = waiting or link.some(0.5)
        try:
            if waiting:
                book.write(waiting)
        except AWAY as fault:
            tell("database away", fault=str(fault).strip(), waiting=len(waiting))
            stopping.wait(next(pause))
            continue
        link.acknowledge(waiting)
        waiting, pause = [], pauses()
        if time.monotonic() - told_s > TOLD_EVERY_S:
            told_s = time.monotonic()
            tell("written", **book.counts)


def main() -> None:
    """Run until SIGTERM."""
    stopping = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stopping.set())
    settings = Settings.of(os.environ)
    link, book = Link(settings), book_of(settings)
    page = FleetPage(fleet_app(book.lines), settings.page_host, settings.page_port)
    page.start()
    link.start()
    try:
        serve(link, book, stopping)
    finally:
        link.stop()
        page.stop()
        tell("written", **book.counts)


if __name__ == "__main__":
    main()
