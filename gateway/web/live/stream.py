"""Server-sent events: the journal from a place on, as it grows, until one side ends the stream.

Each stream has its own place in the journal; a slow client is ended alone, and counted.
"""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from typing import Any, Final

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from gateway.errors import StoreError
from gateway.history import KINDS, JournalRecord
from gateway.store import Follower, StoreReader

MOST_UNREAD: Final = 64  # chosen: events that may come while a client takes none: hours of batches


def server_sent(kind: str, text: str, cursor: str | None) -> bytes:
    """An event as sent (WHATWG HTML, 9.2); ``text`` must be one line, as compact JSON is."""
    identity = "" if cursor is None else f"id: {cursor}\n"
    return f"{identity}event: {kind}\ndata: {text}\n\n".encode()


class Subscription:
    """The events that one client still has to receive. All but ``hear`` and ``end`` belongs to the loop it was made in.

    Records are in the journal, where the client has a place; of events that are not stored only the newest waits here,
    with the number of the newest record at its time.
    """

    def __init__(self, head: Callable[[], str]) -> None:
        self._loop = asyncio.get_running_loop()
        self._head = head
        self._news = asyncio.Event()
        self._passing: tuple[str, bytes] | None = None
        self._n_unread = 0
        self.ended = asyncio.Event()
        self.is_lagging = False
        self.n_dropped = 0

    def hear(self, passing: bytes | None = None) -> None:
        """There is a new record, or an event that is not stored; from any thread."""
        self._in_loop(self._count, None if passing is None else (self._head(), passing))

    def end(self) -> None:
        """End the stream, from any thread."""
        self._in_loop(self.ended.set)
        self._in_loop(self._news.set)

    async def wait(self, timeout_s: float) -> bool:
        """Wait until there is news or the stream has ended; False if the time was out before."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._news.wait(), timeout_s)
        is_news = self._news.is_set()
        self._news.clear()
        return is_news

    def take(self) -> tuple[str, bytes] | None:
        """The event that is not stored, if there is one, and the record it follows."""
        passing, self._passing = self._passing, None
        return passing

    def has_read(self) -> None:
        """The client has received what it was sent."""
        self._n_unread = 0

    def _count(self, passing: tuple[str, bytes] | None) -> None:
        self._n_unread += 1
        if passing is not None:
            self._passing = passing
        if self._n_unread > MOST_UNREAD and not self.ended.is_set():
            self.n_dropped = self._n_unread
            self.is_lagging = True
            self.ended.set()
        self._news.set()

    def _in_loop(self, call: Callable[..., None], *args: object) -> None:
        with suppress(RuntimeError):  # the loop is closed: so is the stream
            self._loop.call_soon_threadsafe(call, *args)


class Fanout:
    """All subscriptions. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._subscriptions: set[Subscription] = set()
        self._is_closed = False
        self.n_slow_clients = 0
        self.n_events_dropped = 0

    @property
    def n_subscribers(self) -> int:
        return len(self._subscriptions)

    def publish(self, event: bytes) -> None:
        """Give every client an event that is not stored; never waits for one."""
        with self._lock:
            for subscription in self._subscriptions:
                subscription.hear(event)

    def join(self, head: Callable[[], str]) -> Subscription:
        """A subscription to events from now on; call it in the loop that will read it.

        ``head`` gives the newest record's cursor.
        """
        subscription = Subscription(head)
        with self._lock:
            if self._is_closed:
                subscription.ended.set()
            else:
                self._subscriptions.add(subscription)
        return subscription

    def leave(self, subscription: Subscription) -> None:
        """Remove a subscription, and count its lost events."""
        with self._lock:
            self._subscriptions.discard(subscription)
            self.n_slow_clients += subscription.is_lagging
            self.n_events_dropped += subscription.n_dropped

    def close(self) -> None:
        """End all streams, now and later."""
        with self._lock:
            self._is_closed = True
            for subscription in self._subscriptions:
                subscription.end()


GRACE_S: Final = 0.2  # chosen: for the last events of a stream that ends
RETRY_MS: Final = 3000  # chosen: pause of a browser before it connects again
_PAGE: Final = 5  # chosen: records in memory for each client

EVENT_SCHEMA: Final[dict[str, Any]] = {
    "type": "object",
    "description": "one server-sent event; data is JSON: an Estimate, a LoadEvent, a Trip, an Alarm, or {detail}",
    "properties": {
        "id": {"type": "string", "description": "cursor: send it as Last-Event-ID to resume behind it"},
        "event": {"enum": ["estimate", "rejection", "provisional", "event", "trip", "alarm", "lagged", "closing"]},
        "data": {"type": "string"},
    },
    "required": ["event", "data"],
}

LAGGED: Final = (
    b'event: lagged\ndata: {"detail":"this client read too slowly; connect again with Last-Event-ID to go on"}\n\n'
)
CLOSING: Final = b'event: closing\ndata: {"detail":"the service stops"}\n\n'


class EventStream(Response):
    """The response of /api/v1/stream. ``behind`` is the cursor to resume behind, None for live only."""

    media_type = "text/event-stream"

    def __init__(self, fanout: Fanout, reader: StoreReader, behind: str | None, keep_alive_s: float) -> None:
        super().__init__(headers={"cache-control": "no-store", "x-accel-buffering": "no"})
        del self.headers["content-length"]
        self._fanout = fanout
        self._reader = reader
        self._behind = behind
        self._keep_alive_s = keep_alive_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        behind = self._behind or self._reader.head()
        subscription = self._fanout.join(self._reader.head)
        follower = self._reader.follow(tuple(KINDS), behind, subscription.hear)
        try:
            await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
            await self._until_one_side_ends(subscription, follower, receive, send)
        finally:
            follower.close()
            self._fanout.leave(subscription)

    async def _until_one_side_ends(
        self, subscription: Subscription, follower: Follower, receive: Receive, send: Send
    ) -> None:
        writing = asyncio.create_task(self._write(subscription, follower, send))
        watching = [asyncio.create_task(_hung_up(receive)), asyncio.create_task(subscription.ended.wait())]
        try:
            await asyncio.wait([writing, *watching], return_when=asyncio.FIRST_COMPLETED)
            await asyncio.wait([writing], timeout=GRACE_S)  # a client that does not read is left behind
        finally:
            for task in (writing, *watching):
                task.cancel()
            written, *_ = await asyncio.gather(writing, *watching, return_exceptions=True)
        if isinstance(written, Exception):
            raise written

    async def _write(self, subscription: Subscription, follower: Follower, send: Send) -> None:
        async for chunk in self._chunks(subscription, follower):
            await send({"type": "http.response.body", "body": chunk, "more_body": True})
            subscription.has_read()
        await send({"type": "http.response.body", "body": LAGGED if subscription.is_lagging else CLOSING})

    async def _chunks(self, subscription: Subscription, follower: Follower) -> AsyncIterator[bytes]:
        """Records by their numbers, and between them, in order, events that are not stored."""
        yield b"retry: %d\n\n" % RETRY_MS
        while True:
            is_last = subscription.ended.is_set()  # before the last look: what came before the end still goes out
            passing = subscription.take()
            while records := await asyncio.to_thread(_read, follower):
                for record in records:
                    if passing is not None and record.number > _number(passing[0]):
                        yield passing[1]
                        passing = None
                    yield server_sent(record.kind, record.text, record.cursor)
            if passing is not None:
                yield passing[1]
            if is_last:
                return
            if not await subscription.wait(self._keep_alive_s):
                yield b": keep-alive\n\n"


def _read(follower: Follower) -> list[JournalRecord]:
    """Some records; none while the disk cannot be read: the next record or the keep-alive tries again."""
    try:
        return follower.read(_PAGE)
    except (StoreError, TimeoutError):
        return []


def _number(cursor: str) -> int:
    return int(cursor.partition("-")[2])


async def _hung_up(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
