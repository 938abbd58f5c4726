"""The uplink: takes messages from the outbox to the broker one at a time, and starts over when the link breaks."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from gateway.log import Event, log_event
from gateway.part import BackOff
from gateway.status import UplinkStatus
from gateway.uplink.forwarder import Forwarder, NotTakenError
from gateway.uplink.link import MqttLink
from gateway.uplink.outbox import Outbox, OutboxMessage
from gateway.uplink.settings import UplinkSettings
from gateway.uplink.statements_topic import StatementsDesk, TakeStatements

Connect = Callable[[UplinkSettings, Mapping[str, Any], Callable[[], None], Callable[[], bool]], MqttLink]


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
        connect: Connect = MqttLink,
        back_off: BackOff | None = None,
        take_statements: TakeStatements | None = None,
    ) -> None:
        """``take_statements`` is handed what comes from the broker, if the settings want it."""
        super().__init__(outbox, UplinkStatus(settings.broker), back_off, settings.back_off_max_s)
        self._settings, self._birth, self._connect = settings, {"state": "online", **birth}, connect
        self._desk = StatementsDesk(take_statements) if settings.statements and take_statements is not None else None
        self._refusal: str | None = None  # of the last record, until one is accepted

    def _work(self) -> None:
        """Deliver until stopped. Raises NotTakenError if the connection breaks."""
        link = self._connect(self._settings, self._birth, self._outbox.tell_news, self._stopping.is_set)
        self._report = replace(
            self._report, is_connected=True, n_connections=self._report.n_connections + 1, last_fault=self._refusal
        )
        log_event(Event.UPLINK_CONNECTED, broker=self._settings.broker)
        try:
            self._deliver_all(partial(self._deliver, link), partial(self._hear, link))
            link.close()
        except BaseException:
            self._report = replace(self._report, n_cuts=self._report.n_cuts + 1)
            link.abandon()
            raise
        finally:
            self._report = replace(self._report, is_connected=False)

    def _hear(self, link: MqttLink) -> None:
        """Take the statements that came; each is acknowledged when it is on disk or refused for good. Raises
        NotTakenError if the link is lost.
        """
        link.check()
        if self._desk is None:
            return
        if link.subscription_fault is not None:
            self._desk.refuse_subscription(link.subscription_fault)
            link.subscription_fault = None
        while link.statements and not self._stopping.is_set() and self._desk.is_done(link.statements[0]):
            link.acknowledge_statements()
        self._report = replace(self._report, statements=self._desk.report)

    def _deliver(self, link: MqttLink, message: OutboxMessage) -> bool:
        """Send one message; False at a stop before its answer. Raises NotTakenError if the answer asks to retry."""
        answer = link.send(message, self._stopping.is_set)
        if answer is None:
            return False
        if message.is_extra:  # the refusal of a copy does not matter
            return True
        report = self._report
        if answer.is_accepted:
            self._refusal = None
            self._report = replace(report, n_delivered=report.n_delivered + 1, last_fault=None)
        elif answer.is_hopeless:
            log_event(
                Event.UPLINK_REFUSED, level=logging.ERROR, broker=report.broker, id=message.id, reason=answer.reason
            )
            self._refusal = f"{report.broker} refuses records for good: {answer.reason}"
            self._report = replace(report, n_refused=report.n_refused + 1, last_fault=self._refusal)
        else:
            self._refusal = f"{report.broker} does not take estimates: {answer.reason}"
            raise NotTakenError(self._refusal)
        self._back_off.reset()
        return True

    def _note(self, fault: str) -> None:
        """Report a failure: as a lost connection if there was one, else as a broker that was not reached."""
        if fault != self._report.last_fault:
            was_connected = self._report.n_connections > 0 and self._report.last_fault is None
            event = Event.UPLINK_LOST if was_connected else Event.UPLINK_NOT_REACHED
            log_event(event, level=logging.WARNING, broker=self._report.broker, fault=fault)
        self._report = replace(self._report, last_fault=fault)
