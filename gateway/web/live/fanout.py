"""Subscribers: each stream has its own place in the journal; a slow client is ended alone, and counted."""

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

MOST_UNREAD: Final = 64  # events that may come while a client takes none: hours of batches


@dataclass(frozen=True, slots=True)
class StreamEvent:
    """A server-sent event, ready for the wire (WHATWG HTML, 9.2)."""

    cursor: str | None
    wire: bytes

    @classmethod
    def of(cls, kind: str, text: str, cursor: str | None) -> "StreamEvent":
        """``text`` must be one line, as compact JSON is."""
        identity = "" if cursor is None else f"id: {cursor}\n"
        return cls(cursor, f"{identity}event: {kind}\ndata: {text}\n\n".encode())


class Subscription:
    """The events that one client still has to receive. All but ``hear`` and ``end`` belongs to the loop it was made in.

    Records are in the journal, where the client has a place; of events that are not stored only the newest waits here,
    with the number of the newest record at its time.
    """

    def __init__(self, head: Callable[[], str]) -> None:
        self._loop = asyncio.get_running_loop()
        self._head = head
        self._news = asyncio.Event()
        self._passing: tuple[str, StreamEvent] | None = None
        self._n_unread = 0
        self.ended = asyncio.Event()
        self.is_lagging = False
        self.n_dropped = 0

    def hear(self, passing: StreamEvent | None = None) -> None:
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

    def take(self) -> tuple[str, StreamEvent] | None:
        """The event that is not stored, if there is one, and the record it follows."""
        passing, self._passing = self._passing, None
        return passing

    def has_read(self) -> None:
        """The client has received what it was sent."""
        self._n_unread = 0

    def _count(self, passing: tuple[str, StreamEvent] | None) -> None:
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

    def publish(self, event: StreamEvent) -> None:
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
