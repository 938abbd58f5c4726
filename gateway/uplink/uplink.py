"""The uplink thread: takes letters from the outbox to the broker, and starts over when the link breaks."""

import logging
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final, Protocol

from gateway.errors import ConfigurationError, StoreError
from gateway.log import Event, log_event
from gateway.status import UplinkStatus
from gateway.uplink.back_off import BackOff
from gateway.uplink.forwarder import PAGE, Forwarder
from gateway.uplink.link import Answer, LinkError, MqttLink
from gateway.uplink.outbox import Letter, Outbox
from gateway.uplink.settings import UplinkSettings

POLL_S: Final = 0.5  # how long a new estimate may lie before it is seen
ANSWER_TIMEOUT_S: Final = 30.0  # a broker that takes longer is as good as gone


class Link(Protocol):
    """A connection to a broker."""

    def send(self, letter: Letter) -> int: ...
    def turn(self, timeout_s: float) -> list[Answer]: ...
    def close(self) -> None: ...
    def abandon(self) -> None: ...


class Uplink(Forwarder[UplinkStatus]):
    """Runs until :meth:`stop`, where it says goodbye. At least once, in order: no letter overtakes an earlier one.

    After a break the one letter under way may arrive a second time; it carries its id. After a kill
    those may whose delivery was not on disk yet. What fails is told in :meth:`report` and tried again.
    """

    NAME = "uplink"

    def __init__(
        self,
        settings: UplinkSettings,
        outbox: Outbox,
        birth: Mapping[str, Any],
        connect: Callable[[UplinkSettings, Mapping[str, Any]], Link] = MqttLink,
        back_off: BackOff | None = None,
    ) -> None:
        super().__init__(outbox, UplinkStatus(settings.broker), back_off, settings.back_off_max_s)
        self._settings = settings
        self._birth = {"state": "online", **birth}
        self._connect = connect

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                self._one_connection()
            except (LinkError, ConfigurationError, StoreError, TimeoutError, OSError) as fault:
                self._note(str(fault))
                self._outbox.rewind()
                self._pause(self._back_off.next_s())

    def _one_connection(self) -> None:
        """Deliver until asked to stop, or until LinkError."""
        link = self._connect(self._settings, self._birth)
        self._report = replace(
            self._report, is_connected=True, n_connections=self._report.n_connections + 1, last_fault=None
        )
        log_event(Event.UPLINK_CONNECTED, broker=self._settings.broker)
        try:
            self._deliver(link)
            link.close()
        except BaseException:
            self._report = replace(self._report, n_cuts=self._report.n_cuts + 1)
            link.abandon()
            raise
        finally:
            self._report = replace(self._report, is_connected=False)

    def _deliver(self, link: Link) -> None:
        """One letter at a time: the next leaves when the broker has answered for the last, so order cannot break."""
        waiting: deque[Letter] = deque()
        while not self._stop.is_set():
            if not waiting:
                waiting.extend(self._outbox.next_letters(PAGE))
                self._look()
            if waiting:
                self._deliver_one(link, waiting.popleft())
            else:
                link.turn(POLL_S)

    def _deliver_one(self, link: Link, letter: Letter) -> None:
        """Until the broker has answered for it. Raises LinkError where it did not, or may take it another time."""
        answer = self._answer_for(link, link.send(letter))
        if answer is None:
            return
        report = self._report
        if answer.is_accepted:
            self._report = replace(report, n_delivered=report.n_delivered + 1)
        elif answer.is_hopeless:
            log_event(
                Event.UPLINK_REFUSED, level=logging.ERROR, broker=report.broker, id=letter.id, reason=answer.reason
            )
            self._report = replace(report, n_refused=report.n_refused + 1)
        else:
            raise LinkError(f"{report.broker} does not take estimates: {answer.reason}")
        self._outbox.delivered(letter)
        self._back_off.reset()

    def _answer_for(self, link: Link, mid: int) -> Answer | None:
        """None where the service stopped meanwhile."""
        end_s = time.monotonic() + ANSWER_TIMEOUT_S
        while not self._stop.is_set():
            for answer in link.turn(POLL_S):
                if answer.mid == mid:
                    return answer
            if time.monotonic() > end_s:
                raise LinkError(f"{self._report.broker} did not acknowledge for {ANSWER_TIMEOUT_S:g} s")
        return None

    def _note(self, fault: str) -> None:
        """Keep what went wrong, and tell it where it is news; a connection that was there had no fault."""
        if fault != self._report.last_fault:
            was_connected = self._report.n_connections > 0 and self._report.last_fault is None
            event = Event.UPLINK_LOST if was_connected else Event.UPLINK_NOT_REACHED
            log_event(event, level=logging.WARNING, broker=self._report.broker, fault=fault)
        self._report = replace(self._report, last_fault=fault)
