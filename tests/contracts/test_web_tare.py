"""Who may re-zero, what is answered, and what a page from elsewhere cannot do."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from hypothesis import given, settings
from hypothesis import strategies as st
from support.tare import FakePipeline, tare_desk
from support.web import Client, Gateway

from gateway.calibration.tare_file import load_tares
from gateway.service.tare_desk import TareDesk
from gateway.web import Scope, TokenFile
from gateway.web.door import problems
from gateway.web.routes.calibration import tare_router
from gateway.web.schemas import Body

URL = "/api/v1/calibration/tare"
EMPTY = {"is_empty": True}


@pytest.fixture
def pipeline() -> FakePipeline:
    return FakePipeline()


@pytest.fixture
def desk(tmp_path: Path, pipeline: FakePipeline) -> TareDesk:
    return tare_desk(tmp_path, pipeline)


@pytest.fixture
def local(tmp_path: Path, desk: TareDesk) -> Iterator[Client]:
    """Without tokens, from this machine."""
    with Gateway(tmp_path / "store", tare=desk) as gateway:
        yield Client(gateway.app)


@pytest.fixture
def tokens(tmp_path: Path) -> TokenFile:
    return TokenFile(tmp_path / "tokens.json")


@pytest.fixture
def guarded(tmp_path: Path, desk: TareDesk, tokens: TokenFile) -> Iterator[Client]:
    tokens.create("somebody", Scope.READ)
    with Gateway(tmp_path / "store", tokens=tokens, tare=desk) as gateway:
        yield Client(gateway.app)


def bearer(text: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {text}"}


def test_set_look_and_undo(local: Client) -> None:
    made = local.request("POST", URL, json={**EMPTY, "note": "yard"})
    assert made.status_code == 201
    assert (made.json()["by"], made.json()["note"], made.json()["payload_kg"]) == ("local", "yard", 12.0)
    state = local.get(URL).json()
    assert state["active"] == made.json()
    assert state["offer"]["is_possible"] is True
    undone = local.request("DELETE", URL)
    assert undone.status_code == 200
    assert undone.json()["active"] is None
    assert undone.json()["history"][0]["ended"]["why"] == "undone"


def test_delete_goes_back_one_or_to_the_factory_zero(local: Client, pipeline: FakePipeline) -> None:
    first = local.request("POST", URL, json=EMPTY).json()
    for payload_kg in (14.0, 16.0):
        pipeline.weigh(payload_kg)
        local.request("POST", URL, json=EMPTY)
    local.request("DELETE", f"{URL}?to=previous")
    assert local.request("DELETE", URL).json()["active"] == first
    local.request("POST", URL, json=EMPTY)
    assert local.request("DELETE", f"{URL}?to=factory").json()["active"] is None
    refused = local.request("DELETE", f"{URL}?to=factory")
    assert (refused.status_code, refused.json()["reason"]) == (409, "not_tared")


def test_a_refusal_is_a_problem_with_a_reason(local: Client, pipeline: FakePipeline) -> None:
    pipeline.weigh(200.0)
    refused = local.request("POST", URL, json=EMPTY)
    assert refused.status_code == 409
    assert refused.headers["content-type"] == "application/problem+json"
    assert refused.json()["reason"] == "offset_too_large"
    assert "the payload is +200.0 kg off, a tare corrects up to 62.0 kg" in refused.json()["detail"]
    assert local.get(URL).json()["offer"]["reason"] == "offset_too_large"


def test_a_disk_that_refuses_is_503(local: Client, tmp_path: Path) -> None:
    (tmp_path / ".tare.json.new").mkdir()
    refused = local.request("POST", URL, json=EMPTY)
    assert (refused.status_code, refused.json()["reason"]) == (503, "not_stored")
    assert local.get(URL).json()["active"] is None


@pytest.mark.parametrize("query", ["to=nothing", "too=factory", "to=factory&to=previous&x=1"])
def test_an_undo_that_is_not_understood_undoes_nothing(local: Client, query: str) -> None:
    local.request("POST", URL, json=EMPTY)
    assert local.request("DELETE", f"{URL}?{query}").status_code == 422
    assert local.get(URL).json()["active"] is not None


@pytest.mark.parametrize(
    "body", [{}, {"is_empty": False}, {"is_empty": "yes"}, {**EMPTY, "note": "x" * 201}, {**EMPTY, "force": True}, []]
)
def test_the_claim_must_be_made_in_full(local: Client, body: Any) -> None:
    assert local.request("POST", URL, json=body).status_code == 422
    assert local.get(URL).json()["active"] is None


# what JSON can say and UTF-8 cannot, in every place of a body; the text is what goes over the wire
NO_TEXT = [
    r'{"is_empty": true, "note": "\ud83d"}',
    r'{"is_empty": true, "note": "a\udc00b"}',
    r'{"is_empty": true, "\ud83d": 1}',
    r'{"is_empty": "\ud83d"}',
    r'"\ud83d"',
    r'[[{"a": ["\udfff"]}]]',
    r'{"is_empty": true, "note": null}',
]


@pytest.mark.parametrize("body", NO_TEXT)
def test_text_that_is_none_is_a_problem_and_leaves_no_trace(local: Client, tmp_path: Path, body: str) -> None:
    refused = local.request("POST", URL, content=body, headers={"Content-Type": "application/json"})
    assert (refused.status_code, refused.headers["content-type"]) == (422, "application/problem+json")
    assert local.get(URL).json()["history"] == []
    assert list(tmp_path.glob("*tare.json*")) == []


_TEXT = st.text(st.characters(codec=None, categories=["L", "N", "P", "Cs", "Cc", "So"]), max_size=8)
_ANY = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | _TEXT,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_TEXT, inner, max_size=3),
    max_leaves=6,
)
_CLAIM = st.fixed_dictionaries({}, optional={"is_empty": st.just(True) | _ANY, "note": _TEXT | _ANY, "x": _ANY})


@settings(max_examples=60)
@given(body=_CLAIM | _ANY)
def test_no_body_is_met_with_an_error_of_ours_or_spoils_the_next_start(
    tmp_path_factory: pytest.TempPathFactory, body: Any
) -> None:
    directory = tmp_path_factory.mktemp("fuzzed")
    desk = tare_desk(directory, FakePipeline())
    app = FastAPI()
    problems.install(app)
    app.include_router(tare_router(desk))
    said = {"Content-Type": "application/json"}
    answer = Client(app).request("POST", "/api/v1/calibration/tare", content=json.dumps(body), headers=said)
    assert answer.status_code in {201, 400, 422}
    load_tares(directory / "tare.json")


def test_every_body_that_a_route_takes_is_checked_so(local: Client) -> None:
    operations = [one for path in local.app.openapi()["paths"].values() for one in path.values()]
    bodies = [one["requestBody"]["content"]["application/json"] for one in operations if "requestBody" in one]
    checked = {kind.__name__ for kind in Body.__subclasses__()}
    assert {body["schema"]["$ref"].rpartition("/")[2] for body in bodies} == checked


def test_reading_needs_scope_read_and_changing_needs_operate(guarded: Client, tokens: TokenFile) -> None:
    reader, operator = tokens.create("reader", Scope.READ), tokens.create("workshop", Scope.OPERATE)
    for method in ("GET", "POST", "DELETE"):
        assert guarded.request(method, URL, json=EMPTY).status_code == 401
    assert guarded.get(URL, headers=bearer(reader)).status_code == 200
    for method in ("POST", "DELETE"):
        refused = guarded.request(method, URL, json=EMPTY, headers=bearer(reader))
        assert refused.status_code == 403
        assert 'scope="operate"' in refused.headers["www-authenticate"]
    made = guarded.request("POST", URL, json=EMPTY, headers=bearer(operator))
    assert (made.status_code, made.json()["by"]) == (201, "workshop")
    undone = guarded.request("DELETE", URL, headers=bearer(operator))
    assert undone.json()["history"][0]["ended"]["by"] == "workshop"


@pytest.mark.parametrize(
    "origin", ["https://elsewhere.example", "http://localhost:9999", "null", "http://127.0.0.1:8000"]
)
def test_without_tokens_a_page_from_elsewhere_changes_nothing(local: Client, origin: str) -> None:
    """A browser sends such requests without asking; the dashboard's own come from where it is served."""
    for method in ("POST", "DELETE"):
        assert local.request(method, URL, json=EMPTY, headers={"Origin": origin}).status_code == 403
    assert local.get(URL, headers={"Origin": origin}).json()["history"] == []


def test_the_dashboards_own_page_may(local: Client) -> None:
    made = local.request("POST", URL, json=EMPTY, headers={"Origin": "http://localhost:8000"})
    assert made.status_code == 201


@pytest.mark.parametrize("kind", [None, "text/plain", "application/x-www-form-urlencoded"])
def test_a_form_is_no_claim(local: Client, kind: str | None) -> None:
    headers = {} if kind is None else {"Content-Type": kind}
    assert local.request("POST", URL, content=b'{"is_empty": true}', headers=headers).status_code == 422


@pytest.mark.parametrize("method", ["OPTIONS", "PUT", "PATCH"])
def test_what_is_not_possible_is_answered_with_all_that_is(local: Client, method: str) -> None:
    answer = local.request(method, URL)
    assert answer.status_code == 405
    assert set(answer.headers["allow"].split(", ")) == {"GET", "HEAD", "POST", "DELETE"}


def test_where_nothing_is_weighed_there_is_nothing_to_re_zero(tmp_path: Path) -> None:
    with Gateway(tmp_path) as gateway:
        client = Client(gateway.app)
        assert client.get(URL).json()["offer"]["reason"] == "no_calibration"
        assert client.request("POST", URL, json=EMPTY).json()["reason"] == "no_calibration"
        assert client.request("DELETE", URL).json()["reason"] == "not_tared"
