"""deploy/traccar/feeder.py from a real service into a fake that parses as Traccar's OsmAnd decoder does."""

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest
from support.estimates import make_estimate
from support.patience import wait_until
from support.ports import free_port
from support.web import Gateway, serving

from gateway.estimates.batch_estimate import Weight, Weights
from gateway.records import Why

ROOT = Path(__file__).parents[2]
DEVICE = "356307042441013"
# What OsmAndProtocolDecoder takes for itself; every other parameter becomes an attribute of the position.
OWN = {"id", "deviceid", "valid", "timestamp", "lat", "lon", "location", "cell", "wifi", "speed", "bearing", "heading"}
OWN |= {"altitude", "accuracy", "hdop", "batt", "driverUniqueId", "charge"}


@dataclass
class Position:
    """A position as Traccar keeps it."""

    time_s: int
    attributes: dict[str, Any]


@dataclass
class Traccar:
    """OsmAndProtocolDecoder of Traccar 5: parameters of the query, numbers as numbers, 400 for unknown devices."""

    port: int
    devices: set[str] = field(default_factory=lambda: {DEVICE})
    positions: list[Position] = field(default_factory=list)
    n_refused: int = 0
    is_failing: bool = False

    def decode(self, uri: str) -> int:
        params = parse_qs(urlsplit(uri).query, keep_blank_values=True)
        if self.is_failing:
            return 503
        if not self.devices & {*params.get("id", ()), *params.get("deviceid", ())}:
            self.n_refused += 1
            return 400
        timestamp = int(params["timestamp"][0])
        assert timestamp < 2**31 - 1  # else Traccar takes it for milliseconds
        attributes = {name: _attribute(texts[-1]) for name, texts in params.items() if name not in OWN}
        self.positions.append(Position(timestamp, attributes))
        return 200


def _attribute(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return {"true": True, "false": False}.get(text, text)


@contextmanager
def traccar(port: int | None = None) -> Iterator[Traccar]:
    fake = Traccar(port or free_port())

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            self.send_response(fake.decode(self.path))
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: Any) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", fake.port), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield fake
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextmanager
def feeding(url: str, port: int, folder: Path) -> Iterator[None]:
    command = [
        sys.executable,
        ROOT / "deploy/traccar/feeder.py",
        url,
        f"http://127.0.0.1:{port}",
        DEVICE,
        folder,
        "0.1",
    ]
    with (folder / "log").open("ab") as said, subprocess.Popen(command, stderr=said) as feeder:
        try:
            yield
        finally:
            feeder.terminate()


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    with Gateway(tmp_path / "state") as opened:
        yield opened


def test_weights_become_attributes_and_what_is_unknown_is_left_out(tmp_path: Path, gateway: Gateway) -> None:
    weights = Weights(
        gross=Weight(2600.4, 8.0, 2500.0, None),
        front_axle=Weight(1200.2, 6.0, None, None),
        rear_axle=Weight(1400.2, 6.0, None, None),
    )
    heavy = replace(make_estimate(1), weights=weights)
    refused = replace(make_estimate(2), rejected=(Why.TOO_SLOW,))
    with traccar() as fake, serving(gateway.app) as service:
        gateway.publish(make_estimate(0), heavy, refused, make_estimate(3))
        with feeding(service.url, fake.port, tmp_path):
            assert wait_until(lambda: len(fake.positions) == 3)
    plain, over, _ = fake.positions
    assert plain.attributes["payload"] == 100.0
    assert not {"alarm", "grossWeight", "overload"} & set(plain.attributes)  # no weight on the road is known
    assert over.attributes["grossWeight"] == 2600.4
    assert (over.attributes["axleWeight1"], over.attributes["axleWeight2"]) == (1200.2, 1400.2)
    assert (over.attributes["alarm"], over.attributes["overload"]) == ("general", "grossWeight")
    assert over.time_s == heavy.t_end_ns // 1_000_000_000


def test_what_was_weighed_while_traccar_was_away_arrives_once_and_in_order(tmp_path: Path, gateway: Gateway) -> None:
    port = free_port()
    with serving(gateway.app) as service:
        with feeding(service.url, port, tmp_path):
            gateway.publish(*(make_estimate(n) for n in range(5)))
            assert wait_until(lambda: (tmp_path / "log").read_text() != "")
            with traccar(port) as fake:
                assert wait_until(lambda: len(fake.positions) == 5)
                fake.is_failing = True
                gateway.publish(*(make_estimate(n) for n in range(5, 8)))
                assert wait_until(lambda: "503" in (tmp_path / "log").read_text())
                fake.is_failing = False
                assert wait_until(lambda: len(fake.positions) == 8)
                payloads = [position.attributes["payload"] for position in fake.positions]
                newest = httpx.get(f"{service.url}/api/v1/estimates").json()["last_cursor"]
                assert wait_until(lambda: (tmp_path / "place").read_text() == newest)
        with traccar(port) as again, feeding(service.url, port, tmp_path):  # restarted: the place is kept
            gateway.publish(make_estimate(8))
            assert wait_until(lambda: len(again.positions) >= 1)
            assert [position.attributes["payload"] for position in again.positions] == [108.0]
    assert payloads == [100.0 + n for n in range(8)]


def test_a_device_that_traccar_does_not_know_is_named_and_nothing_is_lost(tmp_path: Path, gateway: Gateway) -> None:
    with traccar() as fake, serving(gateway.app) as service:
        fake.devices = set()
        gateway.publish(make_estimate(0))
        with feeding(service.url, fake.port, tmp_path):
            assert wait_until(lambda: f"does not know the device {DEVICE}" in (tmp_path / "log").read_text())
            fake.devices = {DEVICE}
            assert wait_until(lambda: len(fake.positions) == 1)
