"""One MQTT 5 connection, driven by its owner's thread: paho-mqtt without its own thread and retry queue."""

import json
import os
import select
import ssl
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import paho.mqtt.client as mqtt
from paho.mqtt.enums import CallbackAPIVersion, MQTTErrorCode
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode

from gateway.uplink.home_assistant import discovery
from gateway.uplink.outbox import OutboxMessage
from gateway.uplink.settings import UplinkSettings

CONNECT_TIMEOUT_S: Final = 10.0  # chosen: for the connection, and for the broker's answer to it
WILL_DELAY_S: Final = 30  # chosen: a cut that is mended within this is not announced as an absence
_TURN_S: Final = 0.1  # chosen: one look at the socket while an answer is awaited


class LinkError(Exception):
    """The connection could not be made, or it broke."""


@dataclass(frozen=True, slots=True)
class BrokerAnswer:
    """The broker's answer for one message. ``is_hopeless``: the broker will never accept this message."""

    mid: int
    is_accepted: bool
    is_hopeless: bool
    reason: str


_TOO_LARGE: Final = 0x95  # MQTT 5, table 2-6
_HOPELESS: Final = frozenset({_TOO_LARGE, 0x99})  # and payload format invalid
_NOBODY: Final = 0x10  # likewise; no matching subscribers: accepted and discarded
_NOTHING: Final = 0  # no packet has this number

# mosquitto answers a message over its limit with 0x95, which MQTT 5 has not among those of PUBACK, and so neither paho
ReasonCode.names = {
    **ReasonCode.names,
    _TOO_LARGE: {"Packet too large": [PacketTypes.CONNACK, PacketTypes.PUBACK, PacketTypes.DISCONNECT]},
}


class MqttLink:
    """Connects on construction, publishes the birth message and leaves the will with the broker.

    Raises LinkError if the broker cannot be reached or refuses the connection, ConfigurationError if a TLS or password
    file cannot be used. Not thread-safe: one owner.
    """

    def __init__(self, settings: UplinkSettings, birth: Mapping[str, Any]) -> None:
        self._settings = settings
        self._answers: list[BrokerAnswer] = []
        self._connack: ReasonCode | None = None
        self._loss: str | None = None
        self._most_bytes: int | None = None  # the broker's Maximum Packet Size
        self._under_way = _NOTHING
        self._bell_lock = threading.Lock()
        self._bell = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._client = self._make_client()
        try:
            self._connect()
            self._announce(birth)
        except BaseException:
            self._hang_up()
            raise
        if settings.home_assistant is not None:
            topic, text = discovery(settings.home_assistant, settings.topic, birth)
            self._client.publish(topic, text.encode(), qos=1, retain=True)  # a refusal does not stop the delivery

    def send(self, message: OutboxMessage) -> int:
        """Send a message -> packet identifier of its answer. A message larger than the broker's limit is not sent."""
        if self._most_bytes is not None and len(message.text.encode()) > self._most_bytes:
            self._answers.append(
                BrokerAnswer(_NOTHING, False, True, f"larger than the broker's {self._most_bytes} bytes")
            )
            return _NOTHING
        said = {"ContentType": "application/json", "PayloadFormatIndicator": 1, "UserProperty": [("id", message.id)]}
        properties = _properties(PacketTypes.PUBLISH, said)
        self._under_way = self._publish(message.branch, message.text, retain=message.is_retained, properties=properties)
        return self._under_way

    def turn(self, timeout_s: float) -> list[BrokerAnswer]:
        """Read and write on the socket -> answers received; returns after the first activity.

        A broker may answer by closing the connection: this call then returns the answer, and the next raises LinkError.
        """
        code = self._move(0.0 if self._answers else min(timeout_s, self._settings.keep_alive_s / 4.0))
        if not self._answers and (code != mqtt.MQTT_ERR_SUCCESS or self._loss is not None):
            raise LinkError(self._loss or mqtt.error_string(MQTTErrorCode(code)))
        answers, self._answers = self._answers, []
        return answers

    def wake(self) -> None:
        """End the turn under way; from any thread."""
        with self._bell_lock:  # its number may be another file's once it is closed
            if self._bell >= 0:
                os.eventfd_write(self._bell, 1)

    def _move(self, timeout_s: float) -> int:
        """Wait until the socket is ready, ``wake`` is called, or the time is over; then read and write.

        Uses poll(), because paho's select() fails for file descriptors above 1023.
        """
        client, sock = self._client, self._client.socket()
        if sock is None:
            return int(mqtt.MQTT_ERR_NO_CONN)
        waiting = select.poll()
        waiting.register(sock, select.POLLIN | (select.POLLOUT if client.want_write() else 0))
        waiting.register(self._bell, select.POLLIN)
        has_rest = isinstance(sock, ssl.SSLSocket) and sock.pending() > 0
        moved = dict(waiting.poll(0 if has_rest else round(1000.0 * timeout_s)))
        if self._bell in moved:
            os.eventfd_read(self._bell)
        events = moved.get(sock.fileno(), 0)
        codes = [client.loop_write()] if events & select.POLLOUT else []
        if has_rest or events & ~select.POLLOUT:
            codes.append(client.loop_read())
        codes.append(client.loop_misc())
        return next((int(code) for code in codes if code != mqtt.MQTT_ERR_SUCCESS), int(mqtt.MQTT_ERR_SUCCESS))

    def close(self) -> None:
        """Disconnect cleanly, so that the broker does not publish the will."""
        try:
            farewell = self._announce({"state": "offline", "reason": "stopped"})
            for _ in range(5):
                if any(answer.mid == farewell for answer in self.turn(_TURN_S)):
                    break
            self._client.disconnect()
            self._move(_TURN_S)
        except LinkError:  # the connection was already broken
            pass
        self._hang_up()

    def abandon(self) -> None:
        """Drop a broken connection; the broker publishes the will."""
        sock = self._client.socket()
        if sock is not None:
            sock.close()
        self._hang_up()

    def _hang_up(self) -> None:
        with self._bell_lock:
            bell, self._bell = self._bell, -1
            if bell >= 0:
                os.close(bell)

    def _make_client(self) -> mqtt.Client:
        settings = self._settings
        client = mqtt.Client(CallbackAPIVersion.VERSION2, settings.client_id, protocol=mqtt.MQTTv5)
        client.connect_timeout = CONNECT_TIMEOUT_S
        if settings.username is not None:
            client.username_pw_set(settings.username, settings.password())
        if (context := settings.tls_context()) is not None:
            client.tls_set_context(context)
        will = _properties(PacketTypes.WILLMESSAGE, {"WillDelayInterval": WILL_DELAY_S})
        lost = json.dumps({"state": "offline", "reason": "lost"})
        client.will_set(f"{settings.topic}/status", lost, qos=1, retain=True, properties=will)
        client.on_connect = self._on_connect
        client.on_disconnect = self._on_disconnect
        client.on_publish = lambda _client, _userdata, mid, code, _told: self._answer(mid, code)
        return client

    def _connect(self) -> None:
        # the will waits no longer than the session lives
        session = _properties(PacketTypes.CONNECT, {"SessionExpiryInterval": WILL_DELAY_S})
        try:
            self._client.connect(
                self._settings.host,
                self._settings.port,
                keepalive=self._settings.keep_alive_s,
                clean_start=True,
                properties=session,
            )
        except (OSError, ValueError) as fault:  # ssl.SSLError and socket.gaierror are OSErrors
            raise LinkError(f"no connection to {self._settings.broker}: {fault}") from None
        try:
            for _ in range(round(CONNECT_TIMEOUT_S / _TURN_S)):
                self.turn(_TURN_S)
                if self._connack is not None:
                    break
        except LinkError:
            if self._connack is None:
                raise
        if self._connack is None or self._connack.is_failure:
            self.abandon()
            reason = "it did not answer" if self._connack is None else str(self._connack)
            raise LinkError(f"{self._settings.broker} refused the connection: {reason}")

    def _announce(self, presence: Mapping[str, Any]) -> int:
        return self._publish("status", json.dumps(presence), retain=True)

    def _publish(self, leaf: str, text: str, *, retain: bool = False, properties: Properties | None = None) -> int:
        sent = self._client.publish(
            f"{self._settings.topic}/{leaf}", text.encode(), qos=1, retain=retain, properties=properties
        )
        if sent.rc != mqtt.MQTT_ERR_SUCCESS:
            raise LinkError(self._loss or mqtt.error_string(sent.rc))
        return sent.mid

    def _on_connect(self, _client: Any, _userdata: Any, _flags: Any, code: ReasonCode, told: Any) -> None:
        self._connack = code
        self._most_bytes = getattr(told, "MaximumPacketSize", None)

    def _on_disconnect(self, _client: Any, _userdata: Any, _flags: Any, code: ReasonCode, _told: Any) -> None:
        self._loss = f"the connection to {self._settings.broker} was lost: {code}"
        if code.value in _HOPELESS and self._under_way != _NOTHING:
            self._answer(self._under_way, code)

    def _answer(self, mid: int, code: ReasonCode) -> None:
        if mid == self._under_way:
            self._under_way = _NOTHING
        is_in_vain = self._settings.wait_for_listener and code.value == _NOBODY
        self._answers.append(
            BrokerAnswer(mid, not code.is_failure and not is_in_vain, code.value in _HOPELESS, str(code))
        )


def _properties(packet: int, fields: Mapping[str, Any]) -> Properties:
    """MQTT 5 properties of one kind of packet, under their names in the standard without spaces."""
    properties = Properties(packet)  # type: ignore[no-untyped-call]  # paho leaves its types out here
    for name, setting in fields.items():
        setattr(properties, name, setting)
    return properties
