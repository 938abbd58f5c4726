"""Statements of loads that come down from the broker: handed to the learner one message at a time, and counted."""

import json
import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from paho.mqtt.client import MQTTMessage

from gateway.errors import NOT_STORED, RefusedError
from gateway.log import Event, log_event
from gateway.stated.statement import TYPES
from gateway.status import StatementsHeard

TOPIC: Final = "statements"  # below that of the vehicle
MOST_BYTES: Final = 1_000_000  # chosen: some ten thousand rows; more than max_packet_size of deploy/fleet lets through
BY: Final = "mqtt"  # who stated it, in the list of statements

TakeStatements = Callable[[bytes, str], str]
"""Takes the content of a message and who sent it -> JSON of an ImportTold. Raises RefusedError."""


class StatementsDesk:
    """Takes or refuses statements from messages, and counts both in ``report``. Not thread-safe."""

    def __init__(self, take: TakeStatements) -> None:
        self._take = take
        self.report = StatementsHeard()

    def is_done(self, message: MQTTMessage) -> bool:
        """Take the message or refuse it for good; False if the disk fails, so that it must come again."""
        try:
            refusal = self._taken(message)
        except RefusedError as fault:
            self._refuse(str(fault), is_final=fault.reason != NOT_STORED)
            return fault.reason != NOT_STORED
        except Exception as fault:  # noqa: BLE001 - no message may end the uplink
            self._refuse(repr(fault))
            return True
        self.report = replace(self.report, n_taken=self.report.n_taken + 1)
        if refusal is not None:
            self._refuse(refusal)
        return True

    def refuse_subscription(self, why: str) -> None:
        """The broker does not let this vehicle hear its statements."""
        self._refuse(f"the broker refuses the subscription: {why}", is_final=False)

    def _taken(self, message: MQTTMessage) -> str | None:
        """The faults of its bad rows; None without any. Raises RefusedError."""
        kind = getattr(message.properties, "ContentType", TYPES[0]).partition(";")[0].strip().lower()
        if kind not in TYPES:
            raise RefusedError("unreadable", f"{kind[:100]!r}: send {TYPES[0]} or {TYPES[1]}")
        if len(message.payload) > MOST_BYTES:
            raise RefusedError("too_large", f"{len(message.payload)} bytes, {MOST_BYTES} are allowed: split it")
        told = json.loads(self._take(bytes(message.payload), BY))
        bad = [f"row {one['row']}: {one['text']}" for one in told["problems"] if one["kind"] == "bad"]
        return "; ".join(bad[:20]) or None

    def _refuse(self, why: str, *, is_final: bool = True) -> None:
        if why != self.report.last_refusal or is_final:
            log_event(Event.STATEMENTS_REFUSED, level=logging.WARNING, fault=why)
        self.report = replace(self.report, n_refused=self.report.n_refused + int(is_final), last_refusal=why)
