"""Any JSON body is answered or refused in words: no exception, no hang."""

import json
import logging
import math
import time
from collections.abc import Iterator
from typing import Any, Final

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.learner import ANSWERS, LearnerBench, at
from support.web import Client, Gateway

MANY = settings(max_examples=500, derandomize=True, deadline=None, suppress_health_check=list(HealthCheck))
SLOWEST_S: Final = 5.0  # chosen: a thousand times what an answer takes

NUMBERS = st.one_of(
    st.integers(), st.floats(), st.sampled_from([0, -1, 10**400, -(10**400), 1e308, 5e-324, math.nan, math.inf, True])
)
TEXTS = st.one_of(st.text(max_size=20), st.sampled_from(["", "\0", "\ud800", "x" * 300, "axles", "payload", "empty"]))
ANY = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBERS, TEXTS),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(TEXTS, inner, max_size=4)),
    max_leaves=12,
)

SOUND: dict[str, tuple[str, dict[str, Any]]] = {  # by route, its method and a body that it takes
    "/api/v1/statements": ("POST", {"source": "empty", "from": at(0), "load": {"payload_kg": 0.0}}),
    "/api/v1/vehicle": ("PUT", ANSWERS),
    "/api/v1/vehicle/sister": ("PUT", {"format": "springscale-calibration", "version": 1, "vehicle": ANSWERS}),
    "/api/v1/learning": ("PUT", {"use": "newest"}),
}


@st.composite
def changed(draw: st.DrawFn, sound: Any) -> Any:
    """A sound body with parts replaced, left out or added at any depth."""
    if isinstance(sound, dict):
        kept = {key: draw(changed(one)) for key, one in sound.items() if draw(st.integers(0, 9))}
        return kept | draw(st.one_of(st.just({}), st.dictionaries(TEXTS, ANY, max_size=1)))
    if isinstance(sound, list):
        return [draw(changed(one)) for one in sound] * draw(st.sampled_from([1, 1, 0, 12]))
    return draw(ANY) if draw(st.integers(0, 3)) == 0 else sound


def bodies(sound: dict[str, Any]) -> st.SearchStrategy[bytes]:
    """JSON of the right and of any other form, deep nesting, other encodings, and bytes that are no JSON."""
    asked = st.one_of(changed(sound), ANY).map(lambda body: json.dumps(body).encode())
    nested = st.builds(lambda n, end: b'{"note":' * n + b"1" + b"}" * end, st.integers(1, 1200), st.integers(0, 1200))
    other = st.builds(
        lambda body, code: json.dumps(body).encode(code), changed(sound), st.sampled_from(["utf-16", "utf-32"])
    )
    return st.one_of(asked, asked, asked, nested, other, st.binary(max_size=100), st.just(b'{"note": "\xff"}'))


TYPES = st.sampled_from(["application/json"] * 8 + ["text/plain", "", "application/json; charset=utf-16", "a/b; c=\\"])


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A gateway with every part that takes a body."""
    folder = tmp_path_factory.mktemp("fuzz")
    with Gateway(folder / "web", learner=LearnerBench(folder).learner) as gateway:
        yield Client(gateway.app)


def routes_with_bodies(client: Client) -> set[str]:
    paths = client.app.openapi()["paths"]
    return {path for path, known in paths.items() for one in known.values() if "requestBody" in one}


def test_every_route_with_a_body_is_tried(client: Client) -> None:
    assert routes_with_bodies(client) == set(SOUND)


@pytest.mark.parametrize("route", SOUND)
def test_any_body_is_answered_or_refused_in_words(client: Client, route: str, caplog: pytest.LogCaptureFixture) -> None:
    codes: set[int] = set()
    method, sound = SOUND[route]

    @MANY
    @given(body=bodies(sound), kind=TYPES)
    def ask(body: bytes, kind: str) -> None:
        begun_s = time.monotonic()
        answer = client.request(method, route, content=body, headers={"content-type": kind} if kind else {})
        assert time.monotonic() - begun_s < SLOWEST_S
        assert answer.status_code < 500, answer.text
        told = answer.json()
        if answer.status_code >= 400:
            assert told["status"] == answer.status_code
            assert told["detail"]
        codes.add(answer.status_code)

    with caplog.at_level(logging.ERROR):
        ask()
    assert caplog.records == []
    assert 422 in codes
    is_short = not route.endswith("/sister")  # a whole calibration file is too long to be spoiled this often
    assert codes & {200, 201, 409} or not is_short, "no sound body came through"
