"""Layers around the application: security headers, the date, HEAD as GET, and the length of a body."""

import asyncio
from collections import Counter
from email.utils import formatdate
from typing import Final

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send


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
                headers.append((b"date", formatdate(usegmt=True).encode()))
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


class BodyLimit:
    """ASGI middleware: whoever reads a body of more than ``most_bytes`` meets an HTTPException 413."""

    def __init__(self, app: ASGIApp, most_bytes: int) -> None:
        self._app = app
        self._most_bytes = most_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        n_bytes, length = 0, Headers(scope=scope).get("content-length", "0") if scope["type"] == "http" else "0"

        async def limited() -> Message:
            nonlocal n_bytes
            if int(length) <= self._most_bytes:
                message = await receive()
                n_bytes += len(message.get("body", b""))
                if n_bytes <= self._most_bytes:
                    return message
            raise HTTPException(413, f"the body has more than {self._most_bytes:,} bytes")

        await self._app(scope, limited, send)
