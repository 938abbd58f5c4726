"""Layers around the application: limits of concurrent answers, long bodies in pieces, security headers, HEAD as GET."""

import asyncio
from collections import Counter
from typing import Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gateway.web.access.problems import problem_response


def content_security_policy(*more_styles: str) -> str:
    """Files of this gateway alone; no inline script or style is allowed, unless ``more_styles`` say so."""
    styles = " ".join(("'self'", *more_styles))
    return (
        f"default-src 'none'; script-src 'self'; style-src {styles}; img-src 'self' data:; connect-src 'self'; "
        "font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


SECURITY_HEADERS: Final = (
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"permissions-policy", b"camera=(), geolocation=(), microphone=()"),
    (b"content-security-policy", content_security_policy().encode()),
)
NO_STORE: Final = (b"cache-control", b"no-store")
_NO_CACHE: Final = (b"cache-control", b"no-cache")  # may be cached, but must be revalidated


class SecurityHeaders:
    """ASGI middleware. Headers that an answer sets itself are kept.

    An answer without caching headers is not cached, or revalidated if it has an ETag.
    """

    def __init__(self, app: ASGIApp, counts: Counter[int]) -> None:
        self._app = app
        self._counts = counts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._counts[message["status"]] += 1
                names = {name for name, _ in message["headers"]}
                headers = [*message["headers"], *(more for more in SECURITY_HEADERS if more[0] not in names)]
                if b"cache-control" not in names:
                    headers.append(_NO_CACHE if b"etag" in names else NO_STORE)
                message["headers"] = headers
            await send(message)

        await self._app(scope, receive, send_with_headers)


class HeadAsGet:
    """ASGI middleware: HEAD is answered as GET is, without the body (RFC 9110, 9.3.2).

    An answer that would go on, a stream or a file, is ended as if the client had left.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return
        answered = asyncio.Event()

        async def send_head(message: Message) -> None:
            if message["type"] == "http.response.start":
                await send(message)
            elif not answered.is_set():
                answered.set()
                await send({"type": "http.response.body", "body": b""})

        async def gone() -> Message:
            await answered.wait()
            return {"type": "http.disconnect"}

        await self._app({**scope, "method": "GET"}, gone, send_head)


ANSWERS: Final = 48  # chosen: from the history that are under way at a time
ANSWERS_PER_CLIENT: Final = 16  # chosen: of one token, or of one address if there are none
STREAMS_PER_CLIENT: Final = 32  # chosen: tabs and programs of one client
WAIT_S: Final = 5.0  # chosen: for a turn
PIECE_BYTES: Final = 16_384  # chosen: a slow client holds little more than this in memory

_HISTORY: Final = (
    "/api/v1/estimates",
    "/api/v1/events",
    "/api/v1/trips",
    "/api/v1/alarms",
    "/api/v1/export",
)
_STREAM: Final = "/api/v1/stream"
_LOOK_S: Final = 0.05  # chosen: between two looks whether it is the client's turn


class ConcurrencyLimit:
    """ASGI middleware behind the guard: a client with too many history answers in progress has to wait.

    Each client has its own share, so others are not delayed. An answer counts until it is read or its client is gone.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._under_way: Counter[tuple[str, bool]] = Counter()  # by client, streams apart
        self._n_answers = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        path = scope.get("path", "")
        is_stream = path == _STREAM
        is_asked = scope["type"] == "http" and scope["method"] == "GET"
        if not (is_asked and (is_stream or path.startswith(_HISTORY))):
            await self._app(scope, receive, send)
            return
        mine = (_client_of(scope), is_stream)
        if not await self._has_turn(mine):
            detail = "too many answers are in progress: read them, or request less at a time"
            await problem_response(503, detail, path, headers={"retry-after": "5"})(scope, receive, send)
            return
        self._under_way[mine] += 1
        self._n_answers += not is_stream
        try:
            await self._app(scope, receive, send)
        finally:
            self._n_answers -= not is_stream
            self._under_way[mine] -= 1
            self._under_way += Counter()  # forgets those with none

    async def _has_turn(self, mine: tuple[str, bool]) -> bool:
        for _ in range(round(WAIT_S / _LOOK_S)):
            if self._is_free(mine):
                return True
            await asyncio.sleep(_LOOK_S)
        return self._is_free(mine)

    def _is_free(self, mine: tuple[str, bool]) -> bool:
        _, is_stream = mine
        if is_stream:
            return self._under_way[mine] < STREAMS_PER_CLIENT
        return self._under_way[mine] < ANSWERS_PER_CLIENT and self._n_answers < ANSWERS


class InChunks:
    """ASGI middleware: sends a long body in pieces, each when the client has read enough of the one before."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_in_pieces(message: Message) -> None:
            body: bytes = message.get("body", b"")
            if message["type"] != "http.response.body" or len(body) <= PIECE_BYTES:
                await send(message)
                return
            last = (len(body) - 1) // PIECE_BYTES * PIECE_BYTES
            for begin in range(0, last, PIECE_BYTES):
                piece = body[begin : begin + PIECE_BYTES]
                await send({"type": "http.response.body", "body": piece, "more_body": True})
            await send({**message, "body": body[last:]})

        await self._app(scope, receive, send_in_pieces)


def _client_of(scope: Scope) -> str:
    name = scope.get("state", {}).get("token_name")
    if name is not None:
        return f"token {name}"
    client = scope.get("client")
    return client[0] if client else ""
