"""Server-sent events: the journal from a place on, as it grows, until one side ends the stream.

Each stream has its own place in the journal. A client that reads slowly gets everything later, and holds nothing in
memory meanwhile but a few events.
"""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

from fastapi.sse import ServerSentEvent

from gateway.errors import StoreError
from gateway.store import StoreReader
from gateway.store.journal import KINDS, JournalRecord

RETRY_MS: Final = 3000  # chosen: pause of a browser before it connects again
ASK_AGAIN_S: Final = 5.0  # chosen: how soon a token that was revoked ends a stream on which nothing comes
STREAMS: Final = 60  # chosen: at a time, so that other requests have the rest of the 100 connections
_PAGE: Final = 5  # chosen: records in memory for each client

EVENT_SCHEMA: Final[dict[str, Any]] = {
    "type": "object",
    "description": "one server-sent event; data is JSON: an Estimate, a LoadEvent, a Trip, an Alarm, or {detail}",
    "properties": {
        "id": {"type": "string", "description": "cursor: send it as Last-Event-ID to resume behind it"},
        "event": {"enum": ["estimate", "rejection", "provisional", "event", "trip", "alarm", "closing"]},
        "data": {"type": "string"},
    },
    "required": ["event", "data"],
}
_CLOSING: Final = ServerSentEvent(event="closing", data={"detail": "the service stops"})


class TooManyStreamsError(Exception):
    """As many streams are open as may be."""


class Subscription:
    """The events of one client. All but ``wake``, ``hear`` and ``end`` belongs to the loop it was made in.

    Records are in the journal, where the client has a place; of events that are not stored only the newest waits here,
    with the number of the newest record at its time.
    """

    def __init__(self, reader: StoreReader, behind: str | None, shown: Callable[[str], str] = str) -> None:
        """``behind`` is the cursor to resume behind, None for live only; ``shown`` turns a record's JSON into what the
        client may see of it, and raises PermissionError once it may see none.
        """
        self._shown = shown
        self._loop = asyncio.get_running_loop()
        self._news = asyncio.Event()
        self._passing: tuple[int, ServerSentEvent] | None = None
        self._is_ended = False
        self._head = reader.head
        self._follower = reader.follow(tuple(KINDS), behind or reader.head(), self.wake)

    def wake(self) -> None:
        """There is news; may be called from any thread."""
        with suppress(RuntimeError):  # the loop is closed: so is the stream
            self._loop.call_soon_threadsafe(self._news.set)

    def hear(self, passing: ServerSentEvent) -> None:
        """Takes an event that is not stored, from any thread."""
        self._passing = (_number(self._head()), passing)
        self.wake()

    def end(self) -> None:
        """End the stream behind what there is by now, from any thread."""
        self._is_ended = True
        self.wake()

    def close(self) -> None:
        self._follower.close()

    async def events(self) -> AsyncIterator[ServerSentEvent]:
        """Records by their numbers, and between them, in order, events that are not stored, while the client may see
        them.
        """
        try:
            async for event in self._events():
                yield event
        except PermissionError as refusal:
            yield ServerSentEvent(event="closing", data={"detail": str(refusal)})

    async def _events(self) -> AsyncIterator[ServerSentEvent]:
        yield ServerSentEvent(retry=RETRY_MS)
        sent = None
        while True:
            is_last = self._is_ended  # before the last look: what came before the end still goes out
            self._news.clear()
            newest = self._passing
            passing, sent = (None if newest is sent else newest), newest
            while records := await asyncio.to_thread(self._read):
                for record in records:
                    if passing is not None and record.number > passing[0]:
                        yield self._seen(passing[1])
                        passing = None
                    yield self._seen(ServerSentEvent(event=record.kind, raw_data=record.text, id=record.cursor))
            if passing is not None:
                yield self._seen(passing[1])
            if is_last:
                yield _CLOSING
                return
            with suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), ASK_AGAIN_S)
            self._shown("")

    def _seen(self, event: ServerSentEvent) -> ServerSentEvent:
        return event.model_copy(update={"raw_data": self._shown(event.raw_data or "")})

    def _read(self) -> list[JournalRecord]:
        """Some records; none while the disk cannot be read: the next record tries again."""
        try:
            return self._follower.read(_PAGE)
        except (StoreError, TimeoutError):
            return []


def _number(cursor: str) -> int:
    return int(cursor.partition("-")[2])


class Fanout:
    """All subscriptions. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._subscriptions: set[Subscription] = set()
        self._is_closed = False

    @property
    def n_subscribers(self) -> int:
        return len(self._subscriptions)

    def publish(self, event: ServerSentEvent) -> None:
        """Give every client an event that is not stored; never waits for one."""
        with self._lock:
            for subscription in self._subscriptions:
                subscription.hear(event)

    @contextmanager
    def joined(
        self, reader: StoreReader, behind: str | None, shown: Callable[[str], str] = str
    ) -> Iterator[Subscription]:
        """A subscription to events from now on, in the loop that will read it. Raises TooManyStreamsError."""
        with self._lock:
            if len(self._subscriptions) >= STREAMS:
                raise TooManyStreamsError(f"{STREAMS} streams are open, and no more are served: close one")
            subscription = Subscription(reader, behind, shown)
            self._subscriptions.add(subscription)
            if self._is_closed:
                subscription.end()
        try:
            yield subscription
        finally:
            subscription.close()
            with self._lock:
                self._subscriptions.remove(subscription)

    def close(self) -> None:
        """End all streams, now and later."""
        with self._lock:
            self._is_closed = True
            for subscription in self._subscriptions:
                subscription.end()
