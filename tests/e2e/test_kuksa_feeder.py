"""deploy/kuksa/feeder.py from a real service into a small databroker, made of the stubs that its client comes with."""

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

import grpc
import pytest
import yaml
from kuksa.val.v1 import types_pb2 as types_v1
from kuksa.val.v1 import val_pb2 as v1
from kuksa.val.v1 import val_pb2_grpc as v1_grpc
from kuksa.val.v2 import val_pb2 as v2
from kuksa.val.v2 import val_pb2_grpc as v2_grpc
from support.estimates import make_estimate
from support.patience import PATIENCE_S, wait_until
from support.ports import free_port
from support.web import Gateway, serving

ROOT = Path(__file__).parents[2]
OVERLAY = {
    path: node
    for path, node in yaml.safe_load((ROOT / "docs/vss/springscale.vspec").read_text()).items()
    if node["type"] != "branch"
}
CORE = ("Vehicle.CurrentOverallWeight", "Vehicle.CurbWeight", "Vehicle.GrossWeight")
PAYLOAD = "Vehicle.Load.Payload"


class Metadata(v1_grpc.VALServicer):
    """kuksa.val.v1, which the client asks for the types of paths: 404 for those that nobody loaded."""

    def __init__(self, paths: list[str]) -> None:
        self._paths = paths

    def Get(self, request: Any, _context: Any) -> Any:
        answer = v1.GetResponse()
        for asked in request.entries:
            if asked.path not in self._paths:
                answer.error.CopyFrom(types_v1.Error(code=404, reason="not_found"))
                return answer
            kind = "DATA_TYPE_UINT16" if asked.path in CORE else "DATA_TYPE_FLOAT"
            metadata = types_v1.Metadata(data_type=types_v1.DataType.Value(kind))
            answer.entries.append(types_v1.DataEntry(path=asked.path, metadata=metadata))
        return answer

    def GetServerInfo(self, _request: Any, _context: Any) -> Any:
        return v1.GetServerInfoResponse(name="databroker", version="0.0.0")


class Databroker(v2_grpc.VALServicer):
    """kuksa.val.v2, which takes values; ``now`` has what it would tell a reader, None for not available."""

    def __init__(self, port: int, paths: list[str]) -> None:
        self.port = port
        self.now: dict[str, float | int | None] = {}
        self.published: list[tuple[str, float | int | None]] = []
        self.refused: list[str] = []
        self.narrowed: dict[str, float] = {}  # greatest values of an integrator's own specification
        self._metadata = Metadata(paths)
        self.start()

    def start(self) -> None:
        self._server = grpc.server(ThreadPoolExecutor(2))
        v1_grpc.add_VALServicer_to_server(self._metadata, self._server)
        v2_grpc.add_VALServicer_to_server(self, self._server)
        assert self._server.add_insecure_port(f"127.0.0.1:{self.port}") == self.port
        self._server.start()

    def stop(self) -> None:
        self._server.stop(None).wait()
        self.now = {}

    @property
    def known(self) -> set[str]:
        return {path for path, value in self.now.copy().items() if value is not None}

    def PublishValue(self, request: Any, context: Any) -> Any:
        """As the databroker's source has it (databroker/src/broker.rs, validate): not available is always valid; else
        the type must be the signal's, and the value within its type and within min and max of its specification.
        """
        path, told = request.signal_id.path, request.data_point.value
        kind = told.WhichOneof("typed_value")
        if kind is not None:
            fault = _refusal(path, kind, getattr(told, kind), self.narrowed.get(path, math.inf))
            if fault is not None:
                self.refused.append(path)
                context.abort(grpc.StatusCode.INVALID_ARGUMENT, fault)
        value = getattr(told, kind) if kind else None
        self.published.append((path, value))
        self.now[path] = value
        return v2.PublishValueResponse()


def _refusal(path: str, kind: str, value: float, most: float) -> str | None:
    """Why a value of this protobuf type is not taken; None where it is."""
    if value > most:
        return "Value out of min/max bounds"
    if kind != ("uint32" if path in CORE else "float"):
        return "Wrong Type"
    if path in CORE:
        return None if 0 <= value <= 0xFFFF else "Value out of bounds of its type"
    node = OVERLAY[path]
    is_within = node.get("min", value) <= value <= node.get("max", value)
    return None if is_within else "Value out of min/max bounds"


@contextmanager
def databroker(paths: list[str]) -> Iterator[Databroker]:
    broker = Databroker(free_port(), paths)
    try:
        yield broker
    finally:
        broker.stop()


@contextmanager
def feeding(url: str, port: int, log: Path) -> Iterator["subprocess.Popen[bytes]"]:
    options = ["--url", url, "--databroker", f"127.0.0.1:{port}", "--every-s", "0.1"]
    with log.open("wb") as said:
        feeder = subprocess.Popen([sys.executable, ROOT / "deploy/kuksa/feeder.py", *options], stderr=said)
    try:
        yield feeder
    finally:
        feeder.terminate()
        assert feeder.wait(PATIENCE_S) == 0, log.read_text()


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    with Gateway(tmp_path / "state") as opened:
        yield opened


def test_weights_reach_the_databroker_and_what_is_old_becomes_not_available(tmp_path: Path, gateway: Gateway) -> None:
    with (
        databroker([*CORE, *OVERLAY]) as broker,
        serving(gateway.app) as service,
        feeding(service.url, broker.port, tmp_path / "log"),
    ):
        assert wait_until(lambda: broker.now.get(PAYLOAD, 0) is None)  # nothing was weighed yet
        gateway.publish(make_estimate(3))
        assert wait_until(lambda: broker.now[PAYLOAD] == 103.0)
        assert set(broker.now) == {*CORE, *OVERLAY}
        gateway.clock_s += 3600.0
        assert wait_until(lambda: broker.now[PAYLOAD] is None)
        time.sleep(0.5)  # some more rounds
    payloads = [value for path, value in broker.published if path == PAYLOAD]
    assert [value for value, _ in groupby(payloads)] == [None, 103.0, None]  # unknown, known, too old
    # Only news is published. A weight may come between the feeder's two questions: then it has a time before a value.
    assert len(payloads) <= 4
    assert [path for path, _ in broker.published].count("Vehicle.CurbWeight") == 1  # which does not age
    assert (tmp_path / "log").read_text() == ""


def test_a_databroker_that_comes_back_is_told_all_again(tmp_path: Path, gateway: Gateway) -> None:
    gateway.publish(make_estimate(3))
    with (
        databroker([*CORE, *OVERLAY]) as broker,
        serving(gateway.app) as service,
        feeding(service.url, broker.port, tmp_path / "log"),
    ):
        assert wait_until(lambda: broker.now.get(PAYLOAD) == 103.0)
        broker.stop()
        gateway.publish(make_estimate(4))
        assert wait_until(lambda: str(broker.port) in (tmp_path / "log").read_text())
        broker.start()
        assert wait_until(lambda: broker.now.get(PAYLOAD) == 104.0)


def test_without_the_overlay_the_core_is_fed_and_the_rest_is_told_once(tmp_path: Path, gateway: Gateway) -> None:
    gateway.publish(make_estimate(3))
    with (
        databroker([*CORE]) as broker,
        serving(gateway.app) as service,
        feeding(service.url, broker.port, tmp_path / "log"),
    ):
        assert wait_until(lambda: set(broker.now) == set(CORE))
        gateway.publish(make_estimate(4))
    (line,) = (tmp_path / "log").read_text().splitlines()
    assert PAYLOAD in line
    assert "load docs/vss/springscale.vspec" in line
    assert not any(path in line for path in CORE)


def test_a_service_that_goes_away_leaves_nothing_that_looks_known(tmp_path: Path, gateway: Gateway) -> None:
    gateway.publish(make_estimate(3))
    with (
        databroker([*CORE, *OVERLAY]) as broker,
        serving(gateway.app) as service,
        feeding(service.url, broker.port, tmp_path / "log"),
    ):
        assert wait_until(lambda: broker.now.get(PAYLOAD) == 103.0)
        service.uvicorn.should_exit = True
        assert wait_until(lambda: broker.now[PAYLOAD] is None)
    assert "does not answer" in (tmp_path / "log").read_text()


def test_a_value_that_the_databroker_refuses_holds_nothing_else_up(tmp_path: Path, gateway: Gateway) -> None:
    """An integrator's specification may be narrower than ours: told, not available there, and the rest goes on."""
    with (
        databroker([*CORE, *OVERLAY]) as broker,
        serving(gateway.app) as service,
        feeding(service.url, broker.port, tmp_path / "log"),
    ):
        broker.narrowed = {PAYLOAD: 103.5}
        gateway.publish(make_estimate(3))
        assert wait_until(lambda: broker.now.get(PAYLOAD) == 103.0)
        assert wait_until(lambda: len(broker.known) > 1)  # what is published after it, in the same round
        known = broker.known
        gateway.publish(make_estimate(4))
        assert wait_until(lambda: PAYLOAD in broker.refused)
        assert wait_until(lambda: broker.now[PAYLOAD] is None)  # and not the 103 kg of before
        assert wait_until(lambda: known - {PAYLOAD} <= broker.known)
    assert f"refuses {PAYLOAD} = 104" in (tmp_path / "log").read_text()


def test_every_signal_keeps_to_its_type_and_bounds(tmp_path: Path, gateway: Gateway) -> None:
    """A payload below 0 is an estimate like any other: the overlay must allow it."""
    with (
        databroker([*CORE, *OVERLAY]) as broker,
        serving(gateway.app) as service,
        feeding(service.url, broker.port, tmp_path / "log"),
    ):
        light = make_estimate(3)
        payload = replace(light.payload, number=-12.0, interval95=(-24.0, 0.0))
        gateway.publish(replace(light, payload=payload))
        assert wait_until(lambda: broker.now.get(PAYLOAD) == -12.0)
        gateway.publish(make_estimate(4))
        assert wait_until(lambda: broker.now[PAYLOAD] == 104.0)  # by now the round before has told all it had
    assert broker.refused == []
