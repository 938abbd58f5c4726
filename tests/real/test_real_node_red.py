"""A real Node-RED runs examples/node_red_alarm.json: an estimate over a limit becomes an alarm, once."""

import json
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from paho.mqtt import publish
from support.broker import Broker, Listener, needs_mosquitto, running_broker
from support.estimates import make_estimate
from support.parts import found, needs
from support.patience import wait_until
from support.ports import free_port

from gateway.config import VehicleSection
from gateway.config.sections import UplinkSection
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate, Weight, Weights
from gateway.records import Why
from gateway.store import Store
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import uplink_settings
from gateway.uplink.uplink import Uplink

pytestmark = [needs("node-red"), needs_mosquitto]

FLOW = Path(__file__).parents[2] / "examples/node_red_alarm.json"


def weighing(n: int, gross_kg: float) -> Estimate:
    estimate = make_estimate(n)
    weights = Weights(gross=Weight(gross_kg, 8.0, 2500.0, None))
    return replace(estimate, vehicle_id="van-17", weights=weights)


def wait_for_its_subscription(broker: Broker) -> None:
    """Waits for the broker's subscription: Node-RED says earlier that it is connected, and would miss messages."""
    told = json.dumps(estimate_to_json(replace(weighing(0, 2600.0), vehicle_id="probe")))
    listener = Listener(broker.port, "alarms/probe", "probe")

    def is_heard() -> bool:
        publish.single("springscale/probe/estimates", told, qos=1, port=broker.port)
        return bool(listener.heard)

    try:
        assert wait_until(is_heard)
    finally:
        listener.close()


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    with running_broker(tmp_path) as running:
        yield running


@pytest.fixture
def node_red(tmp_path: Path, broker: Broker) -> Iterator[None]:
    """The flow as it is, but for the broker's port."""
    program, port = found("node-red"), free_port()
    assert program is not None
    folder = tmp_path / "node-red"
    folder.mkdir()
    (folder / "flows.json").write_text(FLOW.read_text().replace('"1883"', f'"{broker.port}"'))
    settings = (
        "{ flowFile: 'flows.json', uiHost: '127.0.0.1', telemetry: { enabled: false, updateNotification: false } }"
    )
    (folder / "settings.js").write_text(f"module.exports = {settings}\n")
    log = folder / "log"
    with log.open("wb") as said:
        command = [program, "--userDir", str(folder), "--settings", str(folder / "settings.js"), "--port", str(port)]
        process = subprocess.Popen(command, stdout=said, stderr=said)
    try:
        assert wait_until(lambda: "Connected to broker" in log.read_text(errors="replace")), log.read_text()
        wait_for_its_subscription(broker)
        yield
    finally:
        process.terminate()
        process.wait(60)


def test_an_overload_raises_one_alarm_until_it_is_over(tmp_path: Path, broker: Broker, node_red: None) -> None:
    section = UplinkSection(host="127.0.0.1", port=broker.port, tls=False)
    settings = uplink_settings(section, VehicleSection(id="van-17"))
    assert settings is not None
    store = Store.open(tmp_path / "state")
    alarms = Listener(broker.port, "alarms/#")
    uplink = Uplink(settings, Outbox(store, "fleet"), {"vehicle_id": "van-17"})
    uplink.start()
    try:
        light, heavy, still = weighing(0, 2400.0), weighing(1, 2600.5), weighing(2, 2610.0)
        refused = replace(make_estimate(3), vehicle_id="van-17", rejected=(Why.TOO_SLOW,))
        for estimate in (light, heavy, still, refused, weighing(4, 2300.0), weighing(5, 2700.0)):
            store.write_estimate(estimate_to_json(estimate))
        assert wait_until(lambda: len(alarms.heard) >= 2)
        assert wait_until(lambda: uplink.report().n_waiting == 0)
    finally:
        uplink.stop()
        store.close()
        alarms.close()
    first, second = (json.loads(message.payload) for message in alarms.heard)
    assert alarms.heard[0].topic == "alarms/van-17"
    assert first["over"] == [{"what": "gross", "kg": 2600.5, "limit_kg": 2500.0}]
    assert second["over"][0]["kg"] == 2700.0
