"""What is still to be delivered. The store is the queue: the outbox only knows how far it has come."""

import json
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

from gateway.history import Delivery, Page
from gateway.records import json_line

ESTIMATE: Final = "estimate"
_BRANCHES: Final = {"event": "events", "trip": "trips", "alarm": "alarms"}


@dataclass(frozen=True, slots=True)
class Letter:
    """One estimate or rejection, load event, trip or alarm: its place in the store, its idempotent id, its JSON.

    ``branch`` is the topic below the vehicle's. An estimate has no spectra, and a ``sequence`` of its own: which store
    it comes from, its number there, and the number before it. What is retained tells who comes later how things stand.
    """

    cursor: str
    id: str
    text: str
    branch: str = "estimates"
    is_retained: bool = False
    kind: str = ESTIMATE


class History(Protocol):
    """The store's reading side, as far as the outbox needs it."""

    def estimates(
        self, *, cursor: str | None = None, limit: int, with_spectra: bool, newest_first: bool = False
    ) -> Page: ...
    def entries(self, *, cursor: str | None, limit: int, upto: str | None = None) -> Page: ...
    def delivery(self, uplink: str, *, kinds: Sequence[str] = (), with_estimates: bool = True) -> Delivery: ...


class Memory(Protocol):
    """The store's writing side, as far as the outbox needs it."""

    def write_delivery(self, uplink: str, cursor: str) -> bool: ...


class Lately:
    """Where the outbox stood before each of the letters that were delivered last, as long as they may be forgotten."""

    def __init__(self, span_s: float) -> None:
        self._span_s = span_s
        self._before: deque[tuple[float, str | None]] = deque()

    def delivered(self, before: str | None, now_s: float) -> None:
        """A letter was taken; ``before`` is the place before it."""
        if self._span_s > 0.0:
            self._before.append((now_s, before))
            while now_s - self._before[0][0] > self._span_s:
                self._before.popleft()

    def before_it(self, place: str | None) -> str | None:
        """The place before the oldest of them, from where all go out again; ``place`` where there is none."""
        oldest = self._before[0][1] if self._before else place
        self._before.clear()
        return oldest


class Outbox:
    """Hands out letters in order, and again from the last delivered one after :meth:`rewind`.

    Where the database was replaced (set aside as damaged, deleted), its numbers begin anew: what the
    new one remembers counts then, and without that everything it holds goes out; ids are idempotent.
    """

    def __init__(
        self,
        history: History,
        memory: Memory,
        name: str,
        *,
        with_places: bool = False,
        repeat_s: float = 0.0,
        only: Sequence[str] = (),
    ) -> None:
        """``with_places`` lets positions go out where the store keeps them; ``only`` names kinds, none: all go out.

        ``repeat_s``: a broker that is killed forgets what it took since it last saved.
        """
        self._history = history
        self._memory = memory
        self._name = name
        self._with_places = with_places
        self._only = tuple(only)
        self._lately = Lately(repeat_s)
        self._delivered: str | None = None  # until the store was asked
        self._handed_out: str | None = None

    def next_letters(self, limit: int) -> list[Letter]:
        """Up to ``limit`` letters behind the last one handed out. Raises what the store's reader raises."""
        while True:
            letters, end = self._wanted_behind(self._handed_out, limit)
            if end is not None and _epoch(self._handed_out) != _epoch(end):
                self._take_place(_epoch(end))
                letters, end = self._wanted_behind(self._handed_out, limit)
            if letters:
                self._handed_out = letters[-1].cursor
            elif end is not None and end != self._handed_out:
                self._pass_over(end)
                continue
            return letters

    def delivered(self, letter: Letter) -> None:
        """The broker has this letter and all before it."""
        self._lately.delivered(self._delivered, time.monotonic())
        self._delivered = letter.cursor
        self._memory.write_delivery(self._name, letter.cursor)

    def rewind(self) -> None:
        """The link broke: what was handed out and not delivered goes out again, and what was delivered lately."""
        self._delivered = self._handed_out = self._lately.before_it(self._delivered)

    def look(self) -> Delivery:
        """How much waits and how much retention removed undelivered, as the store has it."""
        if not self._only:
            return self._history.delivery(self._name)
        kinds = [kind for kind in self._only if kind in _BRANCHES]
        return self._history.delivery(self._name, kinds=kinds, with_estimates=ESTIMATE in self._only)

    def _pass_over(self, end: str) -> None:
        """Nothing up to there is wanted; what was handed out before is delivered when more is asked for."""
        self._handed_out = self._delivered = end
        self._memory.write_delivery(self._name, end)

    def _wanted_behind(self, cursor: str | None, limit: int) -> tuple[list[Letter], str | None]:
        """Letters, and how far the store was looked through for them; None where there is nothing at all."""
        if self._only and ESTIMATE not in self._only:
            return self._entries_behind(cursor, limit)
        letters = self._behind(cursor, limit)
        wanted = [one for one in letters if not self._only or one.kind in self._only]
        return wanted, letters[-1].cursor if letters else None

    def _entries_behind(self, cursor: str | None, limit: int) -> tuple[list[Letter], str | None]:
        """The newest estimate is asked for first: what has a lower number than it is there by then."""
        newest = self._history.estimates(limit=1, with_spectra=False, newest_first=True).cursors
        beside = self._history.entries(cursor=cursor, limit=limit)
        if not beside.items:
            return [], newest[0] if newest and not _is_behind(newest[0], cursor) else None
        letters = [self._entry(place, text) for place, text in zip(beside.cursors, beside.items, strict=True)]
        return [one for one in letters if one.kind in self._only], beside.cursors[-1]

    def _behind(self, cursor: str | None, limit: int) -> list[Letter]:
        """Estimates, and what was told beside them, by their numbers; where there is more of one, the other waits.

        Whichever is asked for last has all up to the end of the other: what came between two questions is no gap.
        """
        page = self._history.estimates(cursor=cursor, limit=limit, with_spectra=False)
        beside = self._history.entries(cursor=cursor, limit=limit, upto=page.next_cursor)
        ends = [beside.next_cursor]
        if beside.cursors and not (page.cursors and _is_behind(beside.cursors[-1], page.cursors[-1])):
            page = self._history.estimates(cursor=cursor, limit=limit, with_spectra=False)
            ends.append(beside.cursors[-1])
        letters = [
            _letter(place, previous, self._shown(json.loads(text)))
            for place, previous, text in zip(page.cursors, page.previous, page.items, strict=True)
        ]
        letters += (self._entry(place, text) for place, text in zip(beside.cursors, beside.items, strict=True))
        last = min((_number(place) for place in (*ends, page.next_cursor) if place), default=None)
        kept = [one for one in letters if last is None or _number(one.cursor) <= last]
        return sorted(kept, key=lambda one: _number(one.cursor))

    def _entry(self, cursor: str, text: str) -> Letter:
        return _entry_letter(cursor, self._shown(json.loads(text)))

    def _shown(self, record: dict[str, Any]) -> dict[str, Any]:
        """What may leave the box."""
        return record if self._with_places else without_places(record)

    def _take_place(self, epoch: str) -> None:
        """Go on where the database that is there now remembers us; an uplink it never saw begins at its first row."""
        known = self._history.delivery(self._name).cursor
        if _epoch(known) != epoch:
            known = f"{epoch}-0"
            self._memory.write_delivery(self._name, known)  # from here on, what retention removes is counted
        self._delivered = self._handed_out = known


def without_places(record: dict[str, Any]) -> dict[str, Any]:
    """The same object, every place in it null, however deep."""
    return {name: _bare(part) for name, part in record.items()}


def _bare(part: Any) -> Any:
    if isinstance(part, dict):
        return None if "latitude_deg" in part else without_places(part)
    return [_bare(one) for one in part] if isinstance(part, list) else part


def _number(cursor: str) -> int:
    return int(cursor.partition("-")[2])


def _entry_letter(cursor: str, record: dict[str, Any]) -> Letter:
    """Alarms have a topic for each cause, where the last one is retained."""
    kind = record["id"].partition("-")[0]
    letter = Letter(cursor, f"{record['id']}-{record['revision']}", json_line(record), _BRANCHES[kind], kind=kind)
    if kind != "alarm":
        return letter
    below = [part for part in (record["kind"], record["where"]) if part]
    return replace(letter, branch="/".join((letter.branch, *below)), is_retained=True)


def _letter(cursor: str, previous: int | None, record: dict[str, Any]) -> Letter:
    stream, _, number = cursor.partition("-")
    sequence = {"stream": stream, "number": int(number), "previous": previous}
    return Letter(cursor, record["id"], json_line(record | {"sequence": sequence}))


def _is_behind(cursor: str, other: str | None) -> bool:
    """Whether it comes no later than another of the same database."""
    return other is not None and _epoch(cursor) == _epoch(other) and _number(cursor) <= _number(other)


def _epoch(cursor: str | None) -> str:
    return "" if cursor is None else cursor.partition("-")[0]
