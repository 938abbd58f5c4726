"""The thread that sends: at a steady pace, on a channel that is tried again when it fails."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Final

from gateway.bus.broadcast.weight_frames import Sender, WeightFrames
from gateway.bus.sink import BusSink
from gateway.errors import BusError
from gateway.estimate import Estimate
from gateway.log import Event, log_event

RETRY_S: Final = 5.0
STOP_WITHIN_S: Final = 1.0


class Broadcaster:
    """Sends the weights of ``weighed_now`` every ``every_s`` seconds until :meth:`stop`.

    ``weighed_now`` returns None if the estimate is too old to be sent. ``fault`` says why nothing is sent, for people.
    """

    NAME: ClassVar = "sender of weights"

    def __init__(
        self,
        interface: str,
        channel: str,
        options: Mapping[str, Any],
        sender: Sender,
        every_s: float,
        weighed_now: Callable[[], Estimate | None],
    ) -> None:
        self._fault: str | None = None
        self.n_sent = 0  # frames
        self._place = (interface, channel, options)
        self._frames = WeightFrames(sender)
        self._every_s = every_s
        self._weighed_now = weighed_now
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="broadcast", daemon=True)

    def start(self) -> None:
        """Begin to send."""
        self._thread.start()

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        """Stop sending; a bus that takes no frame may keep its thread a little longer than this waits."""
        self._stopping.set()
        self._thread.join(within_s)

    @property
    def fault(self) -> str | None:
        """Why nothing is sent, for people."""
        return self._fault

    def is_alive(self) -> bool:
        """True while the thread runs."""
        return self._thread.is_alive()

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
        if fault != self._fault:
            level = logging.INFO if fault is None else logging.WARNING
            event = Event.BROADCASTING if fault is None else Event.NOT_BROADCASTING
            log_event(event, level=level, interface=self._place[0], channel=self._place[1], fault=fault)
        self._fault = fault
