"""The ring log over HTTP: who may, what is listed, and files whole and in pieces."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.bus_drive import START_NS, white_noise
from support.patience import PATIENCE_S
from support.web import Client, Gateway

from gateway.bus.ring import RingLimits, RingLog
from gateway.web.access.tokens import Scope, TokenFile

URL = "/api/v1/record"
LIMITS = RingLimits(max_bytes=10**9, max_daily_bytes=10**9, free_bytes=0, block_s=3600.0)


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> RingLog:
    """Two files of a drive each."""
    directory = tmp_path_factory.mktemp("record")
    for n in range(2):
        log = RingLog(directory, "can0", LIMITS)
        log.start()
        log.put(white_noise(20.0, START_NS + n * 3_600_000_000_000, seed=n))
        log.stop(PATIENCE_S)
    return log


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory, ring: RingLog) -> Iterator[Client]:
    with Gateway(tmp_path_factory.mktemp("store"), record=ring) as gateway:
        yield Client(gateway.app)


@pytest.fixture(scope="module")
def content(ring: RingLog) -> tuple[str, bytes]:
    """Name and bytes of the first file."""
    opened = ring.open(ring.segments()[0].name)
    with opened[0] as file:
        return ring.segments()[0].name, file.read()


def test_the_list_and_the_files_whole(client: Client, ring: RingLog, content: tuple[str, bytes]) -> None:
    items = client.get(URL).json()["items"]
    assert [item["name"] for item in items] == [segment.name for segment in ring.segments()]
    name, whole = content
    assert (items[0]["n_bytes"], items[0]["t_start"]) == (len(whole), "2026-09-21T14:13:20.000000Z")
    answer = client.get(f"{URL}/{name}")
    assert (answer.status_code, answer.content) == (200, whole)
    assert answer.headers["content-type"] == "application/gzip"
    assert answer.headers["accept-ranges"] == "bytes"
    assert answer.headers["cache-control"] == "no-store"
    assert f'filename="{name}"' in answer.headers["content-disposition"]


@settings(max_examples=60, deadline=None)
@given(first=st.integers(0, 80_000), last=st.none() | st.integers(0, 80_000))
def test_any_range_is_that_piece(client: Client, content: tuple[str, bytes], first: int, last: int | None) -> None:
    name, whole = content
    answer = client.get(f"{URL}/{name}", headers={"Range": f"bytes={first}-{'' if last is None else last}"})
    if last is not None and last < first:
        assert (answer.status_code, answer.content) == (200, whole)  # no range at all (RFC 9110, 14.1.1)
    elif first >= len(whole):
        assert (answer.status_code, answer.headers["content-range"]) == (416, f"bytes */{len(whole)}")
    else:
        piece = whole[first : None if last is None else last + 1]
        assert (answer.status_code, answer.content) == (206, piece)
        assert answer.headers["content-range"] == f"bytes {first}-{first + len(piece) - 1}/{len(whole)}"


@pytest.mark.parametrize(
    ("wanted", "status", "start"), [("bytes=-100", 206, -100), ("bytes=-999999", 206, 0), ("bytes=-0", 416, None)]
)
def test_the_last_bytes(
    client: Client, content: tuple[str, bytes], wanted: str, status: int, start: int | None
) -> None:
    name, whole = content
    answer = client.get(f"{URL}/{name}", headers={"Range": wanted})
    assert answer.status_code == status
    if start is not None:
        assert answer.content == whole[start:]


@pytest.mark.parametrize("wanted", ["bytes=0-1,5-6", "lines=0-1", "bytes=", "bytes=a-b", "bytes=-", "bytes=٣-٤"])
def test_a_range_that_is_not_understood_is_passed_over(client: Client, content: tuple[str, bytes], wanted: str) -> None:
    name, whole = content
    answer = client.get(f"{URL}/{name}", headers={"Range": wanted.encode()})
    assert (answer.status_code, answer.content) == (200, whole)


def test_a_range_if_it_is_still_the_same_file_is_the_whole(client: Client, content: tuple[str, bytes]) -> None:
    """No validator was ever given, so none can match (RFC 9110, 13.1.5)."""
    name, whole = content
    answer = client.get(f"{URL}/{name}", headers={"Range": "bytes=0-9", "If-Range": '"x"'})
    assert (answer.status_code, answer.content) == (200, whole)


def test_head_tells_the_size(client: Client, content: tuple[str, bytes]) -> None:
    name, whole = content
    answer = client.request("HEAD", f"{URL}/{name}")
    assert (answer.status_code, answer.content, answer.headers["content-length"]) == (200, b"", str(len(whole)))


@pytest.mark.parametrize(
    "name", ["springscale.db", "..", "%2e%2e%2fspringscale.db", "..%2F..%2Fetc%2Fpasswd", "%00", "x" * 64]
)
def test_no_other_file_is_to_be_had(client: Client, name: str) -> None:
    assert client.get(f"{URL}/{name}").status_code == 404


def test_a_disk_that_refuses_is_503(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ring: RingLog) -> None:
    def refuse(name: str) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(ring, "open", refuse)
    with Gateway(tmp_path, record=ring) as gateway:
        answer = Client(gateway.app).get(f"{URL}/{ring.segments()[0].name}")
    assert (answer.status_code, answer.headers["content-type"]) == (503, "application/problem+json")
    assert "Input/output error" in answer.json()["detail"]


def test_where_nothing_is_recorded_the_list_is_empty(tmp_path: Path) -> None:
    with Gateway(tmp_path) as gateway:
        client = Client(gateway.app)
        assert client.get(URL).json() == {"items": []}
        assert client.get(f"{URL}/00000001-20260922T000000Z.log.gz").status_code == 404


def test_a_token_that_may_only_read_weights_reads_no_frames(tmp_path: Path, ring: RingLog) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    reader, operator = (
        {"Authorization": f"Bearer {tokens.create(name, scope)}"}
        for name, scope in (("reader", Scope.READ), ("workshop", Scope.OPERATE))
    )
    with Gateway(tmp_path / "store", tokens=tokens, record=ring) as gateway:
        client = Client(gateway.app)
        for path in (URL, f"{URL}/", f"{URL}/{ring.segments()[0].name}"):
            for method in ("GET", "HEAD"):
                assert client.request(method, path).status_code == 401
                refused = client.request(method, path, headers=reader)
                assert refused.status_code == 403
                assert 'scope="operate"' in refused.headers["www-authenticate"]
        assert client.get(URL, headers=operator).status_code == 200
        assert client.get(f"{URL}/{ring.segments()[0].name}", headers=operator).status_code == 200
        assert client.get("/api/v1/status", headers=reader).status_code == 200
