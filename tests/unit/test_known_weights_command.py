"""springscale calibration tare and ticket: whom they ask, and what they say where nobody answers as wanted."""

import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest
import trustme
from click.testing import CliRunner, Result
from support.commands import called
from support.known_weights import FakePipeline, KnownWeightBench
from support.web import Gateway, serving

from gateway.cli.calibration import calibration as calibration_commands
from gateway.errors import ConfigurationError, SpringscaleError
from gateway.web.access.serving import Tls, server_config
from gateway.web.access.tokens import Scope, TokenFile


def run(*arguments: str, **environment: str) -> Result:
    return CliRunner(env=environment).invoke(calibration_commands, ["tare", *arguments])


def ticket(*arguments: str, **environment: str) -> Result:
    return CliRunner(env=environment).invoke(calibration_commands, ["ticket", *arguments])


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[KnownWeightBench]:
    made = KnownWeightBench(tmp_path / "vehicle", 276.0, 398.0)
    yield made
    made.store.close()


@pytest.fixture
def pipeline(bench: KnownWeightBench) -> FakePipeline:
    return bench.pipeline


@pytest.fixture
def tokens(tmp_path: Path) -> TokenFile:
    return TokenFile(tmp_path / "tokens.json")


@pytest.fixture
def url(tmp_path: Path, tokens: TokenFile, bench: KnownWeightBench) -> Iterator[str]:
    """A service behind tokens."""
    tokens.create("somebody", Scope.READ)
    with (
        Gateway(tmp_path / "store", tokens=tokens, known_weights=bench.service) as gateway,
        serving(gateway.app) as server,
    ):
        yield server.url


def test_set_show_and_undo_with_a_token_from_the_environment(url: str, tokens: TokenFile) -> None:
    token = tokens.create("workshop", Scope.OPERATE)
    offer = run("show", "--url", url, "--token", token).output
    assert "no known weight is in use: weighed by the calibration alone" in offer
    assert "a tare now would be of 12.0 ± " in offer
    made = run("set", "--empty", "--note", "yard", "--url", url, SPRINGSCALE_TOKEN=token)
    assert made.exit_code == 0, made.exception
    assert "empty: 0.0 ± 19.6 kg known, 12.0 ± " in made.output
    assert "by workshop (yard)" in made.output
    shown = run("show", "--url", url + "/", "--token", token).output.splitlines()
    assert shown[0] == "one known weight in use; without them the estimates' error is +12.0 kg"
    assert shown[-1] == "  " + made.output.strip()
    undone = run("undo", "--url", url, "--token", token, "--json")
    assert json.loads(undone.output)["known_weights_id"] is None
    assert "withdrawn" in run("show", "--url", url, "--token", token).output


def test_a_ticket_is_added_confirmed_and_withdrawn(url: str, tokens: TokenFile, bench: KnownWeightBench) -> None:
    asked = ("--url", url, "--token", tokens.create("workshop", Scope.OPERATE))
    weight = f"payload_kg=400,at={bench.stated(0, 400.0).at}"
    made = ticket("add", weight, "--kind", "delivery_note", "--note", "no. 17", *asked)
    assert made.exit_code == 0, made.exception
    assert "delivery note: 400.0 ± 19.6 kg known, 276.0 ± " in made.output
    assert "not used, for it contradicts the estimate: `springscale calibration ticket confirm sha256:" in made.output
    entry_id = json.loads(ticket("show", "--json", *asked).output)["history"][0]["id"]
    assert isinstance(ticket("confirm", "sha256:none", *asked).exception, SpringscaleError)
    confirmed = ticket("confirm", entry_id[:19], *asked)
    assert "one known weight in use; without them the estimates' error is -124.0 kg" in confirmed.output
    assert "withdrawn" in ticket("withdraw", entry_id.removeprefix("sha256:")[:12], *asked).output
    refused = ticket("add", "payload_kg=1,at=2020-01-01T00:00:00Z", *asked).exception
    assert isinstance(refused, SpringscaleError)
    assert "no_epoch" in str(refused)


def test_an_empty_vehicle_that_contradicts_is_shown_and_withdrawn_as_a_ticket(
    url: str, tokens: TokenFile, pipeline: FakePipeline
) -> None:
    asked = ("--url", url, "--token", tokens.create("workshop", Scope.OPERATE))
    pipeline.weigh(276.0)
    assert "not used, for it contradicts the estimate" in run("set", "--empty", *asked).output
    shown = json.loads(ticket("show", "--json", *asked).output)["history"]
    assert [(one["kind"], one["state"]) for one in shown] == [("empty", "held")]
    assert "withdrawn" in ticket("withdraw", shown[0]["id"][:14], *asked).output


def test_a_refusal_comes_in_the_services_own_words(url: str, tokens: TokenFile, pipeline: FakePipeline) -> None:
    token = tokens.create("workshop", Scope.OPERATE)
    pipeline.age_s = 1000.0
    for arguments, said in (
        (("set", "--empty", "--url", url, "--token", token), "drive, empty, until the next batch has counted"),
        (("undo", "--url", url, "--token", token), "no_such_weight"),
        (("show", "--url", url), "a bearer token is needed"),
    ):
        fault = run(*arguments).exception
        assert isinstance(fault, SpringscaleError)
        assert fault.exit_code == 1
        assert said in str(fault)
    assert "no tare now (stale)" in run("show", "--url", url, "--token", token).output


@pytest.fixture
def mutual(tmp_path: Path) -> Iterator[str]:
    """A service that wants the certificate of its clients; authority, certificate and key lie beside it."""
    authority = trustme.CA()
    authority.cert_pem.write_to_path(str(tmp_path / "ca.pem"))
    for name, host in (("server", "localhost"), ("client", "workshop.example")):
        issued = authority.issue_cert(host)
        issued.cert_chain_pems[0].write_to_path(str(tmp_path / f"{name}.pem"))
        issued.private_key_pem.write_to_path(str(tmp_path / f"{name}.key"))
        issued.private_key_and_cert_chain_pem.write_to_path(str(tmp_path / f"{name}-whole.pem"))
    tls = Tls(tmp_path / "server.pem", tmp_path / "server.key", client_ca=tmp_path / "ca.pem")
    with Gateway(tmp_path / "store") as gateway:
        config = server_config(gateway.app, "127.0.0.1", 0, tls)
        with serving(gateway.app, config) as server:
            yield server.url.replace("http://127.0.0.1", "https://localhost")


def test_a_service_that_asks_for_a_certificate_is_shown_one(mutual: str, tmp_path: Path) -> None:
    asked = ("show", "--url", mutual, "--ca", str(tmp_path / "ca.pem"))
    pem = {name: str(tmp_path / name) for name in ("client.pem", "client.key", "client-whole.pem", "server.key")}
    assert isinstance(run(*asked).exception, SpringscaleError)
    for shown in (
        ("--certificate", pem["client.pem"], "--key", pem["client.key"]),
        ("--certificate", pem["client-whole.pem"]),
    ):
        assert "no known weight is in use" in run(*asked, *shown).output
    fault = run(*asked, "--certificate", pem["client.pem"], "--key", pem["server.key"]).exception
    assert isinstance(fault, ConfigurationError)
    assert "client.pem: no certificate with its key" in str(fault)
    assert run(*asked, "--key", pem["client.key"]).exit_code == 2


def test_where_nobody_answers_that_is_said() -> None:
    fault = run("show", "--url", "http://127.0.0.1:1").exception
    assert isinstance(fault, SpringscaleError)
    assert "http://127.0.0.1:1/api/v1/calibration/tare: cannot reach the service" in str(fault)
    assert "nothing is listening" in str(fault)


@pytest.mark.parametrize(
    "arguments",
    [
        ("set", "--url", "http://127.0.0.1:1"),
        ("show",),
        ("show", "--url", "127.0.0.1:8000"),
        ("show", "--url", "http://127.0.0.1:1", "--config", "x.toml"),
    ],
)
def test_a_wrong_use_ends_with_code_2(arguments: tuple[str, ...]) -> None:
    assert run(*arguments).exit_code == 2


@pytest.mark.parametrize(
    ("web", "address"),
    [
        ('host = "0.0.0.0"\nport = 1', "http://127.0.0.1:1/api"),
        ('host = "::1"\nport = 1', "http://[::1]:1/api"),
        ('port = 1\ntls_certificate = "a.pem"\ntls_key = "a.key"', "https://127.0.0.1:1/api"),
    ],
)
def test_the_configuration_says_where_the_service_is(tmp_path: Path, web: str, address: str) -> None:
    path = tmp_path / "springscale.toml"
    path.write_text(f'signals = "springscale:reference"\n[web]\n{web}\n')
    fault = run("show", "--config", str(path)).exception
    assert isinstance(fault, SpringscaleError)
    assert address in str(fault)


def test_port_0_and_a_wrong_authority_are_configuration_errors(tmp_path: Path) -> None:
    path = tmp_path / "springscale.toml"
    path.write_text('signals = "springscale:reference"\n[web]\nport = 0\n')
    for arguments, said in (
        (("--config", str(path)), "names no port"),
        (("--url", "https://127.0.0.1:1", "--ca", str(path)), "no certificate of an authority"),
    ):
        fault = run("show", *arguments).exception
        assert isinstance(fault, ConfigurationError)
        assert said in str(fault)


class ProxyPage(BaseHTTPRequestHandler):
    """A proxy's own page in place of the service's answer."""

    def do_GET(self) -> None:
        page = b"<html><body>Log in</body></html>"
        self.send_response(200)
        self.send_header("content-type", "text/html")
        self.send_header("content-length", str(len(page)))
        self.end_headers()
        self.wfile.write(page)

    def log_message(self, *_: object) -> None:
        pass


def test_a_page_in_place_of_an_answer_is_said_to_be_one() -> None:
    """It was called `cannot reach the service: Expecting value`."""
    with HTTPServer(("127.0.0.1", 0), ProxyPage) as server:
        threading.Thread(target=server.handle_request, daemon=True).start()
        told = called("calibration", "tare", "show", "--url", f"http://127.0.0.1:{server.server_port}")
    assert "answered with text/html in place of JSON" in str(told.exception)
