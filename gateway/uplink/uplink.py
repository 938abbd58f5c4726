"""The uplink: delivers the outbox to an MQTT 5 broker, one message at a time, and hears statements from it.

paho-mqtt's own thread keeps the connection and opens it again. What it hears it hands to the uplink's thread, which
alone decides.
"""

import json
import logging
import queue
import sys
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, Final

import paho.mqtt.client as mqtt
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode
from paho.mqtt.subscribeoptions import SubscribeOptions

from gateway.errors import ConfigurationError
from gateway.log import Event, log_event
from gateway.part import BackOff
from gateway.status import UplinkStatus
from gateway.units import S_PER_DAY
from gateway.uplink.home_assistant import LATEST, discovery
from gateway.uplink.outbox import Outbox, OutboxMessage
from gateway.uplink.sender import NotTakenError, Sender
from gateway.uplink.settings import UplinkSettings
from gateway.uplink.statements_topic import MOST_BYTES, TOPIC, StatementsDesk, TakeStatements

CONNECT_TIMEOUT_S: Final = 10.0  # chosen
ANSWER_TIMEOUT_S: Final = 30.0  # chosen: a broker that takes longer counts as lost
TURN_S: Final = 0.5  # chosen: how soon a stop ends the wait for an answer
WILL_DELAY_S: Final = 30  # chosen: a cut that is mended within this is not announced as an absence
KEPT_S: Final = round(30 * S_PER_DAY)  # chosen: how long the broker keeps statements for a vehicle that is away
MOST_UNDER_WAY: Final = 10  # chosen: statements' messages that the broker sends before one of them is acknowledged
MOST_PACKET_BYTES: Final = 2 * MOST_BYTES  # a broker sends nothing larger; what is between is refused in words
_TOO_LARGE: Final = 0x95  # MQTT 5, table 2-6, as the next three
_HOPELESS: Final = frozenset({_TOO_LARGE, 0x99})  # and payload format invalid
_NOBODY: Final = 0x10  # no matching subscribers: accepted and discarded
_WITH_WILL: Final = ReasonCode(PacketTypes.DISCONNECT, identifier=0x04)

# mosquitto answers a message over its limit with 0x95, which MQTT 5 has not among those of PUBACK, and so neither paho
ReasonCode.names = {
    **ReasonCode.names,
    _TOO_LARGE: {"Packet too large": [PacketTypes.CONNACK, PacketTypes.PUBACK, PacketTypes.DISCONNECT]},
}


class Uplink(Sender[UplinkStatus]):
    """Runs until :meth:`stop`, which announces that the vehicle is offline. Delivers at least once and in order.

    After a broken connection the message under way may arrive twice, with the same id; after a kill, also those whose
    delivery was not on disk yet. A message that the broker does not take is tried again with another client.
    """

    NAME = "uplink"

    def __init__(
        self,
        settings: UplinkSettings,
        outbox: Outbox,
        birth: Mapping[str, Any],
        back_off: BackOff | None = None,
        take_statements: TakeStatements | None = None,
    ) -> None:
        """``take_statements`` is handed what comes from the broker, if the settings want it."""
        super().__init__(outbox, UplinkStatus(settings.broker), back_off, settings.back_off_max_s)
        self._settings, self._birth = settings, {"state": "online", **birth}
        self._desk = StatementsDesk(take_statements) if settings.statements and take_statements is not None else None
        self._statements: deque[mqtt.MQTTMessage] = deque()  # each until it is acknowledged
        self._heard: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()  # what paho's thread tells ours to do
        self._under_way: int | None = None  # packet identifier of the message that waits for its answer
        self._answer: ReasonCode | None = None  # to it
        self._is_announced = False  # on the present connection
        self._connects_by_s = 0.0  # else the attempt has failed, and this client with it
        self._most_bytes: int | None = None  # the broker's Maximum Packet Size
        self._refusal: str | None = None  # of the last record, until one is accepted
        self._is_refused = False  # the present connection, by the broker's answer to it

    def _work(self) -> None:
        """Deliver through one client until stopped, or until the broker does not take a message."""
        self._heard, self._is_announced = queue.SimpleQueue(), False
        self._connects_by_s = time.monotonic() + ANSWER_TIMEOUT_S
        self._client = client = self._made_client()
        session_s = KEPT_S if self._desk else WILL_DELAY_S  # the will waits no longer than the session lives
        session = _properties(
            PacketTypes.CONNECT,
            SessionExpiryInterval=session_s, ReceiveMaximum=MOST_UNDER_WAY, MaximumPacketSize=MOST_PACKET_BYTES,
        )  # fmt: skip
        host, port, keep_alive_s = self._settings.host, self._settings.port, self._settings.keep_alive_s
        begins_anew = False if self._desk else mqtt.MQTT_CLEAN_START_FIRST_ONLY
        client.connect_async(host, port, keep_alive_s, clean_start=begins_anew, properties=session)
        client.loop_start()
        leaving: ReasonCode | None = _WITH_WILL
        try:
            super()._work()
            if self._report.is_connected:
                leaving = None
                farewell = {"state": "offline", "reason": "stopped"}
                client.publish(f"{self._settings.topic}/status", json.dumps(farewell), qos=1, retain=True)
        finally:
            self._report = replace(self._report, is_connected=False)
            client.on_connect = lambda late, *_: late.disconnect()  # of an attempt that is under way
            client.on_disconnect = None
            client.disconnect(leaving)
            client.loop_stop()

    def _is_ready(self) -> bool:
        """Do what was heard: the connection is made or lost, and statements come, each acknowledged when it is on disk
        or refused for good.
        """
        while not self._heard.empty():
            self._heard.get()()
        if not self._is_connected():
            return False
        if not self._is_announced:
            self._announce()
        if self._desk is not None:
            while self._statements and not self._stopping.is_set() and self._desk.is_done(self._statements[0]):
                self._client.ack(self._statements.popleft().mid, qos=1)
            self._report = replace(self._report, statements=self._desk.report)
        return self._is_announced

    def _announce(self) -> None:
        """Publish the birth message, which the broker must take, and the discovery message, which it may refuse."""
        code = self._confirmed(f"{self._settings.topic}/status", json.dumps(self._birth), retain=True)
        if code is None:
            return
        if code.is_failure:
            raise NotTakenError(f"{self._settings.broker} does not take the birth message: {code}")
        if self._settings.home_assistant is not None:
            self._confirmed(*discovery(self._settings.home_assistant, self._settings.topic, self._birth), retain=True)
        self._outbox.repeat()
        self._is_announced = True
        self._report = replace(self._report, last_fault=self._refusal)
        log_event(Event.UPLINK_CONNECTED, broker=self._settings.broker)

    def _deliver(self, message: OutboxMessage) -> bool:
        """Send one message and wait for the answer; False at a stop before it. A message larger than the broker's limit
        is not sent.
        """
        if self._most_bytes is not None and len(message.text.encode()) > self._most_bytes:
            return self._refused(message, f"larger than the broker's {self._most_bytes} bytes")
        topic = self._settings.topic
        if message.is_answer and self._settings.home_assistant is not None:
            self._confirmed(f"{topic}/{LATEST}", message.text, retain=True)  # a copy: its refusal does not matter
        said = _properties(
            PacketTypes.PUBLISH,
            ContentType="application/json", PayloadFormatIndicator=1, UserProperty=[("id", message.id)],
        )  # fmt: skip
        code = self._confirmed(f"{topic}/{message.branch}", message.text, retain=message.is_retained, properties=said)
        if code is None:
            return False
        if code.value in _HOPELESS:
            return self._refused(message, str(code))
        if code.is_failure or (self._settings.wait_for_listener and code.value == _NOBODY):
            self._refusal = f"{self._settings.broker} does not take estimates: {code}"
            raise NotTakenError(self._refusal)
        self._refusal = None
        self._report = replace(self._report, n_delivered=self._report.n_delivered + 1, last_fault=None)
        self._back_off.reset()
        return True

    def _refused(self, message: OutboxMessage, reason: str) -> bool:
        """Count a message that the broker will never accept: it holds up no other."""
        broker = self._settings.broker
        log_event(Event.UPLINK_REFUSED, level=logging.ERROR, broker=broker, id=message.id, reason=reason)
        self._refusal = f"{broker} refuses records for good: {reason}"
        self._report = replace(self._report, n_refused=self._report.n_refused + 1, last_fault=self._refusal)
        self._back_off.reset()
        if not self._report.is_connected:  # it hung up, and this client would send the message again
            self._outbox.delivered()
            raise NotTakenError(self._refusal)
        return True

    def _confirmed(
        self, topic: str, text: str, *, retain: bool = False, properties: Properties | None = None
    ) -> ReasonCode | None:
        """Send a message, again after each cut -> the broker's answer; None if it is time to stop before.

        Raises NotTakenError if the broker does not answer.
        """
        self._answer, end_s = None, time.monotonic() + ANSWER_TIMEOUT_S
        self._under_way = self._client.publish(topic, text.encode(), qos=1, retain=retain, properties=properties).mid
        while self._answer is None and not self._stopping.is_set():
            with suppress(queue.Empty):
                self._heard.get(timeout=TURN_S)()
            self._look()  # a cut may last for hours
            if not self._is_connected():
                end_s = time.monotonic() + ANSWER_TIMEOUT_S
            elif self._answer is None and time.monotonic() > end_s:
                raise NotTakenError(f"{self._settings.broker} did not acknowledge for {ANSWER_TIMEOUT_S:g} s")
        return self._answer

    def _is_connected(self) -> bool:
        """Whether the broker can be reached now. Raises NotTakenError if an attempt to reach it has no end."""
        if not self._report.is_connected and time.monotonic() > self._connects_by_s:
            raise NotTakenError(f"{self._settings.broker} did not answer for {ANSWER_TIMEOUT_S:g} s")
        return self._report.is_connected

    def _made_client(self) -> mqtt.Client:
        settings = self._settings
        client = mqtt.Client(CallbackAPIVersion.VERSION2, settings.client_id, protocol=mqtt.MQTTv5, manual_ack=True)
        client.connect_timeout = CONNECT_TIMEOUT_S
        if (context := settings.tls_context()) is not None:
            client.tls_set_context(context)
        lost, delay = {"state": "offline", "reason": "lost"}, {"WillDelayInterval": WILL_DELAY_S}
        will = _properties(PacketTypes.WILLMESSAGE, **delay)
        client.will_set(f"{settings.topic}/status", json.dumps(lost), qos=1, retain=True, properties=will)
        client.on_pre_connect = self._before_connecting
        client.on_connect_fail = self._on_connect_fail
        client.on_connect = self._later(self._on_connect)
        client.on_disconnect = self._on_disconnect
        client.on_publish = self._later(self._on_publish)
        if self._desk is not None:
            client.on_message = self._later(self._statements.append)
            client.on_subscribe = self._later(self._on_subscribe)
        return client

    # In paho's thread:

    def _later(self, handler: Callable[..., None]) -> Callable[..., None]:
        """A callback that has ``handler`` called in the uplink's own thread."""
        heard = self._heard

        def heard_now(_client: mqtt.Client, _userdata: Any, *told: Any) -> None:
            heard.put(partial(handler, *told))
            self._outbox.tell_news()

        return heard_now

    def _before_connecting(self, client: mqtt.Client, _userdata: Any) -> None:
        """The password is read at every connection, so that it can be changed while the service runs."""
        if self._settings.username is not None:
            try:
                client.username_pw_set(self._settings.username, self._settings.password())
            except ConfigurationError as fault:
                raise OSError(str(fault)) from None  # which paho takes for a connection that failed

    def _on_connect_fail(self, client: mqtt.Client, userdata: Any) -> None:
        self._pause(client)
        failure = sys.exception()  # paho is handling it, and does not pass it on
        self._later(self._note)(client, userdata, f"no connection to {self._settings.broker}: {failure}")

    def _on_disconnect(self, client: mqtt.Client, userdata: Any, *told: Any) -> None:
        self._pause(client)
        self._later(self._on_lost)(client, userdata, *told)

    def _pause(self, client: mqtt.Client) -> None:
        """Choose the pause before the next attempt, which paho takes twice after a first one that failed."""
        pause_s = self._back_off.next_s()
        self._connects_by_s = time.monotonic() + 2.0 * pause_s + ANSWER_TIMEOUT_S
        client.reconnect_delay_set(pause_s, pause_s)  # type: ignore[arg-type]  # any number of seconds will do

    # In the uplink's thread:

    def _on_connect(self, _flags: Any, code: ReasonCode, told: Any) -> None:
        self._is_refused = code.is_failure
        if self._is_refused:
            self._note(f"{self._settings.broker} refused the connection: {code}")
            return
        self._most_bytes = getattr(told, "MaximumPacketSize", None)
        self._is_announced = False
        self._statements.clear()  # the broker sends again what was not acknowledged
        self._report = replace(self._report, is_connected=True, n_connections=self._report.n_connections + 1)
        if self._desk is not None:
            self._client.subscribe(f"{self._settings.topic}/{TOPIC}", options=SubscribeOptions(qos=1))

    def _on_lost(self, _flags: Any, code: ReasonCode, _told: Any) -> None:
        if self._report.is_connected:
            self._report = replace(self._report, is_connected=False, n_cuts=self._report.n_cuts + 1)
            self._note(f"the connection to {self._settings.broker} was lost: {code}")
        elif not self._is_refused:
            self._note(f"{self._settings.broker} closed the connection without an answer: is it an MQTT 5 broker?")
        self._is_announced = self._is_refused = False
        if code.value in _HOPELESS:  # a broker may answer a message by closing the connection
            self._answer = code

    def _on_publish(self, mid: int, code: ReasonCode, _told: Any) -> None:
        if mid == self._under_way:
            self._answer = code

    def _on_subscribe(self, _mid: int, codes: list[ReasonCode], _told: Any) -> None:
        refused = next((code for code in codes if code.is_failure), None)
        if refused is not None and self._desk is not None:
            self._desk.refuse_subscription(str(refused))

    def _note(self, fault: str) -> None:
        """Report a failure: as a lost connection if there was one, else as a broker that was not reached."""
        if fault != self._report.last_fault:
            event = Event.UPLINK_LOST if self._is_announced else Event.UPLINK_NOT_REACHED
            log_event(event, level=logging.WARNING, broker=self._report.broker, fault=fault)
        self._report = replace(self._report, last_fault=fault)


def _properties(packet: int, **fields: Any) -> Properties:
    """MQTT 5 properties of one kind of packet, under their names in the standard without spaces."""
    properties = Properties(packet)  # type: ignore[no-untyped-call]  # paho leaves its types out here
    for name, setting in fields.items():
        setattr(properties, name, setting)
    return properties
