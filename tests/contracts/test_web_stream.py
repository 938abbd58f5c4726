"""Server-sent events over a real server: what is sent, what is resumed, how it ends."""

import asyncio
import json
import tracemalloc
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import AbstractContextManager, asynccontextmanager
from dataclasses import replace
from typing import Any

import httpx
import pytest
from fastapi.sse import ServerSentEvent
from support.estimates import make_estimate, make_record
from support.patience import PATIENCE_S, until
from support.web import Client, Gateway, Server, serving

from gateway.records import Why
from gateway.web.live import stream as streams
from gateway.web.live.stream import Fanout


class Listener:
    """A client of the stream: events as (id, kind, record)."""

    def __init__(self, response: httpx.Response) -> None:
        self.response = response
        self._lines = response.aiter_lines()

    async def event(self) -> tuple[str | None, str, Any]:
        """The next event; StopAsyncIteration where the stream has ended. Comments and retry are skipped."""
        fields: dict[str, str] = {}
        while True:
            line = await asyncio.wait_for(anext(self._lines), PATIENCE_S)
            if not line and "data" in fields:
                return fields.get("id"), fields["event"], json.loads(fields["data"])
            if line and not line.startswith(":"):
                name, _, text = line.partition(": ")
                fields[name] = text

    async def numbers(self, n: int) -> list[int]:
        """Which batches the next n events are about."""
        return [(await self.event())[2]["t_end_ns"] // (300 * 10**9) - 1 for _ in range(n)]


@asynccontextmanager
async def listening(server: Server, last_event_id: str | None = None) -> AsyncIterator[Listener]:
    headers = {} if last_event_id is None else {"Last-Event-ID": last_event_id}
    async with (
        httpx.AsyncClient(timeout=PATIENCE_S) as client,
        client.stream("GET", f"{server.url}/api/v1/stream", headers=headers) as response,
    ):
        yield Listener(response)


def run(gateway: Gateway, scenario: Callable[[Server], Coroutine[Any, Any, None]]) -> None:
    with serving(gateway.app) as server:
        asyncio.run(scenario(server))


def test_each_record_is_sent_with_its_kind_and_cursor(gateway: Gateway) -> None:

    async def scenario(server: Server) -> None:
        async with listening(server) as listener:
            assert listener.response.headers["content-type"].startswith("text/event-stream")
            await until(lambda: gateway.board.fanout.n_subscribers == 1)
            cursors = gateway.publish(make_estimate(0), make_estimate(1, Why.GAP))
            gateway.board.publish(make_estimate(2, is_provisional=True))
            assert await listener.event() == (cursors[0], "estimate", make_record(0))
            assert await listener.event() == (cursors[1], "rejection", make_record(1, Why.GAP))
            assert await listener.event() == (None, "provisional", make_record(2, is_provisional=True))
        await until(lambda: gateway.board.fanout.n_subscribers == 0)

    run(gateway, scenario)


def test_a_stream_is_resumed_behind_the_last_event_without_loss_or_repetition(gateway: Gateway) -> None:
    cursors = gateway.publish(*(make_estimate(n) for n in range(250)))

    async def scenario(server: Server) -> None:
        async with listening(server, last_event_id=cursors[19]) as listener:
            await until(lambda: gateway.board.fanout.n_subscribers == 1)
            for n in range(250, 260):  # while the missed ones are on their way
                gateway.publish(make_estimate(n))
            assert await listener.numbers(240) == list(range(20, 260))

    run(gateway, scenario)


def test_a_quiet_stream_is_kept_alive_by_comments(gateway: Gateway, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fastapi.routing._PING_INTERVAL", 0.01)

    async def scenario(server: Server) -> None:
        async with listening(server) as listener:
            lines = listener.response.aiter_lines()
            seen: list[str] = []
            while seen.count(": ping") < 2 or "retry: 3000" not in seen:
                seen.append(await asyncio.wait_for(anext(lines), PATIENCE_S))
            assert set(seen) == {"retry: 3000", ": ping", ""}

    run(gateway, scenario)


def test_a_cursor_that_is_none_is_a_problem_before_the_stream_begins(gateway: Gateway) -> None:
    answer = Client(gateway.app).get("/api/v1/stream", headers={"Last-Event-ID": "nonsense"})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["where"] == "header.last-event-id"


def test_streams_are_limited_and_their_places_freed_again(gateway: Gateway, monkeypatch: pytest.MonkeyPatch) -> None:
    """Clients that open streams and read nothing took every connection from the others."""
    monkeypatch.setattr(streams, "STREAMS", 2)

    async def scenario(server: Server) -> None:
        async with listening(server):
            async with listening(server), listening(server) as third:
                assert third.response.status_code == 503
                told = json.loads(await third.response.aread())["detail"]
                assert told == "2 streams are open, and no more are served: close one"
            await until(lambda: gateway.board.fanout.n_subscribers == 1)
            async with listening(server) as next_one:
                assert next_one.response.status_code == 200
        await until(lambda: gateway.board.fanout.n_subscribers == 0)

    run(gateway, scenario)


def test_closing_the_board_ends_the_streams_and_lets_the_server_stop(gateway: Gateway) -> None:

    async def scenario(server: Server) -> None:
        async with listening(server) as listener, listening(server) as other:
            await until(lambda: gateway.board.fanout.n_subscribers == 2)
            gateway.publish(make_estimate(0), make_estimate(1))
            gateway.board.close()
            server.uvicorn.should_exit = True
            for each in (listener, other):
                assert await each.numbers(2) == [0, 1]  # what was queued still goes out
                assert (await each.event())[1] == "closing"
                with pytest.raises(StopAsyncIteration):
                    await each.event()
            await asyncio.to_thread(server.thread.join, PATIENCE_S)
            assert not server.thread.is_alive()

    run(gateway, scenario)


def test_a_client_that_does_not_read_holds_no_memory_and_gets_all_later(gateway: Gateway) -> None:
    ballast = "x" * 1_000_000  # more than the sockets hold

    async def scenario(server: Server) -> None:
        async with listening(server) as deaf, listening(server) as listener:
            await until(lambda: gateway.board.fanout.n_subscribers == 2)
            tracemalloc.start()
            for n in range(40):
                gateway.board.publish(replace(make_estimate(n, is_provisional=True), vin=ballast))
                assert (await listener.event())[2]["payload_kg"] == 100.0 + n
            held, _ = tracemalloc.get_traced_memory()
            tracemalloc.stop()
            assert held < 15_000_000  # of 40
            gateway.publish(make_estimate(40))
            seen = [await deaf.event()]
            while seen[-1][1] != "estimate":
                seen.append(await deaf.event())
            assert len(seen) < 20
            assert seen[-2][2]["payload_kg"] == 139.0  # the newest of those that were not stored
        await until(lambda: gateway.board.fanout.n_subscribers == 0)

    run(gateway, scenario)


def test_publishing_after_the_loop_is_gone_harms_nobody(gateway: Gateway) -> None:
    fanout = Fanout()

    async def join() -> AbstractContextManager[object]:
        joined = fanout.joined(gateway.store.reader(), None)
        joined.__enter__()
        return joined

    joined = asyncio.run(join())
    fanout.publish(ServerSentEvent(event="estimate", raw_data="{}"))
    fanout.close()
    joined.__exit__(None, None, None)
