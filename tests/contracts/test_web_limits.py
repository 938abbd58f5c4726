"""A server under connections that mean no good: bounded, and the others are answered."""

import asyncio
import logging
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import httpx
import pytest
from support.patience import PATIENCE_S, wait_until
from support.web import Gateway, Server, serving

from gateway.web.access.serving import CONNECTIONS
from gateway.web.app import BODY_BYTES

LIVE = b"GET /health/live HTTP/1.1\r\nHost: localhost\r\n\r\n"
CHUNK = b"8000\r\n" + b"x" * 0x8000 + b"\r\n"


def run(tmp_path: Path, scenario: Callable[[Server], Coroutine[Any, Any, None]]) -> None:
    async def whole(server: Server) -> None:
        await scenario(server)
        await asyncio.sleep(0.05)  # aborted connections are closed in the loop's next turns

    with Gateway(tmp_path) as gateway, serving(gateway.app) as server:
        asyncio.run(whole(server))
        assert httpx.get(f"{server.url}/api/v1/estimates/latest", timeout=PATIENCE_S).status_code == 200


async def said_to(server: Server, *parts: bytes) -> bytes:
    """The server's answer to these bytes, until it ends the connection."""
    reader, writer = await asyncio.open_connection(*server.socket.getsockname())
    try:
        for part in parts:
            writer.write(part)
        return await asyncio.wait_for(reader.read(), PATIENCE_S)
    except ConnectionError:
        return b""
    finally:
        writer.transport.abort()


@pytest.mark.parametrize(
    "request_text",
    [
        b"GET /\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\r\n\r\n",  # a TLS hello
        b"GET /" + b"a" * 40_000,
        b"GET / HTTP/1.1\r\n" + b"C: d\r\n" * 9000,
        b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: -5\r\n\r\n",
        b"POST /api/v1/statements HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nZZ\r\n",
    ],
)
def test_a_malformed_request_gets_an_error_and_no_log_line(
    tmp_path: Path, request_text: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    async def scenario(server: Server) -> None:
        assert (await said_to(server, request_text)).startswith(b"HTTP/1.1 400 ")

    run(tmp_path, scenario)
    assert [record for record in caplog.records if record.levelno > logging.INFO] == []


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        (b"Content-Length: 100000000", b""),
        (b"Transfer-Encoding: chunked\r\nConnection: close", (BODY_BYTES // 0x8000 + 2) * CHUNK),
    ],
)
def test_an_endless_body_is_refused(tmp_path: Path, kind: bytes, body: bytes) -> None:
    head = b"POST /api/v1/statements HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"

    async def scenario(server: Server) -> None:
        reader, writer = await asyncio.open_connection(*server.socket.getsockname())
        writer.write(head + kind + b"\r\n\r\n" + body)
        answer = await asyncio.wait_for(reader.readuntil(b"2,000,000 bytes"), PATIENCE_S)
        assert answer.startswith(b"HTTP/1.1 413 ")
        assert b"\r\ncontent-type: application/problem+json\r\n" in answer
        writer.transport.abort()

    run(tmp_path, scenario)


def test_a_body_as_long_as_allowed_is_read(tmp_path: Path) -> None:
    with Gateway(tmp_path) as gateway, serving(gateway.app) as server:
        spaces = b"{}".ljust(BODY_BYTES)
        url, headers = f"{server.url}/api/v1/statements", {"content-type": "application/json"}
        assert httpx.post(url, content=spaces, headers=headers, timeout=PATIENCE_S).status_code == 422
        assert httpx.post(url, content=spaces + b" ", headers=headers, timeout=PATIENCE_S).status_code == 413


def test_too_many_requests_get_503_and_places_are_freed_again(tmp_path: Path) -> None:
    async def scenario(server: Server) -> None:
        address = server.socket.getsockname()
        crowd = [await asyncio.open_connection(*address) for _ in range(CONNECTIONS)]
        await asyncio.to_thread(wait_until, lambda: len(server.uvicorn.server_state.connections) == CONNECTIONS)
        assert (await said_to(server, LIVE)).startswith(b"HTTP/1.1 503 ")
        for _, writer in crowd:
            writer.transport.abort()
        await asyncio.to_thread(wait_until, lambda: not server.uvicorn.server_state.connections)

    run(tmp_path, scenario)
