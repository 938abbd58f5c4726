"""One event to many streams: bounded, each slow client dropped alone, every drop counted."""

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

QUEUE: Final = 64  # events a client may lag behind: hours of batches


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
    """The queue of one client. All methods but ``offer`` and ``end`` belong to the loop it was made in."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._queue: deque[StreamEvent] = deque()
        self._news = asyncio.Event()
        self.ended = asyncio.Event()
        self.is_lagging = False
        self.n_dropped = 0

    def offer(self, event: StreamEvent) -> None:
        """Queue an event, from any thread. A client too far behind loses its queue and is ended."""
        self._in_loop(self._append, event)

    def end(self) -> None:
        """End the stream, from any thread."""
        self._in_loop(self.ended.set)
        self._in_loop(self._news.set)

    async def next(self, timeout_s: float) -> StreamEvent | None:
        """The next event; None where there was none in time, or the stream has ended and all was taken."""
        if not self._queue and not self.ended.is_set():
            self._news.clear()
            try:
                await asyncio.wait_for(self._news.wait(), timeout_s)
            except TimeoutError:
                return None
        return self._queue.popleft() if self._queue else None

    def _append(self, event: StreamEvent) -> None:
        if len(self._queue) >= QUEUE:
            self.n_dropped += len(self._queue) + 1
            self._queue.clear()
            self.is_lagging = True
            self.ended.set()
        elif not self.ended.is_set():
            self._queue.append(event)
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
        """Hand an event to every client; never waits for one."""
        with self._lock:
            for subscription in self._subscriptions:
                subscription.offer(event)

    def join(self) -> Subscription:
        """A subscription to all that is published from now on; call it in the loop that will read it."""
        subscription = Subscription()
        with self._lock:
            if self._is_closed:
                subscription.ended.set()
            else:
                self._subscriptions.add(subscription)
        return subscription

    def leave(self, subscription: Subscription) -> None:
        """Forget a subscription, and count what it lost."""
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
