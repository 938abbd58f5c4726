"""The outbox of a sender. The journal is the queue; the outbox keeps the place up to which it is delivered."""

import json
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from gateway.estimates.field_kinds import without_places
from gateway.records import json_line
from gateway.store import Store
from gateway.store.journal import ALARM, ESTIMATE, KINDS, Delivery, JournalRecord

PAGE: Final = 100  # chosen: records in memory at a time


@dataclass(frozen=True, slots=True)
class OutboxMessage:
    """One estimate or rejection, load event, trip or alarm: its cursor in the store, its idempotent id, its JSON.

    ``branch`` is the topic below that of the vehicle, ``kind`` the webhook's type. An estimate is sent without spectra
    and with a ``sequence``: the store it comes from, its number there, and the number of the one before it. The broker
    keeps a retained message for later subscribers.
    """

    cursor: str
    id: str
    text: str
    branch: str = "estimates"
    is_retained: bool = False
    kind: str = ESTIMATE
    is_answer: bool = False  # a batch that was weighed


class Outbox:
    """Hands out one message at a time, in order, until it is delivered. Not thread-safe but for ``tell_news``.

    If the database was replaced (set aside as damaged, or deleted), numbers start again: the outbox then uses the
    place stored in the new database, or sends everything in it. Receivers ignore duplicates by their ids.
    """

    def __init__(
        self, journal: Store, name: str, *, with_places: bool = False, repeat_s: float = 0.0, only: Sequence[str] = ()
    ) -> None:
        """``with_places`` also sends positions; ``only`` lists the webhook types to send (empty: all).

        ``repeat_s`` is the time span that ``repeat`` sends again.
        """
        self._journal, self._name, self._with_places, self._repeat_s = journal, name, with_places, repeat_s
        self._kinds = tuple(kind.name for kind in KINDS.values() if not only or kind.webhook_type in only)
        self._news = threading.Event()
        self._follower = journal.follow(self._kinds, None, self.tell_news)
        self._delivered: str | None = None  # until the store was asked
        self._page: deque[OutboxMessage] = deque()  # read, and not delivered yet
        self._lately: deque[tuple[float, str | None]] = deque()  # the place before each recently delivered message
        self._found: Delivery | None = None

    def next(self) -> OutboxMessage | None:
        """The first message that is not delivered; None if there is none now. Raises StoreError or TimeoutError."""
        epoch = _epoch(self._journal.head())
        if _epoch(self._delivered) != epoch or _epoch(self._follower.place) != epoch:
            known = self._journal.delivery(self._name, self._kinds).cursor
            if _epoch(known) != epoch:  # a new database, or a new receiver: from its first record
                known = f"{epoch}-0"
                self._journal.write_delivery(self._name, known)  # from here on, what retention removes is counted
            self._go_to(known)
        while not self._page and (records := self._follower.read(PAGE)):
            self._page.extend(message for record in records for message in self._messages(record))
        if self._page:
            return self._page[0]
        if self._delivered != self._follower.place:  # nothing before it is to be sent
            self._delivered = self._follower.place
            self._journal.write_delivery(self._name, self._delivered)
        return None

    def delivered(self) -> None:
        """Store that the receiver has the message that ``next`` gave, and all before it."""
        if self._repeat_s > 0.0:
            self._lately.append((time.monotonic(), self._delivered))
            while self._lately[-1][0] - self._lately[0][0] > self._repeat_s:
                self._lately.popleft()
        self._delivered = self._page.popleft().cursor
        self._journal.write_delivery(self._name, self._delivered)

    def repeat(self) -> None:
        """Send again what was delivered in the last ``repeat_s``: a killed broker forgets what it has not saved."""
        if self._lately:
            self._go_to(self._lately[0][1])
            self._lately.clear()

    def wait(self, timeout_s: float) -> None:
        """Wait until there may be another message, ``tell_news`` is called, or the time is over."""
        self._news.wait(timeout_s)
        self._news.clear()

    def tell_news(self) -> None:
        """Wake the sender to look for messages; from any thread."""
        self._news.set()

    def look(self) -> Delivery:
        """Number of waiting records, and of those that retention removed undelivered.

        Queries the store only if there may be some.
        """
        if self._found is None or self._found.n_waiting or self._delivered != self._journal.head():
            self._found = self._journal.delivery(self._name, self._kinds)
        return self._found

    def _go_to(self, cursor: str | None) -> None:
        self._delivered = cursor
        self._page.clear()
        self._follower.go_to(cursor)

    def _messages(self, record: JournalRecord) -> list[OutboxMessage]:
        """The message of a record: without spectra, and with positions only if they are wanted. None of a record that
        this program cannot read.
        """

        def read(text: str) -> OutboxMessage:
            shown: dict[str, Any] = json.loads(text if self._with_places else without_places(text))
            shown.pop("spectra", None)
            return message_of_record(record, shown)

        return self._journal.reader().understood([record.text], read)


def message_of_record(record: JournalRecord, shown: dict[str, Any]) -> OutboxMessage:
    """A message for a record. Batches carry their place in the chain; each cause of alarms has a topic of its own."""
    kind = KINDS[record.kind]
    if not kind.is_revised:
        place = {"stream": _epoch(record.cursor), "number": record.number, "previous": record.previous}
        text, is_answer = json_line(shown | {"sequence": place}), record.kind == ESTIMATE
        return OutboxMessage(record.cursor, record.id, text, kind.branch, False, kind.webhook_type, is_answer)
    branch = kind.branch
    if record.kind == ALARM:
        branch = "/".join((branch, *(part for part in (shown["kind"], shown["where"]) if part)))
    letter_id = f"{record.id}-{shown['revision']}"
    return OutboxMessage(record.cursor, letter_id, json_line(shown), branch, kind.is_retained, kind.webhook_type)


def _epoch(cursor: str | None) -> str:
    return "" if cursor is None else cursor.partition("-")[0]
