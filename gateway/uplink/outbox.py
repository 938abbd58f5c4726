"""The outbox of a sender. The journal is the queue; the outbox keeps the position up to which it is delivered."""

import json
import logging
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from gateway.estimates.as_json import without_places
from gateway.log import Event, log_event
from gateway.records import json_line
from gateway.store import Store
from gateway.store.journal import ALARM, ESTIMATE, KINDS, Delivery, JournalRecord

SETTLES_S: Final = 30.0  # chosen: a record is on disk after that, or the disk refuses
LATEST: Final = "latest"  # topic of the newest estimate, retained


@dataclass(frozen=True, slots=True)
class OutboxMessage:
    """One estimate or rejection, load event, trip or alarm: its cursor in the store, its idempotent id, its JSON.

    ``branch`` is the topic below that of the vehicle. An estimate is sent without spectra and with a ``sequence``: the
    store it comes from, its number there, and the number of the one before it. The broker keeps a retained message for
    later subscribers.
    """

    cursor: str
    id: str
    text: str
    branch: str = "estimates"
    is_retained: bool = False
    kind: str = ESTIMATE
    is_answer: bool = False  # a batch that was weighed
    is_extra: bool = False  # a copy: not counted, and nothing is lost with it


class Outbox:
    """Hands out messages in order; after :meth:`rewind` it starts again behind the last delivered one. Not thread-safe.

    If the database was replaced (set aside as damaged, or deleted), numbers start again: the outbox then uses the
    position stored in the new database, or sends everything in it. Receivers ignore duplicates by their ids.
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
        """``with_places`` also sends positions; ``only`` lists the webhook types to send (empty: all).

        ``repeat_s`` is the time span sent again after a broken connection, because a killed broker forgets what it has
        not saved. ``with_latest`` also sends the newest estimate as a retained copy.
        """
        self._journal, self._name = journal, name
        self._with_places, self._with_latest = with_places, with_latest
        self._kinds = tuple(kind.name for kind in KINDS.values() if not only or kind.webhook_type in only)
        self._repeat_s = repeat_s
        self._lately: deque[tuple[float, str | None]] = deque()  # the position before each recently delivered message
        self._delivered: str | None = None  # until the store was asked
        self._under_way: str | None = None  # the last message handed out, until it is delivered
        self._news = threading.Event()
        self._follower = journal.follow(self._kinds, None, self.tell_news)
        self._state: tuple[str, str | None] | None = None  # of the store and of the delivery,
        self._since_s = 0.0  # and since when
        self._found: Delivery | None = None

    def next_messages(self, limit: int) -> list[OutboxMessage]:
        """Up to ``limit`` messages after the last one handed out. Raises StoreError or TimeoutError."""
        self._news.clear()
        epoch = _epoch(self._journal.head())
        if self._delivered is None or _epoch(self._follower.place) != epoch:
            known = self._journal.delivery(self._name, self._kinds).cursor
            if _epoch(known) != epoch:  # a new database, or a new uplink: from its first record
                known = f"{epoch}-0"
                self._journal.write_delivery(self._name, known)  # from here on, what retention removes is counted
            self._delivered = known
            self._follower.go_to(known)
        messages: list[OutboxMessage] = []
        while not messages and (records := self._follower.read(limit)):
            messages = [message for record in records if (message := self._message(record)) is not None]
        if messages:
            self._under_way = messages[-1].cursor
        elif self._under_way is None and self._delivered != self._follower.place:
            self._delivered = self._follower.place  # nothing before it is to be sent
            self._journal.write_delivery(self._name, self._delivered)
        return self._with_retained(messages) if self._with_latest else messages

    def wait(self, timeout_s: float) -> None:
        """Wait until there may be another message, ``tell_news`` is called, or the time is over."""
        self._news.wait(timeout_s)

    def delivered(self, message: OutboxMessage) -> None:
        """Store that the receiver has this message and all before it."""
        if self._repeat_s > 0.0:
            self._lately.append((time.monotonic(), self._delivered))
            while self._lately[-1][0] - self._lately[0][0] > self._repeat_s:
                self._lately.popleft()
        self._delivered = message.cursor
        if message.cursor == self._under_way:
            self._under_way = None
        self._journal.write_delivery(self._name, message.cursor)

    def rewind(self) -> None:
        """Sends undelivered messages again after a broken connection, with those delivered in the last ``repeat_s``."""
        self._under_way = None
        if self._lately:
            self._delivered = self._lately[0][1]
            self._lately.clear()
        self._follower.go_to(self._delivered)

    def look(self) -> Delivery:
        """Number of waiting records, and of those that retention removed undelivered.

        Queries the store only if records came or were delivered since, and then until they are on disk.
        """
        state, now_s = (self._journal.head(), self._delivered), time.monotonic()
        if self._state != state:
            self._state, self._since_s, self._found = state, now_s, None
        if self._found is None or now_s - self._since_s < SETTLES_S:
            self._found = self._journal.delivery(self._name, self._kinds)
        return self._found

    def tell_news(self) -> None:
        """Wake the sender to look for messages; from any thread."""
        self._news.set()

    def _message(self, record: JournalRecord) -> OutboxMessage | None:
        """The message of a record: without spectra, and with positions only if they are wanted. None, and logged, for a
        record that this program cannot read.
        """
        try:
            shown: dict[str, Any] = json.loads(record.text if self._with_places else without_places(record.text))
            shown.pop("spectra", None)
            return message_of_record(record, shown)
        except (AttributeError, KeyError, TypeError, ValueError, RecursionError) as fault:
            log_event(Event.STORE_BAD_RECORD, level=logging.ERROR, seq=record.number, fault=repr(fault))
            return None

    def _with_retained(self, messages: list[OutboxMessage]) -> list[OutboxMessage]:
        """Add a retained copy of the newest estimate under ``latest``, before that estimate."""
        newest = next((one for one in reversed(messages) if one.is_answer), None)
        if newest is None:
            return messages
        again = replace(newest, branch=LATEST, is_retained=True, is_extra=True)
        place = messages.index(newest)
        return [*messages[:place], again, *messages[place:]]


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
