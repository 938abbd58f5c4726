"""One MQTT 5 connection, made once and given up at its first fault; paho-mqtt's own thread reads and writes it."""

import json
import queue
import socket
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

import paho.mqtt.client as mqtt
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode
from paho.mqtt.subscribeoptions import SubscribeOptions

from gateway.units import S_PER_DAY
from gateway.uplink.forwarder import NotTakenError
from gateway.uplink.home_assistant import discovery
from gateway.uplink.outbox import OutboxMessage
from gateway.uplink.settings import UplinkSettings
from gateway.uplink.statements_topic import MOST_BYTES, TOPIC, StatementsMessage

CONNECT_TIMEOUT_S: Final = 10.0  # chosen: for the connection, and for the broker's answer to it
ANSWER_TIMEOUT_S: Final = 30.0  # chosen: a broker that takes longer counts as lost
FAREWELL_S: Final = 0.5  # chosen: for the broker to hear that the vehicle goes
TURN_S: Final = 0.5  # chosen: how soon a stop ends the wait for an answer
WILL_DELAY_S: Final = 30  # chosen: a cut that is mended within this is not announced as an absence
KEPT_S: Final = round(30 * S_PER_DAY)  # chosen: how long the broker keeps statements for a vehicle that is away
MOST_UNDER_WAY: Final = 10  # chosen: statements' messages that the broker sends before one of them is acknowledged
MOST_PACKET_BYTES: Final = 2 * MOST_BYTES  # a broker sends nothing larger; what is between is refused in words
_TOO_LARGE: Final = 0x95  # MQTT 5, table 2-6, as the next two
_HOPELESS: Final = frozenset({_TOO_LARGE, 0x99})  # and payload format invalid
_NOBODY: Final = 0x10  # no matching subscribers: accepted and discarded

# mosquitto answers a message over its limit with 0x95, which MQTT 5 has not among those of PUBACK, and so neither paho
ReasonCode.names = {
    **ReasonCode.names,
    _TOO_LARGE: {"Packet too large": [PacketTypes.CONNACK, PacketTypes.PUBACK, PacketTypes.DISCONNECT]},
}


@dataclass(frozen=True, slots=True)
class BrokerAnswer:
    """The broker's answer for one message. ``is_hopeless``: the broker will never accept this message."""

    is_accepted: bool
    is_hopeless: bool
    reason: str


class MqttLink:
    """Connects on construction, leaves the will with the broker and publishes the birth message, which the broker must
    acknowledge.

    Raises NotTakenError if the broker cannot be reached, refuses the connection or does not take the birth message,
    ConfigurationError if a TLS or password file cannot be used. One thread sends; paho's thread only puts what it hears
    into a queue.
    """

    def __init__(
        self,
        settings: UplinkSettings,
        birth: Mapping[str, Any],
        on_news: Callable[[], None] = lambda: None,
        is_stopping: Callable[[], bool] = lambda: False,
    ) -> None:
        """``on_news`` is called, in paho's thread, when statements come or the connection breaks; ``is_stopping`` ends
        the wait.
        """
        self._settings = settings
        self._on_news = on_news
        self.statements: deque[StatementsMessage] = deque()  # each until it is acknowledged
        self.subscription_fault: str | None = None
        self._loss: str | None = None
        self._most_bytes: int | None = None  # the broker's Maximum Packet Size
        self._heard: queue.SimpleQueue[tuple[int | None, ReasonCode]] = queue.SimpleQueue()
        self._connack: queue.SimpleQueue[ReasonCode] = queue.SimpleQueue()
        self._client = self._make_client()
        try:
            self._connect()
            code = self._answer(self._publish("status", json.dumps(birth), retain=True), ANSWER_TIMEOUT_S, is_stopping)
            if code is not None and code.is_failure:
                raise NotTakenError(f"{settings.broker} does not take the birth message: {code}")
        except BaseException:
            self.abandon()
            raise
        if settings.statements:
            self._client.subscribe(f"{settings.topic}/{TOPIC}", options=SubscribeOptions(qos=1))
        if settings.home_assistant is not None:
            topic, text = discovery(settings.home_assistant, settings.topic, birth)
            self._client.publish(topic, text.encode(), qos=1, retain=True)  # a refusal does not stop the delivery

    def check(self) -> None:
        """Raise NotTakenError if the connection is lost."""
        if self._loss is not None or not self._client.is_connected():
            raise NotTakenError(self._loss or f"the connection to {self._settings.broker} was lost")

    def send(self, message: OutboxMessage, is_stopping: Callable[[], bool] = lambda: False) -> BrokerAnswer | None:
        """Send one message and wait for the answer; None if it is time to stop before. Raises NotTakenError.

        A message larger than the broker's limit is not sent.
        """
        if self._most_bytes is not None and len(message.text.encode()) > self._most_bytes:
            return BrokerAnswer(False, True, f"larger than the broker's {self._most_bytes} bytes")
        said = {"ContentType": "application/json", "PayloadFormatIndicator": 1, "UserProperty": [("id", message.id)]}
        properties = _properties(PacketTypes.PUBLISH, said)
        mid = self._publish(message.branch, message.text, retain=message.is_retained, properties=properties)
        code = self._answer(mid, ANSWER_TIMEOUT_S, is_stopping)
        if code is None:
            return None
        is_in_vain = self._settings.wait_for_listener and code.value == _NOBODY
        return BrokerAnswer(not code.is_failure and not is_in_vain, code.value in _HOPELESS, str(code))

    def acknowledge_statements(self) -> None:
        """The first of ``statements`` is done: the broker need not keep it any longer."""
        self._client.ack(self.statements.popleft().mid, qos=1)

    def close(self) -> None:
        """Disconnect cleanly, so that the broker does not publish the will."""
        with suppress(NotTakenError):  # it was broken already, or the broker is gone
            farewell = json.dumps({"state": "offline", "reason": "stopped"})
            self._answer(self._publish("status", farewell, retain=True), FAREWELL_S)
            self._client.disconnect()
            self._client.loop_stop()
        self.abandon()

    def abandon(self) -> None:
        """Drop the connection; the broker publishes the will. paho's thread ends with its socket."""
        client, self._on_news = self._client, lambda: None
        sock = client.socket()
        if isinstance(sock, socket.socket):
            with suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
        client.loop_stop()
        sock = client.socket()
        if sock is not None:
            sock.close()
        # paho closes its own pair of sockets when the client is freed: nothing may hold it
        client.on_connect = client.on_disconnect = client.on_publish = client.on_message = client.on_subscribe = None

    def _make_client(self) -> mqtt.Client:
        settings = self._settings
        client = mqtt.Client(
            CallbackAPIVersion.VERSION2, settings.client_id, protocol=mqtt.MQTTv5, reconnect_on_failure=False,
            manual_ack=True,
        )  # fmt: skip
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
        client.on_message = self._on_message
        client.on_subscribe = self._on_subscribe
        client.on_publish = lambda _client, _userdata, mid, code, _told: self._heard.put((mid, code))
        return client

    def _connect(self) -> None:
        broker = self._settings.broker
        # the will waits no longer than the session lives
        hears = self._settings.statements
        wanted = {"SessionExpiryInterval": KEPT_S if hears else WILL_DELAY_S}
        if hears:
            wanted |= {"ReceiveMaximum": MOST_UNDER_WAY, "MaximumPacketSize": MOST_PACKET_BYTES}
        session = _properties(PacketTypes.CONNECT, wanted)
        try:
            self._client.connect(  # a session that goes on has what was stated while the vehicle was away
                self._settings.host, self._settings.port, self._settings.keep_alive_s, clean_start=not hears,
                properties=session,
            )  # fmt: skip
        except (OSError, ValueError) as fault:  # ssl.SSLError and socket.gaierror are OSErrors
            raise NotTakenError(f"no connection to {broker}: {fault}") from None
        self._client.loop_start()
        try:
            code = self._connack.get(timeout=CONNECT_TIMEOUT_S)
        except queue.Empty:
            raise NotTakenError(self._loss or f"{broker} refused the connection: it did not answer") from None
        if code.is_failure:
            raise NotTakenError(f"{broker} refused the connection: {code}")

    def _publish(self, leaf: str, text: str, *, retain: bool = False, properties: Properties | None = None) -> int:
        """Packet identifier of what is sent. A loss shows in ``check`` and in ``_answer``: what paho returns says
        "no connection" also of a packet that went out and was answered by closing the connection.
        """
        topic = f"{self._settings.topic}/{leaf}"
        return self._client.publish(topic, text.encode(), qos=1, retain=retain, properties=properties).mid

    def _answer(self, mid: int, within_s: float, is_stopping: Callable[[], bool] = lambda: False) -> ReasonCode | None:
        """The broker's code for one packet; None if it is time to stop before. Raises NotTakenError."""
        end_s = time.monotonic() + within_s
        while not is_stopping():
            left_s = end_s - time.monotonic()
            if left_s <= 0.0:
                raise NotTakenError(f"{self._settings.broker} did not acknowledge for {within_s:g} s")
            try:
                heard, code = self._heard.get(timeout=0.0 if self._loss else min(left_s, TURN_S))
            except queue.Empty:
                self.check()
                continue
            if heard == mid or (heard is None and code.value in _HOPELESS):
                return code
        return None

    def _on_connect(self, _client: Any, _userdata: Any, _flags: Any, code: ReasonCode, told: Any) -> None:
        self._most_bytes = getattr(told, "MaximumPacketSize", None)
        self._connack.put(code)

    def _on_disconnect(self, _client: Any, _userdata: Any, _flags: Any, code: ReasonCode, _told: Any) -> None:
        self._loss = f"the connection to {self._settings.broker} was lost: {code}"
        self._heard.put((None, code))  # a broker may answer a message by closing the connection
        self._connack.put(code)
        self._on_news()

    def _on_message(self, _client: Any, _userdata: Any, message: mqtt.MQTTMessage) -> None:
        kind = getattr(message.properties, "ContentType", None)
        self.statements.append(StatementsMessage(bytes(message.payload), kind, message.mid))
        self._on_news()

    def _on_subscribe(self, _client: Any, _userdata: Any, _mid: int, codes: list[ReasonCode], _told: Any) -> None:
        self.subscription_fault = next((str(code) for code in codes if code.is_failure), None)
        self._on_news()


def _properties(packet: int, fields: Mapping[str, Any]) -> Properties:
    """MQTT 5 properties of one kind of packet, under their names in the standard without spaces."""
    properties = Properties(packet)  # type: ignore[no-untyped-call]  # paho leaves its types out here
    for name, setting in fields.items():
        setattr(properties, name, setting)
    return properties
