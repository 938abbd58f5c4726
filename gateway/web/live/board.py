"""The board: the latest estimates, ready to be sent. The pipeline writes it, the web reads it."""

import json
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Final

from fastapi.sse import ServerSentEvent
from starlette.responses import Response
from starlette.types import Scope

from gateway.estimates.as_json import estimate_from_json, estimate_to_json
from gateway.estimates.batch_estimate import Estimate, Weights
from gateway.records import Why, json_line
from gateway.store.journal import ESTIMATE, REJECTION
from gateway.web.live.stream import Fanout

PROVISIONAL: Final = "provisional"
_JSON: Final = {None: b"null", True: b"true", False: b"false"}
_NOT_CALIBRATED: Final = Weights()


def _nothing_yet(weights: Weights) -> dict[str, Any]:
    """The JSON of the estimate before the first: its names, all null, the reason, and the facts that weights lack."""
    blank = estimate_to_json(Estimate(0, 0, "", rejected=(Why.NO_ESTIMATE_YET,), weights=weights))
    return {**dict.fromkeys(blank), **{name: blank[name] for name in ("shares", "diagnostics", "weights", "rejected")}}


def boot_clock_s() -> float:
    """Monotonic seconds that include suspend, so that an estimate ages while the machine sleeps."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def kind_of(estimate: Estimate) -> str:
    """The name an estimate has on the stream."""
    if estimate.is_provisional:
        return PROVISIONAL
    return ESTIMATE if estimate.counted else REJECTION


@dataclass(frozen=True, slots=True)
class Shown:
    """The estimate that ``latest`` shows (None before the first), and its reported age."""

    estimate: Estimate | None
    age_s: float | None
    is_stale: bool


@dataclass(frozen=True, slots=True)
class _Answer:
    """One version of ``latest``: encoded once per estimate, sent many times with the present age."""

    tag: str
    rest: bytes = field(repr=False)  # all but the age and what depends on it
    estimate: Estimate | None
    received_s: float | None

    @classmethod
    def of(
        cls, estimate: Estimate | None, rejection: Estimate | None, received_s: float | None, none_yet: dict[str, Any]
    ) -> "_Answer":
        record = none_yet if estimate is None else estimate_to_json(estimate)
        short = None if rejection is None else estimate_to_json(replace(rejection, spectra=None))
        tag = f"{record['id'] or 'none'}.{'none' if short is None else short['id']}"
        if estimate is not None and estimate.is_provisional:
            tag += ".provisional"
        rest = ("," + json_line({"last_rejection": short, **record})[1:]).encode()
        return cls(tag, rest, estimate, received_s)


class Board:
    """The latest estimate, rejection and provisional estimate.

    ``publish``, ``restore`` and ``close`` may be called from any thread. A provisional estimate replaces ``latest``
    while its drive has no good estimate: the load weighed before the last stop may have been unloaded there.

    Estimates are kept as their rounded JSON, so that everything derived from them is the same before and after a
    restart. ``unweighed`` are the weights before the first estimate: the known ones, and what the others lack.
    """

    def __init__(
        self,
        *,
        stale_after_s: float = 900.0,
        clock: Callable[[], float] = boot_clock_s,
        unweighed: Weights = _NOT_CALIBRATED,
        is_stored: Callable[[str], bool] = lambda estimate_id: True,
    ) -> None:
        """``is_stored`` is whether the record of this id is on disk."""
        self._is_stored = is_stored
        self._stale_after_s = stale_after_s
        self._clock = clock
        self._lock = threading.Lock()
        self._rejection: Estimate | None = None
        self._none_yet = _nothing_yet(unweighed)
        self._answer = _Answer.of(None, None, None, self._none_yet)
        self._heard: Estimate | None = None  # the last full batch, answered or not
        self._drive_has_estimate = False
        self.fanout = Fanout()

    def publish(self, estimate: Estimate) -> None:
        """Show an estimate. A provisional one goes to every stream; the others get there through the journal."""
        record = estimate_to_json(estimate)
        with self._lock:
            self._show(estimate_from_json(record), self._clock())
        if estimate.is_provisional:
            self.fanout.publish(ServerSentEvent(event=PROVISIONAL, raw_data=json_line(record)))

    def restore(self, estimate: str | None, rejection: str | None, age_s: float | None) -> None:
        """Show the estimate that an earlier run of the service stored, with its age; ``age_s`` None: unknown, so it is
        stale.

        Raises ValueError or KeyError, and shows nothing, if this program did not write it.
        """
        answer = None if estimate is None else estimate_from_json(json.loads(estimate))
        refusal = None if rejection is None else estimate_from_json(json.loads(rejection))
        with self._lock:
            self._rejection = refusal
            full = [one for one in (answer, refusal) if one is not None]
            self._heard = max(full, key=lambda one: one.t_end_ns, default=None)
            received_s = None if age_s is None or answer is None else self._clock() - age_s
            self._answer = _Answer.of(answer, refusal, received_s, self._none_yet)

    def close(self) -> None:
        """End every stream; later clients get none."""
        self.fanout.close()

    def age_s(self) -> float | None:
        """Seconds since the shown estimate was received; None before the first."""
        return self._age_s(self._answer)

    def is_stale(self) -> bool:
        return self._is_stale(self._answer)

    def latest(self) -> tuple[str, bytes]:
        """(tag, JSON) of the estimate shown now. The tag changes with all but the age."""
        answer = self._answer
        age_s = self._age_s(answer)
        is_stale = self._is_stale(answer)
        age = b"null" if age_s is None else b"%.1f" % age_s
        shown = answer.estimate
        is_stored = None if shown is None or shown.is_provisional else self._is_stored(shown.id)
        head = b'{"age_s":%b,"is_stale":%b,"is_stored":%b' % (age, _JSON[is_stale], _JSON[is_stored])
        tag = f"{answer.tag}{'.stale' * is_stale}{'.held' * (is_stored is False)}"
        return tag, head + answer.rest

    def shown(self) -> Shown:
        answer = self._answer
        age_s = self._age_s(answer)
        return Shown(answer.estimate, None if age_s is None else round(age_s, 1), self._is_stale(answer))

    def heard(self) -> Estimate | None:
        """The last full batch, weighed or not; None before the first."""
        return self._heard

    def _age_s(self, answer: _Answer) -> float | None:
        return None if answer.received_s is None else max(0.0, self._clock() - answer.received_s)

    def _is_stale(self, answer: _Answer) -> bool:
        """Whether the shown estimate is stale. An unknown age counts as stale; before the first estimate nothing is."""
        age_s = self._age_s(answer)
        return answer.estimate is not None and (age_s is None or age_s > self._stale_after_s)

    def _show(self, estimate: Estimate, now_s: float) -> None:
        kind = kind_of(estimate)
        if self._heard is None or estimate.t_start_ns != self._heard.t_end_ns:
            self._drive_has_estimate = False  # batches of one drive follow one another without a gap
        if kind != PROVISIONAL:
            self._heard = estimate
        if kind == REJECTION:
            self._rejection = estimate
            shown = self._answer
            self._answer = _Answer.of(shown.estimate, estimate, shown.received_s, self._none_yet)
        elif kind == ESTIMATE or not (self._drive_has_estimate or estimate.rejected):
            if kind == ESTIMATE:
                self._drive_has_estimate = True
            self._answer = _Answer.of(estimate, self._rejection, now_s, self._none_yet)


LATEST_PATH: Final = "/api/v1/estimates/latest"


class LatestResponse(Response):
    """The latest estimate with its age, or 304 if the client has all but the age.

    The ETag is weak (RFC 9110, 8.8.3): it changes with everything but the age.
    """

    media_type = "application/json"

    def __init__(self, board: Board, scope: Scope, shown: Callable[[str], str]) -> None:
        """``shown`` turns the JSON into what the client may see of it."""
        tag, body = board.latest()
        body = shown(body.decode()).encode()
        etag = f'"{tag}"'
        is_known = _has(scope, etag)
        headers = {"etag": f"W/{etag}", "cache-control": "no-cache"}
        super().__init__(None if is_known else body, 304 if is_known else 200, headers)


def _has(scope: Scope, etag: str) -> bool:
    """Whether If-None-Match names the present ETag (weak comparison)."""
    for name, content in scope["headers"]:
        if name == b"if-none-match":
            named = content.decode("latin-1")
            return named.strip() == "*" or any(tag.strip().removeprefix("W/") == etag for tag in named.split(","))
    return False
