"""The webhook: signed HTTP requests with alarms and events, posted one at a time, with retries.

The format is that of Standard Webhooks (docs/architecture.md).
"""

import asyncio
import base64
import hashlib
import hmac
import json
import logging
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Any, Final

from gateway.errors import ConfigurationError
from gateway.log import Event, OnEvent, log_event, tell_event
from gateway.part import BackOff
from gateway.records import json_line
from gateway.status import WebhookStatus
from gateway.uplink.outbox import Outbox, OutboxMessage
from gateway.uplink.sender import NotTakenError, Sender
from gateway.uplink.settings import WebhookSettings

MOST_PAUSE_S: Final = 3600.0  # chosen: whatever Retry-After says
UNWANTED: Final = frozenset({410, 413})  # gone for good, too large: the receiver will never take this very message
NO_ANSWER: Final = 0
AWAY: Final = frozenset({NO_ANSWER, 408, 425, 429, 502, 503, 504})  # RFC 9110, 8470 and 6585: later it may succeed


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


def body_of(message: OutboxMessage) -> bytes:
    """The JSON body: ``type`` of the ``data``, and ``timestamp``, the time of the event and not of the request."""
    record: dict[str, Any] = json.loads(message.text)
    happened = record.get("t_end") or record.get("t_start")  # an alarm that stands has no end
    return json_line({"type": message.kind, "timestamp": happened, "data": record}).encode()


class Webhook(Sender[WebhookStatus]):
    """Runs until :meth:`stop`. Delivers at least once and in order: a message waits until the one before it is done.

    A message is done when the receiver accepted it, or when it is dead: 410 or 413 came, or only refusals for
    ``give_up_s``. All other failures are retried with growing pauses, which only an accepted message resets. A message
    in flight when the service is killed may arrive twice, with the same id.
    """

    NAME = "webhook"

    def __init__(
        self, settings: WebhookSettings, outbox: Outbox, on_event: OnEvent = lambda kind, detail: None,
        back_off: BackOff | None = None, *, clock_s: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        super().__init__(outbox, WebhookStatus(settings.receiver), back_off, settings.back_off_max_s)
        self._settings, self._on_event, self._clock_s = settings, on_event, clock_s
        self._tls = settings.tls_context()
        self._refused_since_s: float | None = None  # the message that is tried

    def _deliver(self, message: OutboxMessage) -> bool:
        """Post a message once; True if it is done. Raises NotTakenError if it must come again."""
        status, told, wait_s = self._posted(message)
        report, now_s = self._report, self._clock_s()
        if 200 <= status < 300:
            if report.last_fault is not None:
                log_event(Event.WEBHOOK_CONNECTED, receiver=report.receiver)
            self._report = replace(report, n_delivered=report.n_delivered + 1, last_fault=None)
            self._refused_since_s = None
            self._back_off.reset()
            return True
        self._report = replace(report, n_failed=report.n_failed + 1)
        self._refused_since_s = None if status in AWAY else self._refused_since_s or now_s
        if status not in UNWANTED and now_s - (self._refused_since_s or now_s) < 3600.0 * self._settings.give_up_h:
            raise NotTakenError(told, wait_s)
        self._note(told)
        dead = {"receiver": report.receiver, "id": message.id, "reason": told}
        tell_event(Event.WEBHOOK_REFUSED, dead, self._on_event, logging.ERROR)  # it stays in the history
        self._report = replace(self._report, n_dead=report.n_dead + 1)
        self._refused_since_s = None
        return True

    def _posted(self, message: OutboxMessage) -> tuple[int, str, float]:
        """One attempt -> HTTP status or NO_ANSWER, what happened, and the seconds that Retry-After asks for."""
        import httpx  # noqa: PLC0415 # a tenth of a second at every start, which few vehicles need

        s = self._settings

        async def post() -> httpx.Response:
            body = body_of(message)
            headers = {"Content-Type": "application/json", "User-Agent": f"springscale/{version('springscale')}"}
            headers |= signed(s.secrets(), message.id, int(time.time()), body)
            async with (
                asyncio.timeout(2.0 * s.timeout_s),  # ends an answer that drips: httpx's begins again with every byte
                httpx.AsyncClient(verify=self._tls or False, timeout=s.timeout_s, trust_env=False) as client,
                client.stream("POST", s.url, content=body, headers=headers) as answer,  # follows no redirection
            ):
                return answer

        try:
            answer = asyncio.run(post())
        except ConfigurationError as fault:
            return NO_ANSWER, str(fault), 0.0
        except (TimeoutError, httpx.TimeoutException):
            return NO_ANSWER, f"{s.receiver}: its answer took too long", 0.0
        except (httpx.HTTPError, OSError) as fault:
            return NO_ANSWER, f"{s.receiver}: {_root_of(fault)}", 0.0
        told = f"{s.receiver} answered {answer.status_code} {answer.reason_phrase}".rstrip()
        wait = answer.headers.get("Retry-After", "")
        return answer.status_code, told, min(float(wait), MOST_PAUSE_S) if wait.isdecimal() else 0.0

    def _note(self, fault: str) -> None:
        if fault != self._report.last_fault:
            log_event(Event.WEBHOOK_FAILED, level=logging.WARNING, receiver=self._settings.receiver, fault=fault)
        self._report = replace(self._report, last_fault=fault)


def _root_of(fault: BaseException) -> str:
    """The system's own words, below those of the libraries ("All connection attempts failed")."""
    if isinstance(fault, ConnectionError) and fault.errno is not None:
        return os.strerror(fault.errno)
    below = fault.exceptions[0] if isinstance(fault, BaseExceptionGroup) else fault.__cause__ or fault.__context__
    return _root_of(below) if below is not None else str(fault) or type(fault).__name__
