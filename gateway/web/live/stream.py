"""Server-sent events: what was missed from the store, then what happens, until one side has enough."""

import asyncio
import json
from collections import deque
from collections.abc import AsyncIterator
from typing import Any, Final

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from gateway.web.live.board import ESTIMATE, REJECTION
from gateway.web.live.fanout import Fanout, StreamEvent, Subscription
from gateway.web.reader import Reader

GRACE_S: Final = 0.2  # for the last words of a stream that ends
RETRY_MS: Final = 3000
_REPLAY_PAGE: Final = 5  # events in memory for each client that reads what it missed
_MOST_BESIDE: Final = 500  # events and trips between so many estimates
_REMEMBERED: Final = 1024  # replayed rows that may still arrive live: a row is published right after it is stored

EVENT_SCHEMA: Final[dict[str, Any]] = {
    "type": "object",
    "description": "one server-sent event; data is JSON: an Estimate, a LoadEvent, a Trip, an Alarm, or {detail}",
    "properties": {
        "id": {"type": "string", "description": "cursor: send it as Last-Event-ID to go on behind it"},
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

    def __init__(self, fanout: Fanout, reader: Reader, behind: str | None, keep_alive_s: float) -> None:
        super().__init__(headers={"cache-control": "no-store", "x-accel-buffering": "no"})
        del self.headers["content-length"]
        self._fanout = fanout
        self._reader = reader
        self._behind = behind
        self._keep_alive_s = keep_alive_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        subscription = self._fanout.join()  # before the first look into the store: nothing falls between
        try:
            await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
            await self._until_one_side_ends(subscription, receive, send)
        finally:
            self._fanout.leave(subscription)

    async def _until_one_side_ends(self, subscription: Subscription, receive: Receive, send: Send) -> None:
        writing = asyncio.create_task(self._write(subscription, send))
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

    async def _write(self, subscription: Subscription, send: Send) -> None:
        async for chunk in self._chunks(subscription):
            await send({"type": "http.response.body", "body": chunk, "more_body": True})
        await send({"type": "http.response.body", "body": LAGGED if subscription.is_lagging else CLOSING})

    async def _chunks(self, subscription: Subscription) -> AsyncIterator[bytes]:
        yield b"retry: %d\n\n" % RETRY_MS
        replayed: deque[str | None] = deque(maxlen=_REMEMBERED)
        if self._behind is not None:
            async for event in self._missed(self._behind):
                replayed.append(event.cursor)
                yield event.wire
        while True:
            live = await subscription.next(self._keep_alive_s)
            if live is None:
                if subscription.ended.is_set():
                    return
                yield b": keep-alive\n\n"
            elif live.cursor is None or live.cursor not in replayed:
                yield live.wire

    async def _missed(self, behind: str) -> AsyncIterator[StreamEvent]:
        cursor: str | None = behind
        while cursor is not None:
            events, cursor = await asyncio.to_thread(self._missed_page, cursor)
            for event in events:
                yield event

    def _missed_page(self, behind: str) -> tuple[list[StreamEvent], str | None]:
        """Some events behind a cursor, and where to go on. Blocks, in a thread of its own."""
        page = self._reader.estimates(cursor=behind, limit=_REPLAY_PAGE)
        rows = zip(page.items, page.cursors, strict=True)
        kinds = {True: REJECTION, False: ESTIMATE}  # the store keeps no provisional ones
        events = [StreamEvent.of(kinds[bool(json.loads(text)["rejected"])], text, place) for text, place in rows]
        beside = self._reader.entries(cursor=behind, upto=page.next_cursor, limit=_MOST_BESIDE)
        events += [
            StreamEvent.of(entry_kind(text), text, place)
            for text, place in zip(beside.items, beside.cursors, strict=True)
        ]
        return sorted(events, key=_number), page.next_cursor


def entry_kind(text: str) -> str:
    """event, trip or alarm, as its id begins."""
    kind: str = json.loads(text)["id"].partition("-")[0]
    return kind


def _number(event: StreamEvent) -> int:
    return int((event.cursor or "-0").partition("-")[2])


async def _hung_up(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
