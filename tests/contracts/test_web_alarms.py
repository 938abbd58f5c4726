"""Alarms over HTTP: the active ones and the ended ones; in the stream and the metrics."""

import asyncio
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from fastapi.sse import ServerSentEvent
from support.alarms import LIMIT_KG, AlarmBench, of_load
from support.web import Client

from gateway.records import Why
from gateway.status import State, Status
from gateway.web.app import create_app
from gateway.web.routes.events_trips_alarms import Alarm

URL = "/api/v1/alarms"
OVER = LIMIT_KG + 60.0


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[AlarmBench]:
    made = AlarmBench(tmp_path)
    made.weigh(of_load(0, OVER, n_batches=2))
    yield made
    made.board.close()
    made.store.close()


@pytest.fixture
def client(bench: AlarmBench) -> Client:
    def status() -> Status:
        return Status(version="1", state=State.ESTIMATING, uptime_s=1.0, alarms=bench.desk.summary())

    return Client(create_app(bench.board, bench.store.reader(), status, alarms=bench.desk.standing))


def test_active_and_past_alarms_are_listed(bench: AlarmBench, client: Client) -> None:
    told = client.get(URL).json()
    assert [one["sentence"] for one in told["active"]] == ["The vehicle weighs 2560 +- 22 kg, limit 2500 kg"]
    assert told["items"] == told["active"]
    bench.weigh(of_load(1, 100.0))
    later = client.get(f"{URL}?cursor={told['last_cursor']}").json()
    assert later["active"] == []
    assert [(one["id"], one["is_active"], one["revision"]) for one in later["items"]] == [
        (told["items"][0]["id"], False, 2)
    ]


def test_metrics_name_active_and_watched_alarms(client: Client) -> None:
    text = client.get("/metrics").text
    assert 'springscale_alarms_active{is="overload.gross"} 1.0' in text
    assert 'springscale_alarms_active{is="sensor_fault.silent"}' not in text
    assert 'springscale_alarms_watched{is="sensor_fault.silent"} 1.0' in text
    assert "springscale_alarms_n_raised 1.0" in text
    assert client.get("/api/v1/status").json()["alarms"]["active"] == ["overload.gross"]


def test_a_resumed_stream_sends_what_was_missed(bench: AlarmBench) -> None:
    async def first() -> list[ServerSentEvent]:
        board = bench.board
        told = []
        with board.fanout.joined(bench.store.reader(), "0000-0") as subscription:
            async for event in subscription.events():
                told.append(event)
                if event.event == "alarm":
                    board.close()
        return told

    (text,) = [event.raw_data for event in asyncio.run(first()) if event.event == "alarm"]
    assert json.loads(text or "")["kind"] == "overload"


def test_answers_have_the_described_fields_and_no_other(bench: AlarmBench, client: Client) -> None:
    active = client.get(URL).json()["active"]
    assert len(active) == 1
    for n in (1, 2):
        bench.weigh(replace(of_load(n, 100.0), rejected=(Why.PITCH_RATE_STUCK,)))
    bench.weigh(of_load(3, 100.0))
    items = client.get(URL).json()["items"]
    assert sorted(one["kind"] for one in items) == ["overload", "sensor_fault"]
    for one in active + items:
        Alarm.model_validate_json(json.dumps(one), strict=True)
        assert set(one) == set(Alarm.model_fields)
