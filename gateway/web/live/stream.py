"""Server-sent events: the journal from a place on, as it grows, until one side ends the stream."""

import asyncio
from collections.abc import AsyncIterator
from typing import Any, Final

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from gateway.errors import StoreError
from gateway.history import KINDS, JournalRecord
from gateway.store import Follower, StoreReader
from gateway.web.live.fanout import Fanout, StreamEvent, Subscription

GRACE_S: Final = 0.2  # for the last words of a stream that ends
RETRY_MS: Final = 3000
_PAGE: Final = 5  # records in memory for each client

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
                        yield passing[1].wire
                        passing = None
                    yield StreamEvent.of(record.kind, record.text, record.cursor).wire
            if passing is not None:
                yield passing[1].wire
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
