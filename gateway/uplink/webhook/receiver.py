"""One attempt to deliver a message: an HTTP POST on its own connection, and the meaning of the answer."""

import contextlib
import http.client
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from email.utils import parsedate_to_datetime
from enum import StrEnum
from importlib.metadata import version
from typing import Any, Final

from gateway.records import json_line
from gateway.uplink.outbox import OutboxMessage
from gateway.uplink.webhook.settings import WebhookSettings
from gateway.uplink.webhook.signature import signed

MOST_PAUSE_S: Final = 3600.0  # whatever Retry-After says
_READ: Final = 2048  # bytes read of an answer; its body is not used
_OF_THE_MESSAGE: Final = frozenset({410, 413})  # gone for good, too large: everything else may pass
_BUSY: Final = frozenset({408, 425, 429, 502, 503, 504})


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
    """Time of the last change: the last step or acknowledgement of an alarm, else the end of the record."""
    if "steps" not in record:
        return record.get("t_end")
    moments: list[str] = [step["t"] for step in record["steps"]]
    if record["acknowledged"]:
        moments.append(record["acknowledged"]["at"])
    return max(moments)


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
