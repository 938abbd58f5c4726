"""Stores every record from the fleet's broker once, acknowledged to the broker when it is on disk; and the
page of the fleet, /fleet.

    python -m gateway.fleet.subscriber            # settings from the environment, see Settings

The broker keeps what comes while this is away (a session without end), and hands out again what was not acknowledged;
primary keys make one row of it. Where the database is away, nothing is acknowledged.
"""

import contextlib
import json
import queue
import signal
import ssl
import sys
import threading
import time
from pathlib import Path
from typing import Any, Final

import paho.mqtt.client as mqtt
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from pydantic_settings import BaseSettings

from gateway.fleet.book import AWAY, BRANCH, Book, Message
from gateway.fleet.page import fleet_app, served

USER: Final = "fleet-subscriber"  # as deploy/fleet/mosquitto/acl has it
NEVER: Final = 0xFFFFFFFF  # MQTT 5, 3.1.2.11.2: a session that does not expire
UNDER_WAY: Final = 2000  # chosen: messages the broker hands out before one of them is acknowledged
MOST_AT_ONCE: Final = 500  # chosen: messages of one transaction
PAUSE_S: Final = 5.0  # chosen: between two tries of a database that is away
TOLD_EVERY_S: Final = 60.0  # chosen


class Settings(BaseSettings):
    """Names of the environment, in capitals."""

    mqtt_host: str
    mqtt_port: int = 8883
    mqtt_ca: str | None = None  # absent: the system's authorities
    mqtt_password_file: Path
    fleet_database: str = "fleet.sqlite"  # or postgresql://...
    fleet_host: str = "127.0.0.1"  # of the page, which asks nobody for a token: keep a proxy that does before it
    fleet_port: int = 8080
    fleet_names: tuple[str, ...] = ()  # beside local names: those under which the proxy hands requests on


class Link:
    """The broker's messages in a queue; paho's own thread connects again whenever the connection breaks."""

    def __init__(self, settings: Settings) -> None:
        """Begin to connect and to receive."""
        self._arrivals: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._connection = 0
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, USER, protocol=mqtt.MQTTv5, manual_ack=True)
        self._client.reconnect_delay_set(1, 30)
        self._client.username_pw_set(USER, settings.mqtt_password_file.read_text().strip())
        self._client.tls_set_context(ssl.create_default_context(cafile=settings.mqtt_ca))
        self._client.on_connect = self._on_connect
        self._client.on_disconnect = lambda *_: tell("disconnected")
        self._client.on_message = self._on_message
        session = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]  # paho's
        session.SessionExpiryInterval, session.ReceiveMaximum = NEVER, UNDER_WAY
        self._client.connect_async(settings.mqtt_host, settings.mqtt_port, clean_start=False, properties=session)
        self._client.loop_start()

    def stop(self) -> None:
        """Leave; the broker keeps the session."""
        self._client.disconnect()
        self._client.loop_stop()

    def some(self, timeout_s: float) -> list[Message]:
        """The messages that have come, at most one transaction's worth; waits for the first."""
        found: list[Message] = []
        with contextlib.suppress(queue.Empty):
            found.append(self._arrivals.get(timeout=timeout_s))
            while len(found) < MOST_AT_ONCE:
                found.append(self._arrivals.get_nowait())
        return found

    def acknowledge(self, arrivals: list[Message]) -> None:
        """Acknowledges messages that are safe; those of a connection that broke meanwhile come again."""
        for arrival in arrivals:
            if arrival.connection == self._connection:
                self._client.ack(arrival.mid, qos=1)

    def _on_connect(self, client: mqtt.Client, _userdata: Any, flags: Any, code: Any, _told: Any) -> None:
        self._connection += 1
        tell("connected", answer=str(code), session_present=bool(flags.session_present))
        if not code.is_failure:
            client.subscribe(f"{BRANCH}/#", qos=1)

    def _on_message(self, _client: mqtt.Client, _userdata: Any, message: mqtt.MQTTMessage) -> None:
        self._arrivals.put(Message(message.topic, bytes(message.payload), self._connection, message.mid))


def tell(event: str, **fields: Any) -> None:
    """Write one JSON line to standard error."""
    sys.stderr.write(json.dumps({"event": event, **fields}) + "\n")
    sys.stderr.flush()


def serve(link: Link, book: Book, stopping: threading.Event) -> None:
    """Write what comes, then acknowledge it, until told to stop."""
    waiting: list[Message] = []
    told_s = time.monotonic()
    while not stopping.is_set():
        waiting = waiting or link.some(0.5)
        try:
            for topic, fault in book.write(waiting) if waiting else ():
                tell("unreadable", topic=topic, fault=fault)
        except AWAY as away:  # not even a record that is set aside is taken
            tell("database away", fault=str(away).partition("\n")[0], waiting=len(waiting))
            stopping.wait(PAUSE_S)
            continue
        link.acknowledge(waiting)
        waiting = []
        if time.monotonic() - told_s > TOLD_EVERY_S:
            told_s = time.monotonic()
            tell("written", **book.counts)


def main() -> None:
    """Run until SIGTERM."""
    stopping = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stopping.set())
    settings = Settings()
    book = Book(settings.fleet_database)
    with (
        contextlib.closing(book),
        served(fleet_app(book, settings.fleet_names), settings.fleet_host, settings.fleet_port),
    ):
        link = Link(settings)
        try:
            serve(link, book, stopping)
        finally:
            link.stop()
    tell("written", **book.counts)


if __name__ == "__main__":
    main()
