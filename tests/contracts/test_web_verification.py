"""Verification over HTTP: who may, what is judged, the page that is printed, and what cannot be smuggled into it."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from support.commands import called
from support.epochs import START_NS, drive_of, stored
from support.verification import CALIBRATED, verification_desk
from support.web import Client, Gateway, serving

from gateway.errors import SpringscaleError
from gateway.records import iso_utc
from gateway.web.access.tokens import Scope, TokenFile
from gateway.web.routes.verification import verification_page

URL = "/api/v1/calibration/verifications"
AT = iso_utc(START_NS + 60_000_000_000)
GOOD = {"by": "payload", "payload_kg": 100.0, "position_m": 1.4, "at": AT}


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    """A vehicle that weighed 112 kg; tokens come with the test."""
    store = stored(tmp_path / "weighed", drive_of(3, 112.0, calibration_id=CALIBRATED.id))
    tokens = TokenFile(tmp_path / "tokens.json")
    with Gateway(tmp_path / "store", tokens=tokens, verification=verification_desk(tmp_path, store)) as opened:
        yield opened
    store.close()


def test_a_record_is_made_listed_and_printed(gateway: Gateway) -> None:
    client = Client(gateway.app)
    made = client.request("POST", URL, json={"loads": [GOOD], "note": "scales of the yard"})
    assert made.status_code == 201, made.text
    record = made.json()
    assert (record["verdict"], record["by"], record["loads"][0]["error_kg"]) == ("passed", "local", 12.0)
    state = client.get(URL).json()
    assert state["history"] == [record]
    assert state["due"]["last_verdict"] == "passed"
    page = client.get(f"{URL}/{record['id']}")
    assert (page.status_code, page.headers["content-type"]) == (200, "text/html; charset=utf-8")
    for told in ("Verification of on-board weighing", "passed", "scales of the yard", "+12.0", record["id"]):
        assert told in page.text
    assert "script-src 'self'" in page.headers["content-security-policy"]
    assert client.get(f"{URL}/sha256:none").status_code == 404


def test_what_somebody_wrote_stays_text_on_the_page(gateway: Gateway) -> None:
    client = Client(gateway.app)
    record = client.request("POST", URL, json={"loads": [GOOD], "note": "<script>alert(1)</script>"}).json()
    page = client.get(f"{URL}/{record['id']}").text
    assert "<script>" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page
    told = verification_page(record | {"vehicle_id": "<b>van", "by": '"><img>'})
    assert "<b>" not in told
    assert "<img>" not in told


def test_a_refusal_is_a_problem_with_a_reason(gateway: Gateway) -> None:
    client = Client(gateway.app)
    refused = client.request("POST", URL, json={"loads": [GOOD | {"at": "2020-01-01T00:00:00Z"}]})
    assert (refused.status_code, refused.json()["reason"]) == (409, "no_epoch")
    assert "drive with it until a batch has counted" in refused.json()["detail"]


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"loads": []},
        {"loads": [{"by": "payload"}]},
        {"loads": [{"by": "gross", "payload_kg": 1.0}]},
        {"loads": [{"by": "gross", "gross_kg": -1.0}]},
        {"loads": [{"by": "gross", "gross_kg": "NaN"}]},
        {"loads": [GOOD | {"at": "yesterday"}]},
        {"loads": [GOOD | {"drive": "both"}]},
        {"loads": [GOOD | {"learn": True}]},
        {"loads": [GOOD] * 11},
        {"loads": [GOOD], "note": "x" * 201},
        {"loads": [GOOD], "note": "\ud83d"},
    ],
)
def test_what_is_not_understood_makes_no_record(gateway: Gateway, body: Any) -> None:
    client = Client(gateway.app)
    sent = {"content": json.dumps(body), "headers": {"Content-Type": "application/json"}}
    assert client.request("POST", URL, **sent).status_code == 422
    assert client.get(URL).json()["history"] == []


def test_reading_needs_scope_read_and_recording_operate(gateway: Gateway, tmp_path: Path) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    reader, operator = (
        {"Authorization": f"Bearer {tokens.create(name, scope)}"}
        for name, scope in (("reader", Scope.READ), ("workshop", Scope.OPERATE))
    )
    client = Client(gateway.app)
    assert client.get(URL).status_code == 401
    assert client.get(URL, headers=reader).status_code == 200
    assert client.request("POST", URL, json={"loads": [GOOD]}, headers=reader).status_code == 403
    made = client.request("POST", URL, json={"loads": [GOOD]}, headers=operator)
    assert (made.status_code, made.json()["by"]) == (201, "workshop")


def test_where_nothing_is_weighed_there_is_nothing_to_verify(tmp_path: Path) -> None:
    with Gateway(tmp_path) as gateway:
        client = Client(gateway.app)
        assert client.get(URL).json()["history"] == []
        assert client.request("POST", URL, json={"loads": [GOOD]}).json()["reason"] == "no_calibration"


def run(url: str, *arguments: str) -> Result:
    return called("verification", *arguments, "--url", url)


def test_the_command_records_shows_and_exports(gateway: Gateway, tmp_path: Path) -> None:
    with serving(gateway.app) as server:
        load = f"payload_kg=100,position_m=1.4,at={AT}"
        made = run(server.url, "record", "--load", load, "--note", "yard")
        assert made.exit_code == 0, made.exception
        assert "by local (yard): passed" in made.output
        assert "payload 100.0 kg known, 112.0 ± " in made.output
        assert "front axle +6.0 kg, +0.90 %" in made.output
        shown = run(server.url, "show")
        assert shown.output.splitlines()[0] == "rule: error at most 5 % of the gross weight, one load or more"
        assert made.output.strip() in shown.output
        record_id = json.loads(run(server.url, "show", "--json").output)["history"][0]["id"]
        output = tmp_path / "verification.html"
        assert run(server.url, "export", record_id[:19], "--output", str(output)).exit_code == 0
        assert record_id in output.read_text()
        for refused in (
            ("export", "sha256:none", "--output", str(output)),
            ("record", "--load", "gross_kg=1500"),
        ):
            assert isinstance(run(server.url, *refused).exception, SpringscaleError)
        for load in ("gross_kg=many", "weight=1", "gross_kg=1,payload_kg=2", "at=2026-11-21T04:00Z"):
            assert run(server.url, "record", "--load", load).exit_code == 2
        gateway.board.close()
