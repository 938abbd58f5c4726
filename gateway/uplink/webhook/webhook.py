"""The webhook thread: posts messages from the outbox to the receiver, one at a time, with retries."""

import logging
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from gateway.errors import ConfigurationError
from gateway.history import ESTIMATE, Delivery
from gateway.log import Event, OnEvent, log_event
from gateway.records import iso_utc
from gateway.status import DeadLetter, WebhookStatus
from gateway.uplink.forwarder import PAGE, BackOff, Forwarder
from gateway.uplink.outbox import Outbox, OutboxMessage
from gateway.uplink.webhook.receiver import PostResult, PostVerdict, WebhookReceiver
from gateway.uplink.webhook.settings import WebhookSettings

IDLE_S: Final = 5.0  # how often what waits is counted; a new message is seen at once
TRIES: Final = 3  # attempts for a message that the receiver reports as never acceptable
SHOWN: Final = 20  # dead letters
DEAD_LETTER: Final = "webhook_dead_letter"  # as the store keeps it


class Webhook(Forwarder[WebhookStatus]):
    """Runs until :meth:`stop`. Delivers at least once and in order: a message waits until the one before it is done.

    A message is done when the receiver accepted it, or when it is dead: 410 or 413 came ``TRIES`` times, or only
    refusals for ``give_up_s``. All other failures are retried with growing pauses, which are reset only by an accepted
    message. A message in flight when the service is killed may arrive twice, with the same id.
    """

    NAME = "webhook"

    def __init__(
        self,
        settings: WebhookSettings,
        outbox: Outbox,
        on_event: OnEvent = lambda kind, detail: None,
        back_off: BackOff | None = None,
        *,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(outbox, WebhookStatus(settings.receiver), back_off, settings.back_off_max_s)
        self._settings = settings
        self._on_event = on_event
        self._receiver = WebhookReceiver(settings)
        self._clock_s = clock_s

    def _deliver(self) -> None:
        while not self._stop.is_set():
            messages = self._outbox.next_messages(PAGE)
            self._look()
            for message in messages:
                if not self._done(message):
                    return
                self._outbox.delivered(message)
            if not messages:
                self._outbox.wait(IDLE_S)

    def _done(self, message: OutboxMessage) -> bool:
        """Try until the message is accepted or dead; False if the service was stopped before."""
        n_unwanted = 0
        refused_since_s: float | None = None
        while not self._stop.is_set():
            answer = self._posted(message)
            if answer.verdict is PostVerdict.TAKEN:
                self._took()
                return True
            self._note_try(answer.reason)
            n_unwanted += answer.verdict is PostVerdict.UNWANTED
            if answer.verdict is PostVerdict.AWAY:
                refused_since_s = None
            elif refused_since_s is None:
                refused_since_s = self._clock_s()
            refused_s = 0.0 if refused_since_s is None else self._clock_s() - refused_since_s
            if n_unwanted >= TRIES or refused_s >= self._settings.give_up_s:
                self._bury(message, answer.reason)
                return True
            self._pause(max(self._back_off.next_s(), answer.retry_after_s))
        return False

    def _posted(self, message: OutboxMessage) -> PostResult:
        try:
            return self._receiver.post(message)
        except ConfigurationError as fault:
            return PostResult(PostVerdict.AWAY, str(fault))

    def _took(self) -> None:
        if self._report.last_fault is not None:
            log_event(Event.WEBHOOK_CONNECTED, receiver=self._settings.receiver)
        self._report = replace(self._report, n_delivered=self._report.n_delivered + 1, last_fault=None)
        self._back_off.reset()

    def _bury(self, message: OutboxMessage, reason: str) -> None:
        """Give up on the message; it stays in the history of the vehicle."""
        dead = DeadLetter(message.id, reason, iso_utc(time.time_ns()))
        log_event(
            Event.WEBHOOK_REFUSED, level=logging.ERROR, receiver=self._settings.receiver, id=message.id, reason=reason
        )
        self._on_event(DEAD_LETTER, {"receiver": self._settings.receiver, "id": message.id, "reason": reason})
        self._report = replace(self._report, n_dead=self._report.n_dead + 1, dead=(*self._report.dead, dead)[-SHOWN:])

    def _n_pruned(self, found: Delivery) -> int:
        return found.n_pruned_entries + (found.n_pruned if ESTIMATE in self._settings.kinds else 0)

    def _note(self, fault: str) -> None:
        if fault != self._report.last_fault:
            log_event(Event.WEBHOOK_FAILED, level=logging.WARNING, receiver=self._settings.receiver, fault=fault)
        self._report = replace(self._report, last_fault=fault)

    def _note_try(self, fault: str) -> None:
        self._note(fault)
        self._report = replace(self._report, n_failed=self._report.n_failed + 1)
