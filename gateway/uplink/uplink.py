"""The uplink thread: takes letters from the outbox to the broker, and starts over when the link breaks."""

import logging
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final, Protocol

from gateway.log import Event, log_event
from gateway.status import UplinkStatus
from gateway.uplink.back_off import BackOff
from gateway.uplink.forwarder import PAGE, Forwarder
from gateway.uplink.link import Answer, LinkError, MqttLink
from gateway.uplink.outbox import Letter, Outbox
from gateway.uplink.settings import UplinkSettings

IDLE_S: Final = 5.0  # a turn with nothing to do; a new record ends it
TURN_S: Final = 0.5  # likewise while an answer is awaited
ANSWER_TIMEOUT_S: Final = 30.0  # a broker that takes longer is as good as gone


class Link(Protocol):
    """A connection to a broker."""

    def send(self, letter: Letter) -> int: ...
    def turn(self, timeout_s: float) -> list[Answer]: ...
    def wake(self) -> None: ...
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

    def _deliver(self) -> None:
        """Deliver until asked to stop, or until LinkError."""
        link = self._connect(self._settings, self._birth)
        self._report = replace(
            self._report, is_connected=True, n_connections=self._report.n_connections + 1, last_fault=None
        )
        log_event(Event.UPLINK_CONNECTED, broker=self._settings.broker)
        self._outbox.call(link.wake)
        try:
            self._deliver_in_turn(link)
            link.close()
        except BaseException:
            self._report = replace(self._report, n_cuts=self._report.n_cuts + 1)
            link.abandon()
            raise
        finally:
            self._outbox.call(lambda: None)
            self._report = replace(self._report, is_connected=False)

    def _deliver_in_turn(self, link: Link) -> None:
        """One letter at a time: the next leaves when the broker has answered for the last, so order cannot break."""
        waiting: deque[Letter] = deque()
        while not self._stop.is_set():
            if not waiting:
                waiting.extend(self._outbox.next_letters(PAGE))
                self._look()
            if waiting:
                self._deliver_one(link, waiting.popleft())
            else:
                link.turn(IDLE_S)

    def _deliver_one(self, link: Link, letter: Letter) -> None:
        """Until the broker has answered for it. Raises LinkError where it did not, or may take it another time."""
        answer = self._answer_for(link, link.send(letter))
        if answer is None or letter.is_extra:  # a broker that does not want the copy gets the letter all the same
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
            for answer in link.turn(TURN_S):
                if answer.mid == mid:
                    return answer
            if time.monotonic() > end_s:
                raise LinkError(f"{self._report.broker} did not acknowledge for {ANSWER_TIMEOUT_S:g} s")
        return None

    def _note(self, fault: str) -> None:
        """As the forwarder's; a connection that was there had no fault."""
        if fault != self._report.last_fault:
            was_connected = self._report.n_connections > 0 and self._report.last_fault is None
            event = Event.UPLINK_LOST if was_connected else Event.UPLINK_NOT_REACHED
            log_event(event, level=logging.WARNING, broker=self._report.broker, fault=fault)
        self._report = replace(self._report, last_fault=fault)
