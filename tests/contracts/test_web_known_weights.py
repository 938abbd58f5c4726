"""Who may state known weights, what is answered, and what a page from elsewhere cannot do."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from hypothesis import given, settings
from hypothesis import strategies as st
from support.known_weights import FakePipeline, KnownWeightBench
from support.web import Client, Gateway

from gateway.calibration.known_weights_file import FILE_NAME, load_known_weights
from gateway.web.access import problems
from gateway.web.access.tokens import Scope, TokenFile
from gateway.web.routes.known_weights import known_weights_router

URL = "/api/v1/calibration/tare"
TICKETS = "/api/v1/calibration/tickets"
KNOWN = "/api/v1/known-weights"
EMPTY = {"is_empty": True}


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[KnownWeightBench]:
    made = KnownWeightBench(tmp_path / "vehicle", 276.0, 398.0)
    yield made
    made.store.close()


@pytest.fixture
def pipeline(bench: KnownWeightBench) -> FakePipeline:
    return bench.pipeline


@pytest.fixture
def local(tmp_path: Path, bench: KnownWeightBench) -> Iterator[Client]:
    """Without tokens, from this machine."""
    with Gateway(tmp_path / "store", known_weights=bench.service) as gateway:
        yield Client(gateway.app)


@pytest.fixture
def tokens(tmp_path: Path) -> TokenFile:
    return TokenFile(tmp_path / "tokens.json")


@pytest.fixture
def guarded(tmp_path: Path, bench: KnownWeightBench, tokens: TokenFile) -> Iterator[Client]:
    tokens.create("somebody", Scope.READ)
    with Gateway(tmp_path / "store", tokens=tokens, known_weights=bench.service) as gateway:
        yield Client(gateway.app)


def bearer(text: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {text}"}


def ticket(bench: KnownWeightBench, i: int = 0, payload_kg: float = 280.0, **more: Any) -> dict[str, Any]:
    return {"by": "payload", "payload_kg": payload_kg, "at": bench.stated(i, payload_kg).at, **more}


def test_set_look_and_undo(local: Client) -> None:
    made = local.request("POST", URL, json={**EMPTY, "note": "yard"})
    assert made.status_code == 201
    assert (made.json()["by"], made.json()["note"], made.json()["payload_kg"]) == ("local", "yard", 0.0)
    state = local.get(URL).json()
    assert state["history"] == [made.json()]
    assert state["offer"]["is_possible"] is True
    undone = local.request("DELETE", URL)
    assert undone.status_code == 200
    assert undone.json()["known_weights_id"] is None
    assert undone.json()["history"][0]["ended"]["why"] == "withdrawn"


def test_delete_goes_back_one_or_all(local: Client, pipeline: FakePipeline) -> None:
    first = local.request("POST", URL, json=EMPTY).json()
    for payload_kg in (14.0, 16.0):
        pipeline.weigh(payload_kg)
        local.request("POST", URL, json=EMPTY)
    local.request("DELETE", f"{URL}?to=previous")
    left = local.request("DELETE", URL).json()["history"]
    assert [one for one in left if one["ended"] is None] == [first]
    assert local.request("DELETE", f"{URL}?to=factory").json()["known_weights_id"] is None
    refused = local.request("DELETE", f"{URL}?to=factory")
    assert (refused.status_code, refused.json()["reason"]) == (404, "no_such_weight")


@pytest.mark.parametrize("kind", ["ticket", "delivery_note"])
def test_stated_shown_and_taken_back(local: Client, bench: KnownWeightBench, kind: str) -> None:
    said = {"kind": kind, "weight": ticket(bench, std_kg=3.0), "note": "no. 17"}
    made = local.request("POST", KNOWN, json=said)
    assert made.status_code == 201, made.text
    one = made.json()
    assert (one["kind"], one["by"], one["note"], one["state"]) == (kind, "local", "no. 17", "in_use")
    assert (one["payload_kg"], one["payload_std_kg"], one["estimated_payload_kg"]) == (280.0, 3.0, 276.0)
    state = local.get(KNOWN).json()
    assert (state["history"], state["n_teaching"], state["mean_error_kg"]) == ([one], 1, -4.0)
    after = local.request("DELETE", f"{KNOWN}/{one['id']}")
    assert (after.status_code, after.json()["history"][0]["state"]) == (200, "ended")
    again = local.request("DELETE", f"{KNOWN}/{one['id']}")
    assert (again.status_code, again.json()["reason"]) == (404, "no_such_weight")


def test_one_that_its_estimate_contradicts_is_held_until_it_is_confirmed(
    local: Client, bench: KnownWeightBench
) -> None:
    one = local.request("POST", TICKETS, json={"weight": ticket(bench, payload_kg=400.0)}).json()
    assert (one["state"], one["payload_kg"], one["estimated_payload_kg"]) == ("held", 400.0, 276.0)
    assert local.get(KNOWN).json()["known_weights_id"] is None
    confirmed = local.request("POST", f"{KNOWN}/{one['id']}/confirm")
    assert confirmed.status_code == 200
    assert confirmed.json()["history"][0]["confirmed"]["by"] == "local"
    assert confirmed.json()["known_weights_id"] == bench.in_use
    again = local.request("POST", f"{KNOWN}/{one['id']}/confirm")
    assert (again.status_code, again.json()["reason"]) == (409, "not_held")
    assert local.request("POST", f"{KNOWN}/sha256:none/confirm").status_code == 404


def test_tare_and_tickets_are_kinds_of_the_one_list(local: Client, bench: KnownWeightBench) -> None:
    empty = local.request("POST", KNOWN, json={"kind": "empty"}).json()
    weighed = local.request("POST", TICKETS, json={"weight": ticket(bench)}).json()
    assert [local.get(url).json()["history"] for url in (URL, TICKETS)] == [[empty], [weighed]]
    assert local.get(KNOWN).json()["history"] == [weighed, empty]
    refused = local.request("DELETE", f"{TICKETS}/{empty['id']}")  # it is no ticket
    assert (refused.status_code, refused.json()["reason"]) == (404, "no_such_weight")
    assert local.request("DELETE", f"{TICKETS}/{weighed['id']}").json()["history"][0]["state"] == "ended"


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"kind": "ticket"},
        {"kind": "empty", "weight": {"by": "gross", "gross_kg": 1.0}},
        {"kind": "axle_pads", "weight": {"by": "gross", "gross_kg": 1.0}},
        {"kind": "ticket", "weight": {"by": "axles", "front_axle_kg": 1.0}},
        {"kind": "ticket", "weight": {"by": "gross", "gross_kg": 1.0, "std_kg": 0.0}},
        {"kind": "guess", "weight": {"by": "gross", "gross_kg": 1.0}},
    ],
)
def test_what_is_not_understood_teaches_nothing(local: Client, body: Any) -> None:
    assert local.request("POST", KNOWN, json=body).status_code == 422
    assert local.get(KNOWN).json()["history"] == []


def test_a_refusal_is_a_problem_with_a_reason(local: Client, pipeline: FakePipeline, bench: KnownWeightBench) -> None:
    pipeline.age_s = 1000.0
    refused = local.request("POST", URL, json=EMPTY)
    assert refused.status_code == 409
    assert refused.headers["content-type"] == "application/problem+json"
    assert refused.json()["reason"] == "stale"
    assert "it was weighed 1000 s ago" in refused.json()["detail"]
    assert local.get(URL).json()["offer"]["reason"] == "stale"
    long_ago = local.request("POST", TICKETS, json={"weight": ticket(bench, at="2020-01-01T00:00:00Z")})
    assert (long_ago.status_code, long_ago.json()["reason"]) == (409, "no_epoch")


def test_a_disk_that_refuses_is_503(local: Client, bench: KnownWeightBench) -> None:
    (bench.directory / f".{FILE_NAME}.new").mkdir()
    refused = local.request("POST", URL, json=EMPTY)
    assert (refused.status_code, refused.json()["reason"]) == (503, "not_stored")
    assert local.get(URL).json()["history"] == []


@pytest.mark.parametrize("query", ["to=nothing", "too=factory", "to=factory&to=previous&x=1"])
def test_an_undo_that_is_not_understood_undoes_nothing(local: Client, query: str) -> None:
    local.request("POST", URL, json=EMPTY)
    assert local.request("DELETE", f"{URL}?{query}").status_code == 422
    assert local.get(URL).json()["n_teaching"] == 1


@pytest.mark.parametrize(
    "body", [{}, {"is_empty": False}, {"is_empty": "yes"}, {**EMPTY, "note": "x" * 201}, {**EMPTY, "force": True}, []]
)
def test_the_claim_must_be_made_in_full(local: Client, body: Any) -> None:
    assert local.request("POST", URL, json=body).status_code == 422
    assert local.get(URL).json()["history"] == []


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
    assert list(tmp_path.glob(f"**/*{FILE_NAME}*")) == []


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
    bench = KnownWeightBench(directory)
    app = FastAPI()
    problems.install(app, [])
    app.include_router(known_weights_router(bench.service))
    said = {"Content-Type": "application/json"}
    answer = Client(app).request("POST", "/api/v1/calibration/tare", content=json.dumps(body), headers=said)
    bench.store.close()
    assert answer.status_code in {201, 400, 422}
    load_known_weights(directory / FILE_NAME)


def test_every_body_that_a_route_takes_is_checked_so(local: Client) -> None:
    paths = local.app.openapi()["paths"].items()
    taking = [(how, path) for path, known in paths for how, one in known.items() if "requestBody" in one]
    assert len(taking) > 5
    for how, path in taking:
        said = {"Content-Type": "application/json"}
        answer = local.request(how.upper(), re.sub(r"{\w+}", "x", path), content=b'{"note": "\\ud800"}', headers=said)
        assert answer.status_code == 422, path
        assert "lone surrogate" in answer.text, path


def test_half_a_character_in_a_vehicle_s_name_is_refused_in_words(local: Client) -> None:
    url, said = "/api/v1/calibration/commissioning/vehicle", {"Content-Type": "application/json"}
    answer = local.request("POST", url, content=b'{"name": "\\ud800"}', headers=said)
    assert answer.status_code == 422
    assert "half a character" in answer.json()["detail"]


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


def test_where_nothing_is_weighed_there_is_nothing_to_condition(tmp_path: Path) -> None:
    with Gateway(tmp_path) as gateway:
        client = Client(gateway.app)
        assert client.get(URL).json()["offer"]["reason"] == "no_calibration"
        assert client.request("POST", URL, json=EMPTY).json()["reason"] == "no_calibration"
        assert client.request("DELETE", URL).json()["reason"] == "no_such_weight"
        assert client.get(KNOWN).json()["history"] == []
        body = {"kind": "ticket", "weight": {"by": "gross", "gross_kg": 1.0}}
        assert client.request("POST", KNOWN, json=body).json()["reason"] == "no_calibration"
        assert client.request("POST", f"{KNOWN}/x/confirm").json()["reason"] == "no_such_weight"
