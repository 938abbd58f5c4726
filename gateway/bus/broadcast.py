"""Weights on another CAN bus as SAE J1939 frames, if the settings ask for it: VW for each axle, and CVW.

The frames are laid out and scaled by dbc/j1939_weights.dbc and sent at a steady pace on an interface of their own. The
interface that is listened to is opened elsewhere (``bus.live``) and never sent on.
"""

import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.bus.signals import load_messages
from gateway.bus.signals.encode import J1939_UNUSED, put_bits
from gateway.bus.sink import BusSink
from gateway.errors import BusError
from gateway.estimate import Estimate, Weights
from gateway.j1939 import AXLE_WEIGHT, counts_of
from gateway.log import Event, log_event
from gateway.part import ThreadPart
from gateway.records import EXTENDED_ID, Frames

DATABASE: Final = "j1939_weights.dbc"
WHOLE_AXLE: Final = 0xF  # where four bits would name a tyre
UNWEIGHED: Final = Weights()
_PRIORITY_SHIFT: Final = 26  # SAE J1939-21, 5.2: bits 26 to 28
_GROUP: Final = 0x3FFFF00  # the bits of an identifier that name the parameter group


@dataclass(frozen=True, slots=True)
class Sender:
    """Source address and priority (SAE J1939-21, 5.2). The front axle has the number ``first_axle``.

    The springs do not measure a trailer: with ``draws_trailers`` the combination's weight stays unknown.
    """

    source_address: int
    priority: int = 6
    first_axle: int = 1
    draws_trailers: bool = False


class WeightFrames:
    """Encodes the weights of one moment: VW of the front axle, VW of the rear axle, CVW."""

    def __init__(self, sender: Sender) -> None:
        path = Path(str(files("gateway.dbc") / DATABASE))
        self._messages = load_messages(path, [path])
        self._sender = sender

    def of(self, shown: Estimate | None, t_ns: int) -> Frames:
        """Frames (3,) stamped ``t_ns``. Unknown numbers, or all if ``shown`` is None, are "not available"."""
        sender, weights = self._sender, UNWEIGHED if shown is None else shown.weights
        counts = counts_of(shown, weights, draws_trailers=sender.draws_trailers)
        of_axle = {count.axle: count.raw for count in counts if count.axle is not None}
        whole = {count.parameter.signal: count.raw for count in counts if count.axle is None}
        contents: list[tuple[str, Mapping[str, int]]] = [
            ("VW", {"TireLocation": WHOLE_AXLE, "AxleLocation": location, AXLE_WEIGHT.signal: of_axle[axle], **whole})
            for axle, location in ((1, sender.first_axle), (2, sender.first_axle + 1))
        ]
        messages = [(self._messages[name], raw) for name, raw in (*contents, ("CVW", whole))]
        n = len(messages)
        payload = np.full((n, 8), J1939_UNUSED, np.uint8)
        for row, (message, raw) in enumerate(messages):
            for name in raw.keys() & message.signals.keys():
                put_bits(payload[row : row + 1], message.signals[name].field, np.array([raw[name]], np.uint64))
        addressed = sender.priority << _PRIORITY_SHIFT | sender.source_address | EXTENDED_ID
        can_id = np.array([message.frame_id & _GROUP | addressed for message, _ in messages], np.uint32)
        return Frames(np.full(n, t_ns, np.int64), can_id, np.full(n, 8, np.uint8), payload)


RETRY_S: Final = 5.0  # chosen: pause after a fault of the bus


class Broadcaster(ThreadPart):
    """Sends the weights of ``weighed_now`` every ``every_s`` seconds until :meth:`stop`.

    ``weighed_now`` returns None if the estimate is too old to be sent. ``fault`` says why nothing is sent.
    """

    NAME = "sender of weights"
    fault: str | None = None

    def __init__(
        self,
        interface: str,
        channel: str,
        options: Mapping[str, Any],
        sender: Sender,
        every_s: float,
        weighed_now: Callable[[], Estimate | None],
    ) -> None:
        super().__init__("broadcast")
        self.n_sent = 0  # frames
        self._place = (interface, channel, options)
        self._frames = WeightFrames(sender)
        self._every_s = every_s
        self._weighed_now = weighed_now

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self._send_until_stopped()
            except Exception as fault:  # noqa: BLE001 - no bus may end the thread
                self._note(f"[broadcast] weights are not sent: {fault if isinstance(fault, BusError) else repr(fault)}")
                self._stopping.wait(RETRY_S)

    def _send_until_stopped(self) -> None:
        interface, channel, options = self._place
        with BusSink(interface, channel, **options) as sink:
            while not self._stopping.is_set():
                frames = self._frames.of(self._weighed_now(), time.time_ns())
                sink.send(frames)
                self.n_sent += len(frames)
                self._note(None)
                self._stopping.wait(self._every_s)

    def _note(self, fault: str | None) -> None:
        """Log a fault, and its end, once."""
        if fault != self.fault:
            level = logging.INFO if fault is None else logging.WARNING
            event = Event.BROADCASTING if fault is None else Event.NOT_BROADCASTING
            log_event(event, level=level, interface=self._place[0], channel=self._place[1], fault=fault)
        self.fault = fault
