"""The service never transmits on a bus: what it loads holds nothing that sends."""

import ast
import time
from pathlib import Path
from typing import Any

import pytest
from can.interfaces.virtual import VirtualBus
from support.calibrated import calibration_file
from support.running_service import configuration, serve

import gateway

SENDING = {"send", "sendall", "sendto", "sendmsg", "send_periodic"}
BUS = Path(gateway.__file__).parent / "bus"


def test_only_the_sink_calls_functions_that_send() -> None:
    senders = {
        path.relative_to(BUS)
        for path in BUS.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in SENDING
        if path.name != "feeder.py"  # a program of its own, which sends through the sink
    }
    assert senders == {Path("sink.py")}


def test_a_running_service_sends_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    sent: list[Any] = []
    monkeypatch.setattr(VirtualBus, "send", lambda _self, message, timeout=None: sent.append(message))
    config = configuration(tmp_path, calibration_file().to_json())
    serve(config, lambda running: time.sleep(0.5))
    assert sent == []
