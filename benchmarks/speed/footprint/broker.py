"""The size of an uplink message on the wire, and the cost of a real broker to accept and forward it.

Vehicles send as the gateway does: MQTT 5, QoS 1, each with its own connection and one message in flight. One back-end
subscribes to all of them with QoS 1. The broker's own processor time is counted, so that the senders' does not matter;
it writes nothing to disk. Messages go without TLS, so that their bytes can be counted; the cost of a connection is
measured with TLS.
"""

import os
import shutil
import socket
import subprocess
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any

import paho.mqtt.client as mqtt
import trustme
from paho.mqtt.enums import CallbackAPIVersion

from benchmarks.speed.meter import cpu_of_s, free_port
from gateway.uplink.link import MqttLink
from gateway.uplink.outbox import OutboxMessage
from gateway.uplink.settings import UplinkSettings

MOSQUITTO = shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin:/usr/bin:/usr/local/bin")
PATIENCE_S = 30.0  # chosen: timeout
N_VEHICLES = 20  # chosen
N_MESSAGES = 20_000  # chosen: for steady figures
N_CONNECTIONS = 300  # chosen, likewise


def measure(folder: Path, messages: Sequence[OutboxMessage]) -> dict[str, Any]:
    """Bytes on the wire per message, and microseconds of the broker's processor per message taken and passed on."""
    with Broker(folder) as broker:
        up, down = _bytes_on_the_wire(broker.port, messages)
        back_end = _BackEnd(broker.port)
        links = [MqttLink(_settings(broker.port, f"van-{n}"), {}) for n in range(N_VEHICLES)]
        before_s = broker.cpu_s()
        for n in range(N_MESSAGES // N_VEHICLES):
            _deliver(links, messages[n % len(messages)])
        back_end.wait_for(N_MESSAGES)
        took_s = broker.cpu_s() - before_s
        for link in links:
            link.close()
        back_end.close()
    return {
        "wire_bytes_up": up,
        "wire_bytes_down": down,
        "n_messages": N_MESSAGES,
        "n_vehicles": N_VEHICLES,
        "cpu_us_per_message": 1e6 * took_s / N_MESSAGES,
        "connections": _connections(folder),
    }


def _connections(folder: Path) -> dict[str, float]:
    """The cost of a vehicle's TLS connection: the broker's processor time once, its memory as long as it lasts."""
    authority = trustme.CA()
    authority.cert_pem.write_to_path(folder / "ca.pem")
    certificate = authority.issue_cert("localhost")
    certificate.private_key_and_cert_chain_pem.write_to_path(folder / "broker.pem")
    with Broker(
        folder, f"cafile {folder}/ca.pem\ncertfile {folder}/broker.pem\nkeyfile {folder}/broker.pem\n"
    ) as broker:
        cpu_s, memory_bytes = broker.cpu_s(), broker.memory_bytes()
        links = []
        for n in range(N_CONNECTIONS):
            encrypted = {"host": "localhost", "tls": True, "ca": folder / "ca.pem"}
            links.append(MqttLink(_settings(broker.port, f"van-{n}").model_copy(update=encrypted), {}))
        found = {
            "n": N_CONNECTIONS,
            "cpu_ms_each": 1e3 * (broker.cpu_s() - cpu_s) / N_CONNECTIONS,
            "memory_bytes_each": (broker.memory_bytes() - memory_bytes) / N_CONNECTIONS,
        }
        for link in links:
            link.abandon()
    return found


class Broker:
    """mosquitto on a free loopback port."""

    def __init__(self, folder: Path, extra: str = "") -> None:
        if MOSQUITTO is None:
            raise SystemExit("mosquitto is needed to measure a broker: install Debian's package of that name")
        self.port = free_port()
        configuration = folder / "mosquitto.conf"
        limits = "max_queued_messages 0\nmax_inflight_messages 0\n"  # a back-end that lags loses nothing
        configuration.write_text(f"listener {self.port} 127.0.0.1\nallow_anonymous true\nuser root\n{limits}{extra}")
        self._process = subprocess.Popen(
            [MOSQUITTO, "-c", str(configuration)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    def __enter__(self) -> "Broker":
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            with suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1.0):
                return self
            time.sleep(0.05)
        raise SystemExit("mosquitto did not start")

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.terminate()
        self._process.wait(PATIENCE_S)

    def cpu_s(self) -> float:
        """Processor time it has used, user and system (proc(5))."""
        return cpu_of_s(self._process.pid)

    def memory_bytes(self) -> int:
        """Its current memory (proc(5), statm)."""
        return int(Path(f"/proc/{self._process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class _BackEnd:
    """A subscriber to every vehicle that counts messages."""

    def __init__(self, port: int) -> None:
        self._n = 0
        self._has_subscribed = threading.Event()
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, "back-end", protocol=mqtt.MQTTv5)
        self._client.on_message = self._count
        self._client.on_subscribe = lambda *_: self._has_subscribed.set()
        self._client.connect("127.0.0.1", port)
        self._client.subscribe("springscale/+/estimates", qos=1)
        self._client.loop_start()
        self._has_subscribed.wait(PATIENCE_S)

    def _count(self, *_: object) -> None:
        self._n += 1

    def wait_for(self, n: int) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while self._n < n:
            if time.monotonic() > end_s:
                raise SystemExit(f"the back-end got {self._n} of {n} messages")
            time.sleep(0.05)

    def close(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()


class _Relay:
    """A relay between one vehicle and the broker that counts bytes up and down."""

    def __init__(self, port: int) -> None:
        self.up = self.down = 0
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        threading.Thread(target=self._accept, args=(port,), daemon=True).start()

    def _accept(self, port: int) -> None:
        vehicle, _ = self._listening.accept()
        broker = socket.create_connection(("127.0.0.1", port))
        threading.Thread(target=self._carry, args=(vehicle, broker, "up"), daemon=True).start()
        self._carry(broker, vehicle, "down")

    def _carry(self, source: socket.socket, sink: socket.socket, way: str) -> None:
        with suppress(OSError):
            while piece := source.recv(1 << 16):
                setattr(self, way, getattr(self, way) + len(piece))
                sink.sendall(piece)
        with suppress(OSError):
            sink.shutdown(socket.SHUT_WR)


def _bytes_on_the_wire(port: int, messages: Sequence[OutboxMessage]) -> tuple[float, float]:
    relay = _Relay(port)
    link = MqttLink(_settings(relay.port, "van-17"), {})
    up, down = relay.up, relay.down
    for message in messages:
        _deliver([link], message)
    per_message = (relay.up - up) / len(messages), (relay.down - down) / len(messages)
    link.close()
    return per_message


def _deliver(links: Sequence[MqttLink], message: OutboxMessage) -> None:
    """One message from each, all answered for."""
    for link in links:
        answer = link.send(message)
        if answer is None or not answer.is_accepted:
            raise SystemExit("the broker did not acknowledge")


def _settings(port: int, vehicle_id: str) -> UplinkSettings:
    return UplinkSettings(
        host="127.0.0.1",
        port=port,
        topic=f"springscale/{vehicle_id}",
        client_id=f"springscale-{vehicle_id}",
        tls=False,
    )
