"""One attempt to hand a letter over: an HTTP POST on a connection of its own, and what its answer means."""

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
from gateway.uplink.outbox import Letter
from gateway.uplink.webhook.settings import WebhookSettings
from gateway.uplink.webhook.signature import signed

MOST_PAUSE_S: Final = 3600.0  # whatever Retry-After says
_READ: Final = 2048  # bytes of an answer: nobody needs its body
_OF_THE_LETTER: Final = frozenset({410, 413})  # gone for good, too large: everything else may pass
_BUSY: Final = frozenset({408, 425, 429, 502, 503, 504})


class Verdict(StrEnum):
    """What an answer means for the letter."""

    TAKEN = "taken"
    UNWANTED = "unwanted"  # the receiver will never take this very letter
    REFUSED = "refused"  # it answers, and not that it took it: its address, our secret, a fault of its own
    AWAY = "away"  # it does not answer, or says that it is busy


@dataclass(frozen=True, slots=True)
class Answer:
    """A verdict, why for people, and the pause that the receiver asks for."""

    verdict: Verdict
    reason: str
    retry_after_s: float = 0.0


class Receiver:
    """Where letters go. One attempt takes at most twice ``timeout_s``, however slowly bytes trickle in."""

    def __init__(self, settings: WebhookSettings, clock_s: Callable[[], float] = time.time) -> None:
        self._settings = settings
        self._clock_s = clock_s
        self._context = settings.tls_context()
        self._headers = {"Content-Type": "application/json", "User-Agent": f"springscale/{version('springscale')}"}

    def post(self, letter: Letter) -> Answer:
        """One attempt. Raises ConfigurationError where the secret cannot be read now."""
        body = body_of(letter)
        headers = self._headers | signed(self._settings.secrets(), letter.id, int(self._clock_s()), body)
        connection = self._connection()
        with _cut_off_after(2.0 * self._settings.timeout_s, connection) as was_cut_off:
            try:
                connection.request("POST", self._settings.path, body, headers)
                answer = connection.getresponse()
                answer.read(_READ)
            except (OSError, http.client.HTTPException, ValueError) as fault:  # ssl.SSLError is an OSError
                return Answer(Verdict.AWAY, f"{self._settings.receiver}: {fault or type(fault).__name__}")
            finally:
                connection.close()
        if was_cut_off.is_set():  # what came by then may look whole
            return Answer(Verdict.AWAY, f"{self._settings.receiver}: its answer took too long")
        return self._judged(answer)

    def _connection(self) -> http.client.HTTPConnection:
        s = self._settings
        if self._context is None:
            return http.client.HTTPConnection(s.host, s.port, timeout=s.timeout_s)
        return http.client.HTTPSConnection(s.host, s.port, timeout=s.timeout_s, context=self._context)

    def _judged(self, answer: http.client.HTTPResponse) -> Answer:
        verdict = verdict_of(answer.status)
        wait_s = _seconds(answer.getheader("Retry-After"), self._clock_s())
        return Answer(verdict, f"{self._settings.receiver} answered {answer.status} {answer.reason}".rstrip(), wait_s)


def verdict_of(status: int) -> Verdict:
    """Redirections are not followed: the address is to be set right."""
    if 200 <= status < 300:
        return Verdict.TAKEN
    if status in _OF_THE_LETTER:
        return Verdict.UNWANTED
    return Verdict.AWAY if status in _BUSY else Verdict.REFUSED


def body_of(letter: Letter) -> bytes:
    """``type`` says what ``data`` is, ``timestamp`` when it happened, which is not when it was sent."""
    record: dict[str, Any] = json.loads(letter.text)
    return json_line({"type": letter.kind, "timestamp": _happened(record), "data": record}).encode()


def _happened(record: dict[str, Any]) -> str | None:
    """When it last became another: an alarm's last step or acknowledgement, else its end."""
    if "steps" not in record:
        return record.get("t_end")
    moments: list[str] = [step["t"] for step in record["steps"]]
    if record["acknowledged"]:
        moments.append(record["acknowledged"]["at"])
    return max(moments)


def _seconds(retry_after: str | None, now_s: float) -> float:
    """Of a Retry-After header, seconds or a date (RFC 9110, 10.2.3); 0 where there is none that can be read."""
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
    """A socket's own time limit begins anew with every byte."""
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
