"""The webhook: signed HTTP requests with alarms and events, posted one at a time, with retries.

The format is that of Standard Webhooks (docs/adr/webhook-by-the-standard-library.md).
"""

import base64
import contextlib
import hashlib
import hmac
import http.client
import json
import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from email.utils import parsedate_to_datetime
from enum import StrEnum
from importlib.metadata import version
from typing import Any, Final

from gateway.errors import ConfigurationError
from gateway.history import ESTIMATE, Delivery
from gateway.log import Event, OnEvent, log_event
from gateway.records import iso_utc, json_line
from gateway.status import DeadLetter, WebhookStatus
from gateway.uplink.forwarder import PAGE, BackOff, Forwarder
from gateway.uplink.outbox import Outbox, OutboxMessage
from gateway.uplink.settings import WebhookSettings

MOST_PAUSE_S: Final = 3600.0  # chosen: whatever Retry-After says
_READ: Final = 2048  # chosen: bytes read of an answer; its body is not used
_OF_THE_MESSAGE: Final = frozenset({410, 413})  # gone for good, too large: everything else may pass
_BUSY: Final = frozenset({408, 425, 429, 502, 503, 504})  # RFC 9110, 8470 and 6585: a later attempt may succeed


class PostVerdict(StrEnum):
    """Meaning of an answer for the message."""

    TAKEN = "taken"
    UNWANTED = "unwanted"  # the receiver will never take this very message
    REFUSED = "refused"  # it did not accept it: wrong address, wrong secret, or a fault of the receiver
    AWAY = "away"  # it does not answer, or reports that it is busy


@dataclass(frozen=True, slots=True)
class PostResult:
    """A verdict, the reason for people, and the pause that the receiver asks for."""

    verdict: PostVerdict
    reason: str
    retry_after_s: float = 0.0


class WebhookReceiver:
    """Posts messages to the receiver. One attempt takes at most twice ``timeout_s``, however slowly bytes arrive."""

    def __init__(self, settings: WebhookSettings, clock_s: Callable[[], float] = time.time) -> None:
        self._settings = settings
        self._clock_s = clock_s
        self._context = settings.tls_context()
        self._headers = {"Content-Type": "application/json", "User-Agent": f"springscale/{version('springscale')}"}

    def post(self, message: OutboxMessage) -> PostResult:
        """One attempt. Raises ConfigurationError if the secret cannot be read."""
        body = body_of(message)
        headers = self._headers | signed(self._settings.secrets(), message.id, int(self._clock_s()), body)
        connection = self._connection()
        with _cut_off_after(2.0 * self._settings.timeout_s, connection) as was_cut_off:
            try:
                connection.request("POST", self._settings.path, body, headers)
                answer = connection.getresponse()
                answer.read(_READ)
            except (OSError, http.client.HTTPException, ValueError) as fault:  # ssl.SSLError is an OSError
                return PostResult(PostVerdict.AWAY, f"{self._settings.receiver}: {fault or type(fault).__name__}")
            finally:
                connection.close()
        if was_cut_off.is_set():  # a truncated answer may look complete
            return PostResult(PostVerdict.AWAY, f"{self._settings.receiver}: its answer took too long")
        return self._judged(answer)

    def _connection(self) -> http.client.HTTPConnection:
        s = self._settings
        if self._context is None:
            return http.client.HTTPConnection(s.host, s.port, timeout=s.timeout_s)
        return http.client.HTTPSConnection(s.host, s.port, timeout=s.timeout_s, context=self._context)

    def _judged(self, answer: http.client.HTTPResponse) -> PostResult:
        verdict = post_verdict_of(answer.status)
        wait_s = _seconds(answer.getheader("Retry-After"), self._clock_s())
        return PostResult(
            verdict, f"{self._settings.receiver} answered {answer.status} {answer.reason}".rstrip(), wait_s
        )


def signed(secrets: Sequence[bytes], letter_id: str, t_s: int, body: bytes) -> dict[str, str]:
    """The headers of one attempt at ``t_s`` (Unix seconds); a retry has the same id and another time.

    HMAC-SHA256 over id, time and body: Standard Webhooks 1.0.0 (standard-webhooks/spec), "Signature scheme" and
    "Webhook headers".
    """
    content = f"{letter_id}.{t_s}.".encode() + body
    marks = (base64.b64encode(hmac.digest(secret, content, hashlib.sha256)).decode() for secret in secrets)
    return {
        "webhook-id": letter_id,
        "webhook-timestamp": str(t_s),
        "webhook-signature": " ".join(f"v1,{mark}" for mark in marks),
    }


def post_verdict_of(status: int) -> PostVerdict:
    """The verdict for an HTTP status. Redirections are not followed and count as a refusal."""
    if 200 <= status < 300:
        return PostVerdict.TAKEN
    if status in _OF_THE_MESSAGE:
        return PostVerdict.UNWANTED
    return PostVerdict.AWAY if status in _BUSY else PostVerdict.REFUSED


def body_of(message: OutboxMessage) -> bytes:
    """The JSON body: ``type`` of the ``data``, and ``timestamp``, the time of the event and not of the request."""
    record: dict[str, Any] = json.loads(message.text)
    return json_line({"type": message.kind, "timestamp": _happened(record), "data": record}).encode()


def _happened(record: dict[str, Any]) -> str | None:
    """Time of the last change: the beginning of an alarm that stands, else the end of the record."""
    return record.get("t_end") or record.get("t_start")


def _seconds(retry_after: str | None, now_s: float) -> float:
    """Pause of a Retry-After header, given in seconds or as a date (RFC 9110, 10.2.3); 0 if it cannot be read."""
    if retry_after is None:
        return 0.0
    if retry_after.strip().isdecimal():
        wait_s = float(retry_after)
    else:
        try:
            wait_s = parsedate_to_datetime(retry_after).timestamp() - now_s
        except (ValueError, OverflowError):  # a year or a zone that no machine number holds
            return 0.0
    return min(max(wait_s, 0.0), MOST_PAUSE_S)


@contextlib.contextmanager
def _cut_off_after(limit_s: float, connection: http.client.HTTPConnection) -> Iterator[threading.Event]:
    """Limit the total time of an attempt: the timeout of a socket restarts with every byte."""
    is_cut_off = threading.Event()

    def cut() -> None:
        is_cut_off.set()
        with contextlib.suppress(OSError, AttributeError):  # not open yet, or no longer
            connection.sock.shutdown(socket.SHUT_RDWR)

    timer = threading.Timer(limit_s, cut)
    timer.daemon = True
    timer.start()
    try:
        yield is_cut_off
    finally:
        timer.cancel()


IDLE_S: Final = 5.0  # chosen: how often what waits is counted; a new message is seen at once
TRIES: Final = 3  # chosen: attempts for a message that the receiver reports as never acceptable
SHOWN: Final = 20  # chosen: dead letters
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
        while not self._stopping.is_set():
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
        while not self._stopping.is_set():
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
