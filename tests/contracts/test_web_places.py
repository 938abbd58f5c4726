"""Positions that are kept and may not leave the vehicle: a token with scope read gets none, whatever it asks."""

from dataclasses import replace
from pathlib import Path

import pytest
from support.estimates import make_estimate
from support.web import Client, Gateway

from gateway.estimates.batch_estimate import Place, Way
from gateway.records import json_line
from gateway.web.access.tokens import Scope, TokenFile
from gateway.web.app import create_app

PLACE = Place(48.1, 11.5)
ASKED = ["estimates", "estimates/latest", "events", "trips", "events.csv", "stream"]


@pytest.fixture
def tokens(tmp_path: Path) -> TokenFile:
    return TokenFile(tmp_path / "tokens.json")


@pytest.fixture
def gateway(tmp_path: Path) -> Gateway:
    with Gateway(tmp_path / "store") as opened:
        way = Way(start=PLACE, end=PLACE)
        first = opened.publish(*(replace(make_estimate(n), way=way) for n in range(2)))[0]
        told = {"latitude_deg": 48.1, "longitude_deg": 11.5}
        record = {"id": "event-1-abc", "revision": 1, "place": told, "stops": [{"place": told}], "t_end": "2026"}
        load = {"payload_kg": 1.0, "payload_std_kg": 1.0, "payload_interval95_kg": [0.0, 2.0]}
        for kind in ("event", "trip"):
            whole = record | {"from": told, "to": told, "before": load, "after": load}
            opened.store.write_entry(kind, f"{kind}-1-abc", 1, json_line(whole | {"id": f"{kind}-1-abc"}))
        opened.store.flush(60.0)
        opened.board.close()  # so that the stream has an end
        opened.first = first
        yield opened


def told(gateway: Gateway, tokens: TokenFile | None, text: str | None, *, forward: bool) -> set[str]:
    """The records of the history that hold a position."""
    app = create_app(
        gateway.board, gateway.store.reader(), lambda: gateway.status, tokens=tokens, are_places_read=forward
    )
    headers = {"last-event-id": gateway.first} | ({} if text is None else {"authorization": f"Bearer {text}"})
    answers = {path: Client(app).get(f"/api/v1/{path}", headers=headers) for path in ASKED}
    assert {answer.status_code for answer in answers.values()} == {200}
    return {path for path, answer in answers.items() if "48.1" in answer.text or "11.5" in answer.text}


def test_a_read_token_gets_positions_only_if_they_are_forwarded(gateway: Gateway, tokens: TokenFile) -> None:
    """It got them all, whatever `[position] forward` said."""
    reader, operator = tokens.create("reader", Scope.READ), tokens.create("operator", Scope.OPERATE)
    assert told(gateway, tokens, reader, forward=False) == set()
    assert told(gateway, tokens, reader, forward=True) == set(ASKED)
    assert told(gateway, tokens, operator, forward=False) == set(ASKED)


def test_this_machine_gets_them(gateway: Gateway) -> None:
    assert told(gateway, None, None, forward=False) == set(ASKED)
