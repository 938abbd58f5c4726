"""What is still to be delivered. The journal is the queue: the outbox only knows how far it has come."""

import json
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from gateway.history import ALARM, ESTIMATE, KINDS, Delivery, Record
from gateway.log import Event, log_event
from gateway.records import json_line
from gateway.store import Store

SETTLES_S: Final = 30.0  # a record is on disk after that, or the disk refuses
LATEST: Final = "latest"  # topic of the newest estimate, retained


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
    is_answer: bool = False  # a batch that was weighed
    is_extra: bool = False  # a copy: not counted, and nothing is lost with it


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
    """Hands out letters in order, and again from the last delivered one after :meth:`rewind`. One thread's.

    Where the database was replaced (set aside as damaged, deleted), its numbers begin anew: what the
    new one remembers counts then, and without that everything it holds goes out; ids are idempotent.
    """

    def __init__(
        self,
        journal: Store,
        name: str,
        *,
        with_places: bool = False,
        repeat_s: float = 0.0,
        only: Sequence[str] = (),
        with_latest: bool = False,
    ) -> None:
        """``with_places`` lets positions go out where the store keeps them; ``only`` names letters, none: all go out.

        ``repeat_s``: a broker that is killed forgets what it took since it last saved. ``with_latest`` sends the newest
        estimate once more, to be retained.
        """
        self._journal = journal
        self._name = name
        self._with_places = with_places
        self._with_latest = with_latest
        self._kinds = tuple(kind.name for kind in KINDS.values() if not only or kind.letter in only)
        self._lately = Lately(repeat_s)
        self._delivered: str | None = None  # until the store was asked
        self._under_way: str | None = None  # the last letter handed out, until it is delivered
        self._news = threading.Event()
        self._on_news: Callable[[], None] = lambda: None
        self._follower = journal.follow(self._kinds, None, self.tell_news)
        self._is_placed = False
        self._looked: tuple[tuple[str, str | None], float, Delivery] | None = None

    def next_letters(self, limit: int) -> list[Letter]:
        """Up to ``limit`` letters behind the last one handed out. Raises StoreError or TimeoutError."""
        self._news.clear()
        epoch = _epoch(self._journal.head())
        if not self._is_placed or _epoch(self._follower.place) != epoch:
            self._take_place(epoch)
        letters: list[Letter] = []
        while not letters and (records := self._follower.read(limit)):
            letters = [letter for record in records if (letter := self._letter(record)) is not None]
        if letters:
            self._under_way = letters[-1].cursor
        elif self._under_way is None and self._delivered != self._follower.place:
            self._delivered = self._follower.place  # nothing up to there is wanted
            self._journal.write_delivery(self._name, self._delivered)
        return self._with_retained(letters) if self._with_latest else letters

    def wait(self, timeout_s: float) -> None:
        """Until there may be another letter, ``tell_news`` is called, or the time is out."""
        self._news.wait(timeout_s)

    def call(self, on_news: Callable[[], None]) -> None:
        """Besides, call ``on_news`` with each new record, from the thread that writes it."""
        self._on_news = on_news

    def delivered(self, letter: Letter) -> None:
        """The receiver has this letter and all before it."""
        self._lately.delivered(self._delivered, time.monotonic())
        self._delivered = letter.cursor
        if letter.cursor == self._under_way:
            self._under_way = None
        self._journal.write_delivery(self._name, letter.cursor)

    def rewind(self) -> None:
        """The link broke: what was handed out and not delivered goes out again, and what was delivered lately."""
        self._under_way = None
        self._delivered = self._lately.before_it(self._delivered)
        self._follower.go_to(self._delivered)
        self._is_placed = self._delivered is not None

    def look(self) -> Delivery:
        """How much waits and how much retention removed undelivered, as the store has it.

        The store is asked only where something came or went lately.
        """
        state, now_s = (self._journal.head(), self._delivered), time.monotonic()
        if self._looked is None or self._looked[0] != state:
            self._looked = (state, now_s, self._journal.delivery(self._name, self._kinds))
        elif now_s - self._looked[1] < SETTLES_S:  # what came may not have been on disk
            self._looked = (state, self._looked[1], self._journal.delivery(self._name, self._kinds))
        return self._looked[2]

    def tell_news(self) -> None:
        """Look for letters now; from any thread."""
        self._news.set()
        self._on_news()

    def _take_place(self, epoch: str) -> None:
        """Go on where the database that is there now remembers us; an uplink it never saw begins at its first row."""
        known = self._journal.delivery(self._name, self._kinds).cursor
        if _epoch(known) != epoch:
            known = f"{epoch}-0"
            self._journal.write_delivery(self._name, known)  # from here on, what retention removes is counted
        self._delivered = known
        self._follower.go_to(known)
        self._is_placed = True

    def _letter(self, record: Record) -> Letter | None:
        """None, and told, for one that is as it was written and yet no record of this program."""
        try:
            return letter_of(record, self._shown(json.loads(record.text)))
        except (AttributeError, KeyError, TypeError, ValueError, RecursionError) as fault:
            log_event(Event.STORE_BAD_RECORD, level=logging.ERROR, seq=record.number, fault=repr(fault))
            return None

    def _shown(self, record: dict[str, Any]) -> dict[str, Any]:
        """What may leave the box: no spectra, and positions only where they are wanted."""
        record.pop("spectra", None)
        return record if self._with_places else without_places(record)

    def _with_retained(self, letters: list[Letter]) -> list[Letter]:
        """The newest estimate among these goes out a second time, first, under ``latest``, where it is retained."""
        newest = next((one for one in reversed(letters) if one.is_answer), None)
        if newest is None:
            return letters
        again = replace(newest, branch=LATEST, is_retained=True, is_extra=True)
        place = letters.index(newest)
        return [*letters[:place], again, *letters[place:]]


def without_places(record: dict[str, Any]) -> dict[str, Any]:
    """The same object, every place in it null, however deep."""
    return {name: _bare(part) for name, part in record.items()}


def _bare(part: Any) -> Any:
    if isinstance(part, dict):
        return None if "latitude_deg" in part else without_places(part)
    return [_bare(one) for one in part] if isinstance(part, list) else part


def letter_of(record: Record, shown: dict[str, Any]) -> Letter:
    """Batches tell their place in the chain; alarms have a topic for each cause, where the last one is retained."""
    kind = KINDS[record.kind]
    if not kind.is_revised:
        sequence = {
            "stream": _epoch(record.cursor), "number": record.number, "previous": record.previous
        }  # fmt: skip
        text = json_line(shown | {"sequence": sequence})
        return Letter(record.cursor, record.id, text, kind.branch, kind=kind.letter, is_answer=record.kind == ESTIMATE)
    branch = kind.branch
    if record.kind == ALARM:
        branch = "/".join((branch, *(part for part in (shown["kind"], shown["where"]) if part)))
    letter_id = f"{record.id}-{shown['revision']}"
    return Letter(record.cursor, letter_id, json_line(shown), branch, kind.is_retained, kind.letter)


def _epoch(cursor: str | None) -> str:
    return "" if cursor is None else cursor.partition("-")[0]
