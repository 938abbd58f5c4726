"""The webhook thread: takes letters from the outbox to the receiver, one at a time, and tries again."""

import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

from gateway.errors import ConfigurationError
from gateway.history import ESTIMATE, Delivery
from gateway.log import Event, log_event
from gateway.records import iso_utc
from gateway.status import DeadLetter, WebhookStatus
from gateway.uplink.back_off import BackOff
from gateway.uplink.forwarder import PAGE, Forwarder
from gateway.uplink.outbox import Letter, Outbox
from gateway.uplink.webhook.receiver import Answer, Receiver, Verdict
from gateway.uplink.webhook.settings import WebhookSettings

IDLE_S: Final = 5.0  # how often what waits is counted; a new letter is seen at once
TRIES: Final = 3  # of a letter that the receiver says it will never take
SHOWN: Final = 20  # dead letters
DEAD_LETTER: Final = "webhook_dead_letter"  # as the store keeps it

OnEvent = Callable[[str, Mapping[str, Any]], object]


class Webhook(Forwarder[WebhookStatus]):
    """Runs until :meth:`stop`. At least once, in order: a later letter never leaves before an earlier one is done.

    A letter is done when the receiver took it, or when it is dead: 410 or 413 came for it ``TRIES`` times, or nothing
    but refusals for ``give_up_s`` of its own. Everything else says nothing of the letter: it waits, with growing
    pauses, which only a letter that was taken makes short again. What was under way when the service was killed may
    come twice; it carries its id.
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
        self._receiver = Receiver(settings)
        self._clock_s = clock_s

    def _deliver(self) -> None:
        while not self._stop.is_set():
            letters = self._outbox.next_letters(PAGE)
            self._look()
            for letter in letters:
                if not self._done(letter):
                    return
                self._outbox.delivered(letter)
            if not letters:
                self._outbox.wait(IDLE_S)

    def _done(self, letter: Letter) -> bool:
        """Try until the letter is taken or dead; False where the service stopped before."""
        n_unwanted = 0
        refused_since_s: float | None = None
        while not self._stop.is_set():
            answer = self._posted(letter)
            if answer.verdict is Verdict.TAKEN:
                self._took()
                return True
            self._note_try(answer.reason)
            n_unwanted += answer.verdict is Verdict.UNWANTED
            if answer.verdict is Verdict.AWAY:
                refused_since_s = None
            elif refused_since_s is None:
                refused_since_s = self._clock_s()
            refused_s = 0.0 if refused_since_s is None else self._clock_s() - refused_since_s
            if n_unwanted >= TRIES or refused_s >= self._settings.give_up_s:
                self._bury(letter, answer.reason)
                return True
            self._pause(max(self._back_off.next_s(), answer.retry_after_s))
        return False

    def _posted(self, letter: Letter) -> Answer:
        try:
            return self._receiver.post(letter)
        except ConfigurationError as fault:
            return Answer(Verdict.AWAY, str(fault))

    def _took(self) -> None:
        if self._report.last_fault is not None:
            log_event(Event.WEBHOOK_CONNECTED, receiver=self._settings.receiver)
        self._report = replace(self._report, n_delivered=self._report.n_delivered + 1, last_fault=None)
        self._back_off.reset()

    def _bury(self, letter: Letter, reason: str) -> None:
        """It goes no more; the vehicle's own history still has it."""
        dead = DeadLetter(letter.id, reason, iso_utc(time.time_ns()))
        log_event(
            Event.WEBHOOK_REFUSED, level=logging.ERROR, receiver=self._settings.receiver, id=letter.id, reason=reason
        )
        self._on_event(DEAD_LETTER, {"receiver": self._settings.receiver, "id": letter.id, "reason": reason})
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
