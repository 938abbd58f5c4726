"""A real mosquitto on a loopback port, a listener at it, and a link to it that can be cut."""

import contextlib
import socket
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType

import paho.mqtt.client as mqtt
import pytest
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from support.parts import found
from support.patience import PATIENCE_S, wait_until
from support.ports import free_port

MOSQUITTO = found("mosquitto")
needs_mosquitto = pytest.mark.skipif(MOSQUITTO is None, reason="mosquitto is not installed")


class Broker:
    """mosquitto with memory across restarts. ``extra`` lines go into its configuration."""

    def __init__(self, directory: Path, extra: str = "allow_anonymous true") -> None:
        self.port = free_port()
        self._configuration = directory / "mosquitto.conf"
        self._configuration.write_text(
            f"listener {self.port} 127.0.0.1\npersistence true\npersistence_location {directory}/\n"
            f"max_queued_messages 0\nuser root\n{extra}\n"
        )
        self._process: subprocess.Popen[bytes] | None = None
        self.start()

    def start(self) -> None:
        assert MOSQUITTO is not None
        self._process = subprocess.Popen(
            [MOSQUITTO, "-c", str(self._configuration)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        assert wait_until(self._answers), "mosquitto did not start"

    def _answers(self) -> bool:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), PATIENCE_S):
            return True
        return False

    def stop(self) -> None:
        """Stops the broker as systemd would: it saves the messages that its sessions have yet to get."""
        if self._process is not None:
            self._process.terminate()
            self._process.wait(PATIENCE_S)
            self._process = None


class Listener:
    """A fleet's back-end: the broker keeps its session while it is away."""

    def __init__(self, port: int, topic: str, client_id: str = "back-end") -> None:
        self.heard: list[mqtt.MQTTMessage] = []
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, client_id, protocol=mqtt.MQTTv5)
        self._client.reconnect_delay_set(0.05, 0.2)
        self._client.on_message = lambda _client, _userdata, message: self.heard.append(message)
        subscribed = threading.Event()
        self._client.on_subscribe = lambda *_: subscribed.set()
        self._client.on_connect = lambda client, *_: client.subscribe(topic, qos=1)
        session = Properties(PacketTypes.CONNECT)
        session.SessionExpiryInterval = 3600
        self._client.connect("127.0.0.1", port, clean_start=False, properties=session)
        self._client.loop_start()
        assert subscribed.wait(PATIENCE_S)

    def wait_for(self, n: int) -> bool:
        """True as soon as ``n`` messages came, False when patience ends."""
        return wait_until(lambda: len(self.heard) >= n)

    def close(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()


class CuttableLink:
    """A TCP relay to the broker: what goes through it can be cut off at any byte."""

    n_connections = 0

    def __init__(self, broker_port: int) -> None:
        self._broker_port = broker_port
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        self._pairs: list[tuple[socket.socket, socket.socket]] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self) -> "CuttableLink":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.cut_for_good()
        self._listening.close()

    def cut_for_good(self) -> None:
        """Drop every connection and take no other."""
        with contextlib.suppress(OSError):  # close alone leaves a thread in accept to take one more
            self._listening.shutdown(socket.SHUT_RDWR)
        self.cut()

    def cut(self) -> None:
        """Drop every connection, mid-message if need be."""
        pairs, self._pairs = self._pairs, []
        for pair in pairs:
            for end in pair:
                with contextlib.suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)
                end.close()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listening.accept()
            except OSError:
                return
            try:
                far = socket.create_connection(("127.0.0.1", self._broker_port))
            except OSError:  # the broker is away
                near.close()
                continue
            self.n_connections += 1
            self._pairs.append((near, far))
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=_pump, args=(source, sink), daemon=True).start()


def _pump(source: socket.socket, sink: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while chunk := source.recv(4096):
            sink.sendall(chunk)
    for end in (source, sink):
        with contextlib.suppress(OSError):
            end.shutdown(socket.SHUT_RDWR)


@contextlib.contextmanager
def running_broker(directory: Path, extra: str = "allow_anonymous true") -> Iterator[Broker]:
    broker = Broker(directory, extra)
    try:
        yield broker
    finally:
        broker.stop()
