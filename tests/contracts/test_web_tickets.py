"""Tickets over HTTP and at the command line: who may, what is answered, what is refused."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from support.tickets import TicketBench
from support.web import Client, Gateway, serving

from gateway.cli import springscale
from gateway.errors import SpringscaleError
from gateway.web import Scope, TokenFile

URL = "/api/v1/calibration/tickets"


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[TicketBench]:
    made = TicketBench(tmp_path / "vehicle")
    made.finish(1.0)
    yield made
    made.store.close()


@pytest.fixture
def gateway(tmp_path: Path, bench: TicketBench) -> Iterator[Gateway]:
    tokens = TokenFile(tmp_path / "tokens.json")
    with Gateway(tmp_path / "store", tokens=tokens, tickets=bench.desk) as opened:
        yield opened


def ticket(bench: TicketBench, i: int = 1, **more: Any) -> dict[str, Any]:
    return {"by": "payload", "payload_kg": 270.0, "position_m": 1.4, "at": bench.stated(i).at, **more}


def test_handed_in_told_and_taken_back(gateway: Gateway, bench: TicketBench) -> None:
    client = Client(gateway.app)
    made = client.request("POST", URL, json={"weight": ticket(bench), "note": "no. 17"})
    assert made.status_code == 201, made.text
    assert (made.json()["by"], made.json()["note"], made.json()["payload_kg"]) == ("local", "no. 17", 270.0)
    state = client.get(URL).json()
    assert (state["history"], state["is_busy"], state["n_teaching"]) == ([made.json()], True, 1)
    after = client.request("DELETE", f"{URL}/{made.json()['id']}")
    assert after.status_code == 200
    assert after.json()["history"][0]["withdrawn"]["by"] == "local"
    again = client.request("DELETE", f"{URL}/{made.json()['id']}")
    assert (again.status_code, again.json()["reason"]) == (409, "no_such_ticket")


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"weight": None},
        {"weight": {"by": "payload"}},
        {"weight": {"by": "axles", "front_axle_kg": 1.0}},
        {"weight": {"by": "gross", "gross_kg": 1.0, "is_true": True}},
        {"weight": {"by": "gross", "gross_kg": 1.0}, "note": "x" * 201},
    ],
)
def test_what_is_not_understood_teaches_nothing(gateway: Gateway, body: Any) -> None:
    client = Client(gateway.app)
    assert client.request("POST", URL, json=body).status_code == 422
    assert client.get(URL).json()["history"] == []


def test_a_refusal_is_a_problem_with_a_reason(gateway: Gateway, bench: TicketBench) -> None:
    refused = Client(gateway.app).request("POST", URL, json={"weight": ticket(bench, at="2020-01-01T00:00:00Z")})
    assert (refused.status_code, refused.json()["reason"]) == (409, "no_epoch")


def test_reading_needs_scope_read_and_teaching_operate(gateway: Gateway, bench: TicketBench, tmp_path: Path) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    reader, operator = (
        {"Authorization": f"Bearer {tokens.create(name, scope)}"}
        for name, scope in (("reader", Scope.READ), ("workshop", Scope.OPERATE))
    )
    client, body = Client(gateway.app), {"weight": ticket(bench)}
    assert client.get(URL).status_code == 401
    assert client.get(URL, headers=reader).status_code == 200
    assert client.request("POST", URL, json=body, headers=reader).status_code == 403
    assert client.request("DELETE", f"{URL}/x", headers=reader).status_code == 403
    made = client.request("POST", URL, json=body, headers=operator)
    assert (made.status_code, made.json()["by"]) == (201, "workshop")


def test_where_nothing_is_weighed_there_is_nothing_to_learn(tmp_path: Path) -> None:
    with Gateway(tmp_path) as gateway:
        client = Client(gateway.app)
        assert client.get(URL).json()["is_possible"] is False
        body = {"weight": {"by": "gross", "gross_kg": 1.0}}
        assert client.request("POST", URL, json=body).json()["reason"] == "not_commissioned"
        assert client.request("DELETE", f"{URL}/x").json()["reason"] == "no_such_ticket"


def run(url: str, *arguments: str) -> Result:
    return CliRunner().invoke(springscale, ["calibration", "ticket", *arguments, "--url", url])


def test_the_command_adds_shows_and_withdraws(gateway: Gateway, bench: TicketBench) -> None:
    with serving(gateway.app) as server:
        shown = run(server.url, "show").output
        assert "provisional: payloads are told to ± 59 kg (95 %)" in shown
        assert "a ticket of 300 kg, 2.1 m behind the front axle would make it ± 24 kg" in shown
        weight = f"payload_kg=270,position_m=1.4,at={bench.stated(1).at}"
        made = run(server.url, "add", weight, "--note", "no. 17")
        assert made.exit_code == 0, made.exception
        assert "270 kg, 49.2 % in front, driven " in made.output
        assert "one ticket teaches\nthe calibration is being made anew" in run(server.url, "show").output
        ticket_id = json.loads(run(server.url, "show", "--json").output)["history"][0]["id"]
        assert isinstance(run(server.url, "withdraw", "sha256:none").exception, SpringscaleError)
        assert "withdrawn" in run(server.url, "withdraw", ticket_id[:19]).output
        assert isinstance(run(server.url, "add", "payload_kg=1,at=2020-01-01T00:00:00Z").exception, SpringscaleError)
        gateway.board.close()
