"""Survey of the bus while a mapped message is missing: receives every identifier for two seconds, once a minute.

The service listens through filters, so it does not receive a sensor that was set to another identifier. A channel that
only one program may open, such as a serial adapter, is not surveyed.
"""

import threading
import time
from collections.abc import Mapping
from contextlib import closing
from typing import Any, Final

import can

from gateway.bus.heard import Heard, heard_of
from gateway.bus.live.source import OpenReceiver, opener_of
from gateway.bus.signals import CAN_FD_BYTES, EVERY_IDENTIFIER
from gateway.errors import BusError
from gateway.part import STOP_WITHIN_S, ServicePart

LOOK_S: Final = 2.0  # chosen: every periodic message of a vehicle comes within that
EVERY_S: Final = 60.0  # chosen: from one survey to the next
POLL_S: Final = 0.1  # chosen: how soon a stop takes effect


class BusSurvey(ServicePart):
    """Surveys the bus in a thread that lives as long as one survey; never sends."""

    NAME = "survey of the bus"

    def __init__(self, open_receiver: OpenReceiver | None) -> None:
        """``open_receiver`` opens the channel once more, unfiltered; None if that would disturb the first."""
        self._open = open_receiver
        self._heard: tuple[Heard, ...] = ()
        self._begun_s = -EVERY_S
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def heard(self) -> tuple[Heard, ...]:
        """Every identifier of the last survey; none before the first."""
        return self._heard

    def look(self) -> None:
        """Begin a survey, unless one is under way or has just ended."""
        is_looking = self._thread is not None and self._thread.is_alive()
        is_early = time.monotonic() - self._begun_s < EVERY_S
        if self._open is None or is_looking or is_early or self._stopping.is_set():
            return
        self._begun_s = time.monotonic()
        self._thread = threading.Thread(target=self._run, args=(self._open,), name="can-around", daemon=True)
        self._thread.start()

    def forget(self) -> None:
        """Discard the last survey; the next silence starts one at once."""
        self._heard, self._begun_s = (), -EVERY_S

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        """End a survey under way; a channel that does not open keeps its thread a little longer."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join(within_s)

    def _run(self, open_receiver: OpenReceiver) -> None:
        bursts = []
        until_s = time.monotonic() + LOOK_S
        try:
            with closing(open_receiver()) as receiver:
                while time.monotonic() < until_s and not self._stopping.is_set():
                    bursts.append(receiver.receive(POLL_S).frames)
        except (OSError, can.CanError, BusError):
            pass  # the live source reports the fault of the channel
        self._heard = heard_of(frames for frames in bursts if len(frames))


def bus_survey_of(interface: str, channel: str, options: Mapping[str, Any]) -> BusSurvey:
    """A survey for channels that several programs may open: SocketCAN and the in-process bus."""
    is_shared = interface in ("socketcan", "virtual")
    return BusSurvey(opener_of(interface, channel, EVERY_IDENTIFIER, CAN_FD_BYTES, options) if is_shared else None)
