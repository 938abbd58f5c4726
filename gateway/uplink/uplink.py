"""The uplink thread: takes messages from the outbox to the broker, and starts over when the link breaks."""

import logging
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

from gateway.log import Event, log_event
from gateway.status import UplinkStatus
from gateway.uplink.forwarder import PAGE, BackOff, Forwarder
from gateway.uplink.link import BrokerAnswer, LinkError, MqttLink
from gateway.uplink.outbox import Outbox, OutboxMessage
from gateway.uplink.settings import UplinkSettings

IDLE_S: Final = 5.0  # chosen: a turn with nothing to do; a new record ends it
TURN_S: Final = 0.5  # chosen: likewise while an answer is awaited
ANSWER_TIMEOUT_S: Final = 30.0  # chosen: a broker that takes longer counts as lost


class Uplink(Forwarder[UplinkStatus]):
    """Runs until :meth:`stop`, which announces that the vehicle is offline. Delivers at least once and in order.

    After a broken connection the message in flight may arrive twice, with the same id; after a kill, also those whose
    delivery was not on disk yet. Failures are in :meth:`report` and are retried.
    """

    NAME = "uplink"

    def __init__(
        self,
        settings: UplinkSettings,
        outbox: Outbox,
        birth: Mapping[str, Any],
        connect: Callable[[UplinkSettings, Mapping[str, Any]], MqttLink] = MqttLink,
        back_off: BackOff | None = None,
    ) -> None:
        super().__init__(outbox, UplinkStatus(settings.broker), back_off, settings.back_off_max_s)
        self._settings = settings
        self._birth = {"state": "online", **birth}
        self._connect = connect

    def _deliver(self) -> None:
        """Deliver until stopped. Raises LinkError if the connection breaks."""
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

    def _deliver_in_turn(self, link: MqttLink) -> None:
        """Send one message at a time and wait for the broker's acknowledgement, which keeps the order."""
        waiting: deque[OutboxMessage] = deque()
        while not self._stopping.is_set():
            if not waiting:
                waiting.extend(self._outbox.next_messages(PAGE))
                self._look()
            if waiting:
                self._deliver_one(link, waiting.popleft())
            else:
                link.turn(IDLE_S)

    def _deliver_one(self, link: MqttLink, message: OutboxMessage) -> None:
        """Send one message and wait for its acknowledgement. Raises LinkError if there is none or it asks to retry."""
        answer = self._answer_for(link, link.send(message))
        if answer is None or message.is_extra:  # the refusal of a copy does not matter
            return
        report = self._report
        if answer.is_accepted:
            self._report = replace(report, n_delivered=report.n_delivered + 1)
        elif answer.is_hopeless:
            log_event(
                Event.UPLINK_REFUSED, level=logging.ERROR, broker=report.broker, id=message.id, reason=answer.reason
            )
            self._report = replace(report, n_refused=report.n_refused + 1)
        else:
            raise LinkError(f"{report.broker} does not take estimates: {answer.reason}")
        self._outbox.delivered(message)
        self._back_off.reset()

    def _answer_for(self, link: MqttLink, mid: int) -> BrokerAnswer | None:
        """The broker's answer; None if the service was stopped meanwhile. Raises LinkError after ANSWER_TIMEOUT_S."""
        end_s = time.monotonic() + ANSWER_TIMEOUT_S
        while not self._stopping.is_set():
            for answer in link.turn(TURN_S):
                if answer.mid == mid:
                    return answer
            if time.monotonic() > end_s:
                raise LinkError(f"{self._report.broker} did not acknowledge for {ANSWER_TIMEOUT_S:g} s")
        return None

    def _note(self, fault: str) -> None:
        """Report a failure: as a lost connection if there was one, else as a broker that was not reached."""
        if fault != self._report.last_fault:
            was_connected = self._report.n_connections > 0 and self._report.last_fault is None
            event = Event.UPLINK_LOST if was_connected else Event.UPLINK_NOT_REACHED
            log_event(event, level=logging.WARNING, broker=self._report.broker, fault=fault)
        self._report = replace(self._report, last_fault=fault)
