"""No channel sends anything without a permission that holds at this moment."""

import threading
from collections.abc import Callable
from itertools import count
from pathlib import Path

import httpx
import pytest
from support.estimates import make_record
from support.patience import PATIENCE_S, wait_until
from support.web import Client, Gateway, serving

from gateway.config.permission import Encryption, Holder, Kind, may_leave
from gateway.config.sections import UplinkSection, WebhookSection
from gateway.errors import ConfigurationError
from gateway.fleet import Book, fleet_app
from gateway.web.access.serving import refuse_open_address
from gateway.web.access.tokens import Scope, Token, TokenFile
from gateway.web.live import stream

WHOLE, BARE, NOTHING = "record and position", "record", "nothing"
RULE = {  # what leaves without [position] forward, and with it
    (Encryption.LOCAL, Holder.NOBODY): (NOTHING, NOTHING),
    (Encryption.LOCAL, Holder.MACHINE): (WHOLE, WHOLE),
    (Encryption.LOCAL, Holder.NAMED): (BARE, WHOLE),
    (Encryption.LOCAL, Holder.READ): (BARE, WHOLE),
    (Encryption.LOCAL, Holder.OPERATE): (WHOLE, WHOLE),
    (Encryption.TLS, Holder.NOBODY): (NOTHING, NOTHING),
    (Encryption.TLS, Holder.MACHINE): (NOTHING, NOTHING),
    (Encryption.TLS, Holder.NAMED): (BARE, WHOLE),
    (Encryption.TLS, Holder.READ): (BARE, WHOLE),
    (Encryption.TLS, Holder.OPERATE): (WHOLE, WHOLE),
    **{(Encryption.NONE, holder): (NOTHING, NOTHING) for holder in Holder},
}


@pytest.mark.parametrize(("encryption", "holder"), [(way, holder) for way in Encryption for holder in Holder])
def test_the_rule_has_an_answer_for_every_way_and_everybody(encryption: Encryption, holder: Holder) -> None:
    for forward, expected in zip((False, True), RULE[encryption, holder], strict=True):
        leaves = [may_leave(kind, encryption, holder, forward=forward) for kind in Kind]
        assert leaves == {WHOLE: [True, True], BARE: [True, False], NOTHING: [False, False]}[expected]


SECRET = Path("secret")
CHANNELS: dict[str, Callable[[str, bool], object]] = {  # the setting of each channel, by host and with TLS or without
    "uplink": lambda host, tls: UplinkSection(host=host, tls=tls),
    "webhook": lambda host, tls: WebhookSection(url=f"http{'s' * tls}://{host}/", secret_file=SECRET),
    "web": lambda host, tls: refuse_open_address(host, has_tokens=True, has_tls=tls),
}


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("host", ["fleet.example", "192.168.1.7", "0.0.0.0"])
def test_no_channel_is_configured_to_leave_this_machine_in_the_clear(channel: str, host: str) -> None:
    with pytest.raises((ValueError, ConfigurationError)):
        CHANNELS[channel](host, False)
    CHANNELS[channel](host, True)


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "127.8.9.1"])
def test_on_this_machine_every_channel_may_be_plain(channel: str, host: str) -> None:
    CHANNELS[channel](host, False)


def lines_until_closed(url: str, token: str | None, heard: list[str]) -> None:
    headers = {"authorization": f"Bearer {token}"} if token else {}
    with httpx.stream("GET", f"{url}/api/v1/stream", headers=headers, timeout=PATIENCE_S) as answer:
        heard.extend(answer.iter_lines())


@pytest.mark.parametrize("how", ["revoked", "opened before the first token", "idle and revoked"])
def test_an_open_stream_ends_with_the_permission(how: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It went on until the client closed it."""
    monkeypatch.setattr(stream, "ASK_AGAIN_S", 0.05 if "idle" in how else PATIENCE_S)
    tokens, heard = TokenFile(tmp_path / "tokens.json"), list[str]()
    token = tokens.create("reader", Scope.READ) if "revoked" in how else None
    with Gateway(tmp_path / "store", tokens=tokens) as gateway, serving(gateway.app) as server:
        reading = threading.Thread(target=lines_until_closed, args=(server.url, token, heard))
        reading.start()
        assert wait_until(lambda: gateway.board.fanout.n_subscribers == 1)
        gateway.store.write_estimate(make_record(0))
        assert wait_until(lambda: "event: estimate" in heard)
        tokens.create("another", Scope.OPERATE)
        if token:
            tokens.revoke("reader")
        if "idle" not in how:
            gateway.store.write_estimate(make_record(1))
        reading.join(PATIENCE_S)
        assert not reading.is_alive()
        assert [line for line in heard if line.startswith("event")] == ["event: estimate", "event: closing"]


def test_a_long_answer_ends_with_the_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    token = tokens.create("reader", Scope.READ)
    verify, n_asked = tokens.verify, count()

    def verify_a_hundred_times(text: str) -> Token | None:
        return verify(text) if next(n_asked) < 100 else None

    monkeypatch.setattr(tokens, "verify", verify_a_hundred_times)
    heard: list[str] = []
    with Gateway(tmp_path / "store", tokens=tokens) as gateway, serving(gateway.app) as server:
        for n in range(300):
            gateway.store.write_estimate(make_record(n))
        assert gateway.store.flush(PATIENCE_S)
        headers = {"authorization": f"Bearer {token}"}
        url = f"{server.url}/api/v1/export.csv"
        with (
            pytest.raises(httpx.RemoteProtocolError),
            httpx.stream("GET", url, headers=headers, timeout=PATIENCE_S) as answer,
        ):
            heard.extend(line for line in answer.iter_lines())
    assert len(heard) <= 100


@pytest.mark.parametrize(
    ("host", "code"),
    [
        *((host, 200) for host in ("localhost:8080", "127.0.0.1", "[::1]:8080", "fleet.example", "FLEET.example:443")),
        *((host, 421) for host in ("evil.example", "evil.example:localhost", "fleet.example.evil.example", "")),
    ],
)
def test_the_fleet_page_answers_under_its_own_names_alone(host: str, code: int, tmp_path: Path) -> None:
    """A page from elsewhere could read the fleet by a name of its own that leads to this machine (DNS rebinding)."""
    book = Book(str(tmp_path / "fleet.sqlite"))
    app = fleet_app(book, names=["Fleet.example"])
    assert Client(app).get("/api/v1/fleet", headers={"Host": host}).status_code == code
    book.close()
