"""Connections that mean no good: slow, endless, too many. Others are answered all the while."""

import asyncio
import json
import logging
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import httpx
import pytest
import uvicorn
from support.patience import PATIENCE_S, until
from support.web import Client, Gateway, Server, serving

from gateway.web.access import middleware
from gateway.web.access import serving as web_serving

STRANGER = "127.0.0.2"  # another address of this machine

Connection = tuple[asyncio.StreamReader, asyncio.StreamWriter]


async def connect(server: Server) -> Connection:
    host, port = server.socket.getsockname()
    return await asyncio.open_connection(host, port, local_addr=(STRANGER, 0))


async def ended(connection: Connection) -> bytes:
    """What the server said before it ended the connection."""
    reader, writer = connection
    try:
        said = await asyncio.wait_for(reader.read(), PATIENCE_S)
    except ConnectionError:
        said = b""
    writer.transport.abort()
    return said


def assert_problem(said: bytes, status: int) -> None:
    """One whole answer that says what is wrong, in the form and under the headers of all others."""
    head, _, body = said.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 %d " % status)
    assert b"\r\ncontent-type: application/problem+json\r\n" in head
    assert b"\r\nx-content-type-options: nosniff\r\n" in head
    assert json.loads(body)["status"] == status


async def assert_others_are_answered(server: Server) -> None:
    async with httpx.AsyncClient(timeout=PATIENCE_S) as client:
        assert (await client.get(f"{server.url}/api/v1/estimates/latest")).status_code == 200


def run(tmp_path: Path, scenario: Callable[[Server], Coroutine[Any, Any, None]]) -> None:
    with Gateway(tmp_path) as gateway, serving(gateway.app) as server:
        asyncio.run(scenario(server))


async def begin_slowly(server: Server) -> list[Connection]:
    """Some say nothing at all, some begin, some promise a body."""
    slow = [await connect(server) for _ in range(30)]
    for n, (_, writer) in enumerate(slow):
        begun = [b"", b"GET / HTTP/1.1\r\nHost: local", b"POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\nx"]
        writer.write(begun[n % 3])
    return slow


def test_a_request_that_never_ends_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scenario(server: Server) -> None:
        in_time = await begin_slowly(server)
        await assert_others_are_answered(server)
        monkeypatch.setattr(web_serving, "REQUEST_S", 0.1)
        await asyncio.gather(*(ended(each) for each in await begin_slowly(server)))
        for _, writer in in_time:
            writer.transport.abort()

    run(tmp_path, scenario)


def test_a_connection_that_asked_in_time_is_not_ended(tmp_path: Path) -> None:
    async def scenario(server: Server) -> None:
        reader, writer = await connect(server)
        for _ in range(2):
            writer.write(b"GET /health/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert (await reader.readuntil(b'{"is_alive":true}')).startswith(b"HTTP/1.1 200")
            (held,) = server.uvicorn.server_state.connections
            assert isinstance(held, web_serving.GuardedConnection)
            assert held._deadline is None
        writer.transport.abort()

    run(tmp_path, scenario)


def test_more_connections_than_one_address_may_have_are_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(web_serving, "CONNECTIONS_PER_ADDRESS", 10)

    async def scenario(server: Server) -> None:
        flood = [await connect(server) for _ in range(25)]
        refused = await asyncio.gather(*(ended(each) for each in flood[10:]))
        assert refused == [b""] * 15
        await assert_others_are_answered(server)
        for _, writer in flood[:10]:
            writer.transport.abort()
        await until(lambda: not server.uvicorn.server_state.connections)
        reader, writer = await connect(server)  # places are given back
        writer.write(b"GET /health/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert (await reader.read(12)) == b"HTTP/1.1 200"
        writer.transport.abort()

    run(tmp_path, scenario)


@pytest.mark.parametrize(
    "head",
    [b"GET /" + b"a" * 40_000, b"GET / HTTP/1.1\r\nX: " + b"b" * 40_000, b"GET / HTTP/1.1\r\n" + b"C: d\r\n" * 9000],
)
def test_an_endless_head_is_refused(tmp_path: Path, head: bytes) -> None:
    async def scenario(server: Server) -> None:
        stranger = await connect(server)
        stranger[1].write(head)
        assert_problem(await ended(stranger), 431)
        await assert_others_are_answered(server)

    run(tmp_path, scenario)


ENDLESS_BODY = (b"8000\r\n" + b"x" * 0x8000 + b"\r\n") * 8
ENDLESS = [b"Content-Length: 100000000", b"Transfer-Encoding: chunked"]


@pytest.mark.parametrize("kind", ENDLESS)
def test_an_endless_body_is_refused(tmp_path: Path, kind: bytes) -> None:
    async def scenario(server: Server) -> None:
        stranger = await connect(server)
        head = b"POST /api/v1/calibration/tare HTTP/1.1\r\nHost: localhost\r\n" + kind + b"\r\n\r\n"
        stranger[1].write(head + ENDLESS_BODY)
        assert_problem(await ended(stranger), 413)
        await assert_others_are_answered(server)

    run(tmp_path, scenario)


@pytest.mark.parametrize("kind", ENDLESS)
def test_an_endless_body_after_the_answer_is_cut_off(
    tmp_path: Path, kind: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_serving, "LINGER_S", 0.05)

    async def scenario(server: Server) -> None:
        reader, writer = stranger = await connect(server)
        writer.write(b"POST /api/v1/status HTTP/1.1\r\nHost: localhost\r\n" + kind + b"\r\n\r\n")
        assert (await reader.readuntil(b"}")).startswith(b"HTTP/1.1 405")
        writer.write(ENDLESS_BODY)
        assert await ended(stranger) == b""
        await assert_others_are_answered(server)

    run(tmp_path, scenario)


def test_many_requests_in_one_breath_are_no_long_head(tmp_path: Path) -> None:
    async def scenario(server: Server) -> None:
        reader, writer = await connect(server)
        writer.write(b"GET /health/live HTTP/1.1\r\nHost: localhost\r\n\r\n" * 1000)
        for _ in range(1000):
            assert (await reader.readuntil(b'{"is_alive":true}')).startswith(b"HTTP/1.1 200")
        writer.transport.abort()

    run(tmp_path, scenario)


@pytest.mark.parametrize(
    "request_text",
    [
        b"GET / HTTP/9.9\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01",  # a TLS hello
        b"GET / HTTP/1.1\r\nHost: localhost\r\nX: a\x00b\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: -5\r\n\r\n",
    ],
)
def test_what_is_no_request_ends_with_400_and_leaves_no_word_in_the_log(
    tmp_path: Path, request_text: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    async def scenario(server: Server) -> None:
        stranger = await connect(server)
        stranger[1].write(request_text)
        assert_problem(await ended(stranger), 400)
        await assert_others_are_answered(server)

    run(tmp_path, scenario)
    assert [record for record in caplog.records if record.levelno > logging.INFO] == []


def test_another_server_in_the_process_does_not_bring_these_words_back() -> None:
    uvicorn.Config("another:app")  # as it comes, it forgets the levels of all loggers below its own
    assert not web_serving._log.isEnabledFor(logging.WARNING)


def test_who_reads_nothing_is_cut_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(web_serving, "UNREAD_S", 0.3)

    async def scenario(server: Server) -> None:
        reader, writer = stranger = await connect(server)
        writer.transport.pause_reading()
        while server.uvicorn.server_state.connections:  # so many unread answers that no kernel holds them
            writer.write(b"GET /swagger/swagger-ui-bundle.js HTTP/1.1\r\nHost: localhost\r\n\r\n")
            await asyncio.sleep(0.01)
        await assert_others_are_answered(server)
        del reader
        stranger[1].transport.abort()

    run(tmp_path, scenario)


def test_who_reads_nothing_gives_way_to_a_newcomer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(web_serving, "CONNECTIONS", 20)

    async def scenario(server: Server) -> None:
        crowd = [await connect(server) for _ in range(20)]
        await assert_others_are_answered(server)
        for _, writer in crowd:
            writer.transport.abort()

    run(tmp_path, scenario)


def test_one_address_waits_for_its_own_answers_and_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(middleware, "WAIT_S", 0.2)
    monkeypatch.setattr(middleware, "STREAMS_PER_CLIENT", 2)

    async def scenario(server: Server) -> None:
        crowd = [await connect(server) for _ in range(3)]
        said = []
        for reader, writer in crowd:
            writer.write(b"GET /api/v1/stream HTTP/1.1\r\nHost: localhost\r\n\r\n")
            said.append(await reader.read(12))
        assert said == [b"HTTP/1.1 200", b"HTTP/1.1 200", b"HTTP/1.1 503"]
        async with (
            httpx.AsyncClient(timeout=PATIENCE_S) as client,
            client.stream("GET", f"{server.url}/api/v1/stream") as response,
        ):
            assert response.status_code == 200
        for _, writer in crowd:
            writer.transport.abort()

    run(tmp_path, scenario)


def test_whatever_reads_the_history_waits_for_its_turn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Events, trips and alarms, as pages and as files, did not: one client could have taken every thread with them."""
    monkeypatch.setattr(middleware, "WAIT_S", 0.0)
    monkeypatch.setattr(middleware, "ANSWERS_PER_CLIENT", 0)
    with Gateway(tmp_path) as gateway:
        client = Client(gateway.app)
        described = client.get("/openapi.json").json()["paths"]
        asks = {
            path: {one["name"] for one in its.get("get", {}).get("parameters", ())} for path, its in described.items()
        }
        history = [path for path, names in asks.items() if names & {"since", "cursor", "starttime"}]
        assert len(history) >= 12
        answered = {path: client.get(path).status_code for path in history}
    assert answered == dict.fromkeys(history, 503)
