"""Who is answered and who is not, and what the refusal tells."""

import logging
import ssl
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
import trustme
from support.patience import PATIENCE_S
from support.web import Client, Gateway, serving

from gateway.config.permission import is_loopback
from gateway.errors import ConfigurationError
from gateway.web.access.serving import Tls, refuse_open_address, server_config
from gateway.web.access.tokens import Scope, TokenFile

GUARDED = ["/api/v1/estimates/latest", "/api/v1/estimates", "/api/v1/status", "/api/v1/stream", "/metrics"]
GUARDED += ["/api/v1/vehicle", "/api/v1/export.csv", "/health/ready", "/api/v1/vss", "/api/v1/reasons", "/api/v1/cab"]
OF_NO_ROUTE = ["/nothing", "/api/v1/estimates/latest/", "/assets", "/assetsx/../api/v1/status", "/health/live/../ready"]
OF_NO_ROUTE += [
    "/assets/../api/v1/status",
    "/assets/%2e%2e/api/v1/status",
    "/assets//../../app.py",
    "/swagger/..%2fcore.py",
]


@pytest.fixture
def tokens(tmp_path: Path) -> TokenFile:
    found = TokenFile(tmp_path / "tokens.json")
    found.create("somebody", Scope.READ)  # from the first token on they are asked for
    return found


@pytest.fixture
def gateway(tmp_path: Path, tokens: TokenFile) -> Iterator[Gateway]:
    with Gateway(tmp_path / "store", tokens=tokens) as opened:
        yield opened


def bearer(text: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {text}"}


@pytest.mark.parametrize("path", GUARDED)
def test_without_a_token_nothing_is_answered(client: Client, path: str) -> None:
    answer = client.get(path)
    assert answer.status_code == 401
    assert answer.headers["www-authenticate"] == 'Bearer realm="springscale"'
    assert answer.headers["content-type"] == "application/problem+json"
    assert "payload" not in answer.text


@pytest.mark.parametrize("path", OF_NO_ROUTE)
def test_an_unknown_address_or_one_beside_a_public_folder_reveals_nothing(client: Client, path: str) -> None:
    assert client.get(path).status_code in (401, 404)


@pytest.mark.parametrize(
    "path", ["/", "/engineer", "/cab", "/docs", "/openapi.json", "/health/live", "/assets/dashboard/main.js"]
)
def test_routes_that_reveal_nothing_are_public(client: Client, path: str) -> None:
    assert client.get(path).status_code == 200


def test_a_token_opens_what_its_scope_allows(client: Client, tokens: TokenFile) -> None:
    reader, operator = tokens.create("reader", Scope.READ), tokens.create("operator", Scope.OPERATE)
    for text in (reader, operator):
        assert client.get("/api/v1/estimates/latest", headers=bearer(text)).status_code == 200
        assert client.get("/api/v1/status", headers={"authorization": f"bearer  {text} "}).status_code == 200
    undo = "/api/v1/learning"
    refused = client.request("PUT", undo, headers=bearer(reader))
    assert refused.status_code == 403
    assert 'scope="operate"' in refused.headers["www-authenticate"]
    allowed = client.request("PUT", undo, headers=bearer(operator))
    assert "www-authenticate" not in allowed.headers


@pytest.mark.parametrize(
    "shown", ["", "Bearer", "Bearer ", "Basic dXNlcjpwYXNz", "Bearer spr_x_y", "spr", "Bearer \xff"]
)
def test_garbled_credentials_are_refused(client: Client, tokens: TokenFile, shown: str) -> None:
    tokens.create("reader", Scope.READ)
    headers = [(b"authorization", shown.encode("latin-1"))]
    answer = client.get("/api/v1/status", headers=headers)
    assert answer.status_code == 401
    assert 'error="invalid_token"' in answer.headers["www-authenticate"]


def test_a_token_in_the_address_does_not_count(client: Client, tokens: TokenFile) -> None:
    text = tokens.create("reader", Scope.READ)
    assert client.get(f"/api/v1/status?access_token={text}").status_code == 401


def test_no_secret_reaches_the_log(
    client: Client, tokens: TokenFile, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    caplog.set_level(logging.DEBUG)
    text = tokens.create("reader", Scope.READ)
    for shown in (text, text + "x"):
        client.get("/api/v1/status", headers=bearer(shown))
    written = caplog.text + "".join(capfd.readouterr())
    assert text.split("_", 2)[2] not in written


def test_other_origins_are_given_no_permission(client: Client, tokens: TokenFile) -> None:
    headers = bearer(tokens.create("reader", Scope.OPERATE)) | {"Origin": "https://elsewhere.example"}
    answer = client.get("/api/v1/status", headers=headers)
    preflight = client.request("OPTIONS", "/api/v1/status", headers=headers)
    assert preflight.status_code == 405
    for each in (answer, preflight):
        assert not [name for name in each.headers if name.startswith("access-control-")]
        assert each.headers["cross-origin-resource-policy"] == "same-origin"


LOCAL = ["localhost:8000", "127.0.0.1:1", "[::1]:8000", "[::1]", "LOCALHOST"]
ELSEWHERE = ["evil.example", "localhost.evil.example:8000", "192.168.1.7:8000", "", "evil.example:localhost"]


@pytest.mark.parametrize(("host", "code"), [*((h, 200) for h in LOCAL), *((h, 421) for h in ELSEWHERE)])
def test_without_tokens_only_local_host_names_are_answered(tmp_path: Path, host: str, code: int) -> None:
    with Gateway(tmp_path) as gateway:
        assert Client(gateway.app).get("/api/v1/status", headers={"Host": host}).status_code == code


@pytest.mark.parametrize("name", ["Forwarded", "Via", "X-Forwarded-For", "X-Forwarded-Proto", "X-Real-IP"])
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_without_tokens_nobody_is_answered_through_a_proxy(tmp_path: Path, name: str, method: str) -> None:
    """To the service, all clients of a proxy on the same machine are that machine."""
    with Gateway(tmp_path) as gateway:
        answer = Client(gateway.app).request(method, "/api/v1/statements", headers={name: "203.0.113.7"})
        assert answer.status_code == 403


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.7", "::", "gateway.local", ""])
def test_an_open_address_needs_tokens_and_tls(host: str) -> None:
    assert not is_loopback(host)
    with pytest.raises(ConfigurationError, match="springscale token create"):
        refuse_open_address(host, has_tokens=False, has_tls=True)
    with pytest.raises(ConfigurationError, match="tls_certificate"):
        refuse_open_address(host, has_tokens=True, has_tls=False)
    refuse_open_address(host, has_tokens=True, has_tls=True)


def test_tls(tmp_path: Path) -> None:
    authority = trustme.CA()
    authority.cert_pem.write_to_path(str(tmp_path / "authority.pem"))
    issued = authority.issue_cert("localhost")
    issued.cert_chain_pems[0].write_to_path(str(tmp_path / "server.pem"))
    issued.private_key_pem.write_to_path(str(tmp_path / "server.key"))
    tls = Tls(tmp_path / "server.pem", tmp_path / "server.key")
    with (
        Gateway(tmp_path / "store") as gateway,
        serving(gateway.app, server_config(gateway.app, "127.0.0.1", 0, tls)) as server,
    ):
        address = server.url.replace("http://127.0.0.1", "https://localhost") + "/health/live"
        client_side = ssl.create_default_context(cafile=str(tmp_path / "authority.pem"))
        assert httpx.get(address, verify=client_side, timeout=PATIENCE_S).json() == {"is_alive": True}


def test_unusable_tls_files_are_reported(tmp_path: Path) -> None:
    (tmp_path / "server.pem").write_text("no certificate")
    with (
        Gateway(tmp_path / "store") as gateway,
        pytest.raises(ConfigurationError, match=r"server\.pem.*cannot be used"),
    ):
        server_config(gateway.app, "127.0.0.1", 0, Tls(tmp_path / "server.pem", tmp_path / "absent.pem"))


def test_the_first_token_counts_from_its_first_moment_on(tmp_path: Path) -> None:
    """It once did nothing until the service was started anew: open before, open after."""
    path, elsewhere = tmp_path / "tokens.json", TokenFile(tmp_path / "tokens.json")  # the command line's own
    with Gateway(tmp_path / "store", tokens=TokenFile(path)) as gateway:
        client = Client(gateway.app)
        assert client.get("/api/v1/status").status_code == 200
        text = elsewhere.create("reader", Scope.READ)
        assert client.get("/api/v1/status").status_code == 401
        assert client.get("/api/v1/status", headers=bearer(text)).status_code == 200
        elsewhere.revoke("reader")
        assert client.get("/api/v1/status").status_code == 200
        assert client.get("/api/v1/status", headers=bearer(text)).status_code == 200  # asked for none, shown one


def test_tokens_that_have_gone_with_their_file_leave_the_door_shut(tmp_path: Path) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    with Gateway(tmp_path / "store", tokens=tokens) as gateway:
        client = Client(gateway.app)
        tokens.create("reader", Scope.READ)
        assert client.get("/api/v1/status").status_code == 401
        (tmp_path / "tokens.json").unlink()
        assert client.get("/api/v1/status").status_code == 401
        assert "has gone while tokens were in use" in str(tokens.fault)
        text = tokens.create("reader", Scope.READ)
        assert client.get("/api/v1/status", headers=bearer(text)).status_code == 200


def test_a_stranger_is_refused_before_and_after_the_first_token(tmp_path: Path) -> None:
    tokens = TokenFile(tmp_path / "tokens.json")
    with Gateway(tmp_path / "store", tokens=tokens) as gateway:
        stranger = Client(gateway.app, address="192.0.2.7")
        assert stranger.get("/api/v1/status").status_code == 403
        text = tokens.create("reader", Scope.READ)
        assert stranger.get("/api/v1/status").status_code == 401
        assert stranger.get("https://localhost:8000/api/v1/status", headers=bearer(text)).status_code == 200
        assert stranger.get("/api/v1/status", headers=bearer(text)).status_code == 403  # it would cross in the clear
