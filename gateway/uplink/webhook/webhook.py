"""The webhook thread: takes letters from the outbox to the receiver, one at a time, and tries again."""

import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

from gateway.errors import ConfigurationError, StoreError
from gateway.history import Delivery
from gateway.log import Event, log_event
from gateway.records import iso_utc
from gateway.status import DeadLetter, WebhookStatus
from gateway.uplink.back_off import BackOff
from gateway.uplink.forwarder import PAGE, Forwarder
from gateway.uplink.outbox import ESTIMATE, Letter, Outbox
from gateway.uplink.webhook.receiver import Answer, Receiver, Verdict
from gateway.uplink.webhook.settings import WebhookSettings

POLL_S: Final = 1.0  # how long a new letter may lie before it is seen
TRIES: Final = 3  # of a letter that the receiver finds wrong
SHOWN: Final = 20  # dead letters
DEAD_LETTER: Final = "webhook_dead_letter"  # as the store keeps it

OnEvent = Callable[[str, Mapping[str, Any]], object]


class Webhook(Forwarder[WebhookStatus]):
    """Runs until :meth:`stop`. At least once, in order: a later letter never leaves before an earlier one is done.

    A letter is done when the receiver took it, or when it is dead: found wrong ``TRIES`` times, or tried as often where
    nothing but refusals came for ``give_up_s``. While the receiver is away everything waits. What was under way when
    the service was killed may come twice; it carries its id.
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
        poll_s: float = POLL_S,
    ) -> None:
        super().__init__(outbox, WebhookStatus(settings.receiver), back_off, settings.back_off_max_s)
        self._settings = settings
        self._on_event = on_event
        self._receiver = Receiver(settings)
        self._clock_s = clock_s
        self._poll_s = poll_s
        self._refused_since_s: float | None = None

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                letters = self._outbox.next_letters(PAGE)
                self._look()
            except (StoreError, TimeoutError, OSError) as fault:
                self._note(str(fault))
                self._pause(self._back_off.next_s())
                continue
            for letter in letters:
                if not self._done(letter):
                    return
                self._outbox.delivered(letter)
            if not letters:
                self._stop.wait(self._poll_s)

    def _done(self, letter: Letter) -> bool:
        """Try until the letter is taken or dead; False where the service stopped before."""
        n_tries = n_unwanted = 0
        while not self._stop.is_set():
            answer, n_tries = self._posted(letter), n_tries + 1
            n_unwanted += answer.verdict is Verdict.UNWANTED
            refused_s = self._refused_s(answer.verdict)
            if answer.verdict is Verdict.TAKEN:
                self._took()
                return True
            self._note(answer.reason, is_try=True)
            if n_unwanted >= TRIES or (n_tries >= TRIES and refused_s >= self._settings.give_up_s):
                self._bury(letter, answer.reason)
                return True
            self._pause(max(self._back_off.next_s(), answer.retry_after_s))
        return False

    def _refused_s(self, verdict: Verdict) -> float:
        """For how long nothing but refusals has come, of whichever letter."""
        if verdict in {Verdict.TAKEN, Verdict.AWAY}:
            self._refused_since_s = None
            return 0.0
        if self._refused_since_s is None:
            self._refused_since_s = self._clock_s()
        return self._clock_s() - self._refused_since_s

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
        self._back_off.reset()

    def _n_pruned(self, found: Delivery) -> int:
        return found.n_pruned_entries + (found.n_pruned if ESTIMATE in self._settings.kinds else 0)

    def _note(self, fault: str, *, is_try: bool = False) -> None:
        """Keep what went wrong, and tell it where it is news."""
        if fault != self._report.last_fault:
            log_event(Event.WEBHOOK_FAILED, level=logging.WARNING, receiver=self._settings.receiver, fault=fault)
        self._report = replace(self._report, n_failed=self._report.n_failed + is_try, last_fault=fault)
