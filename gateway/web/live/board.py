"""What the service knows right now, ready to be sent: filled by the pipeline, read by the web."""

import json
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from gateway.estimate import Estimate
from gateway.estimate_json import estimate_to_json
from gateway.records import Why, json_line
from gateway.web.live.fanout import Fanout, StreamEvent

Record = Mapping[str, Any]

RECENT: Final = 100
ESTIMATE: Final = "estimate"
REJECTION: Final = "rejection"
PROVISIONAL: Final = "provisional"


def _nothing_yet() -> dict[str, Any]:
    """The estimate before the first: its names, all null, and the reason."""
    names = estimate_to_json(Estimate(0, 0, ""))
    return {**dict.fromkeys(names), "shares": {}, "diagnostics": {}, "rejected": [str(Why.NO_ESTIMATE_YET)]}


def boot_clock_s() -> float:
    """Seconds that go on while the machine sleeps: what was received before a suspend is old afterwards."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def kind_of(record: Record) -> str:
    """The name a record has on the stream."""
    if record.get("provisional"):
        return PROVISIONAL
    return REJECTION if record["rejected"] else ESTIMATE


@dataclass(frozen=True, slots=True)
class _Shown:
    """One version of ``latest``: made once per record, sent many times with its age filled in."""

    tag: str
    rest: bytes = field(repr=False)  # all but the age and what depends on it
    received_s: float | None

    @classmethod
    def of(cls, record: Record, rejection: Record | None, received_s: float | None) -> "_Shown":
        short = None if rejection is None else {name: x for name, x in rejection.items() if name != "spectra"}
        tag = f"{record['id'] or 'none'}.{'none' if short is None else short['id']}"
        if record.get("provisional"):
            tag += ".provisional"
        return cls(tag, ("," + json_line({"last_rejection": short, **record})[1:]).encode(), received_s)


class Board:
    """The latest estimate, rejection and provisional estimate; tells subscribers of each new one.

    ``publish``, ``restore`` and ``close`` may be called from any thread. A provisional estimate stands
    in for ``latest`` while its drive has no good estimate: what was weighed before the last stop may
    have been unloaded there.
    """

    def __init__(self, *, stale_after_s: float = 900.0, clock: Callable[[], float] = boot_clock_s) -> None:
        self._stale_after_s = stale_after_s
        self._clock = clock
        self._lock = threading.Lock()
        self._estimate: Record = _nothing_yet()
        self._rejection: Record | None = None
        self._shown = _Shown.of(self._estimate, None, None)
        self._heard: Record = self._estimate  # the last full batch, answered or not
        self._recent: deque[Record] = deque(maxlen=RECENT)  # good estimates, oldest first
        self._drive_has_estimate = False
        self.fanout = Fanout()

    def publish(self, record: Record, cursor: str | None = None) -> None:
        """Show a record (the object of ``estimate_to_json``) and send it to every subscriber.

        ``cursor`` is its place in the store; streams can be resumed behind it.
        """
        with self._lock:
            self._show(record, self._clock())
            self.fanout.publish(StreamEvent.of(kind_of(record), json_line(record), cursor))

    def restore(self, estimate: str | None, rejection: str | None, age_s: float | None) -> None:
        """Show what an earlier run of the service stored, as old as it is."""
        with self._lock:
            if rejection is not None:
                self._rejection = json.loads(rejection)
            if estimate is not None:
                self._estimate = json.loads(estimate)
                self._recent.append(self._estimate)
            self._heard = max(self._estimate, self._rejection or self._estimate, key=lambda r: r["t_end_ns"] or 0)
            received_s = None if age_s is None or estimate is None else self._clock() - age_s
            self._shown = _Shown.of(self._estimate, self._rejection, received_s)

    def close(self) -> None:
        """End every stream; those who come later get none."""
        self.fanout.close()

    def age_s(self) -> float | None:
        """Seconds since the shown estimate was received; None before the first."""
        return self._age_s(self._shown)

    def is_stale(self) -> bool:
        return self._is_stale(self.age_s())

    def latest(self) -> tuple[str, bytes]:
        """(tag, JSON) of the estimate shown now. The tag changes with all but the age."""
        shown = self._shown
        age_s = self._age_s(shown)
        is_stale = self._is_stale(age_s)
        age = b"null" if age_s is None else b"%.1f" % age_s
        head = b'{"age_s":' + age + (b',"is_stale":true' if is_stale else b',"is_stale":false')
        return (f"{shown.tag}.stale" if is_stale else shown.tag), head + shown.rest

    def shown(self) -> Record:
        """The estimate that ``latest`` shows, without its age; all null before the first."""
        return self._estimate

    def recent_estimates(self) -> tuple[Record, ...]:
        """The last good estimates, oldest first."""
        with self._lock:
            return tuple(self._recent)

    def heard(self) -> Record:
        """The last full batch, answered or not; all null before the first."""
        return self._heard

    def _age_s(self, shown: _Shown) -> float | None:
        return None if shown.received_s is None else max(0.0, self._clock() - shown.received_s)

    def _is_stale(self, age_s: float | None) -> bool:
        """Unknown is not stale: there is nothing that could mislead."""
        return age_s is not None and age_s > self._stale_after_s

    def _show(self, record: Record, now_s: float) -> None:
        kind = kind_of(record)
        if record["t_start"] != self._heard["t_end"]:  # batches of one drive follow one another without a gap
            self._drive_has_estimate = False
        if kind != PROVISIONAL:
            self._heard = record
        if kind == REJECTION:
            self._rejection = record
            self._shown = _Shown.of(self._estimate, record, self._shown.received_s)
        elif kind == ESTIMATE or not (self._drive_has_estimate or record["rejected"]):
            if kind == ESTIMATE:
                self._drive_has_estimate = True
                self._recent.append(record)
            self._estimate = record
            self._shown = _Shown.of(record, self._rejection, now_s)
