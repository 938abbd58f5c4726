"""A real Home Assistant beside a real broker: a vehicle appears there, fills, and is seen to be away.

Runs where `hass` and mosquitto are found (support.parts); docs/faults.md says which versions it was run with, and
how they are installed.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from support.broker import Broker, needs_mosquitto, running_broker
from support.estimates import make_estimate
from support.home_assistant import HomeAssistant
from support.parts import needs
from support.patience import wait_until

from gateway.config import VehicleSection
from gateway.config.sections import UplinkSection
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Weight, Weights
from gateway.store import Store
from gateway.uplink.home_assistant import ENTITIES
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import uplink_settings
from gateway.uplink.uplink import Uplink

pytestmark = [needs("hass"), needs_mosquitto]

BIRTH = {"vehicle_id": "van-17", "vin": "WVWZZZ1KZAW000001", "version": "1.2.3", "estimator": "cross_spectrum"}
PAYLOAD, OVERLOAD = "sensor.van_17_payload", "binary_sensor.van_17_overload"
CONNECTED, GROSS = "binary_sensor.van_17_connected", "sensor.van_17_gross_weight"
HEAVY = Weights(gross=Weight(2600.4, 8.0, 2500.0, None), front_axle=Weight(1200.2, 6.0, None, None))


@contextmanager
def vehicle(store: Store, broker: Broker) -> Iterator[Uplink]:
    """The product's own uplink, as the service starts it."""
    section = UplinkSection(host="127.0.0.1", port=broker.port, tls=False, home_assistant="homeassistant")
    settings = uplink_settings(section, VehicleSection(id="van-17"))
    uplink = Uplink(settings, Outbox(store, "fleet"), BIRTH)
    uplink.start()
    try:
        yield uplink
    finally:
        uplink.stop()


def weighed_and_shown(assistant: HomeAssistant, store: Store, n: int, weights: Weights | None = None) -> None:
    """One batch, which Home Assistant shows however late it subscribes: the newest is retained at the broker."""
    found = make_estimate(n)
    store.write_estimate(estimate_to_json(replace(found, weights=weights) if weights else found))
    assert wait_until(lambda: assistant.state(PAYLOAD) == f"{100.0 + n}"), (assistant.state(PAYLOAD), assistant.log)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[HomeAssistant, Broker]]:
    folder = tmp_path_factory.mktemp("home")
    with running_broker(folder) as broker, HomeAssistant(folder / "config") as assistant:
        assistant.add_broker(broker.port)
        yield assistant, broker


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    opened = Store.open(tmp_path / "state")
    yield opened
    opened.close()


def test_a_vehicle_appears_fills_and_is_seen_to_be_away(home: tuple[HomeAssistant, Broker], store: Store) -> None:
    assistant, broker = home
    with vehicle(store, broker):
        assert wait_until(lambda: PAYLOAD in assistant.states("van_17")), assistant.log
        assert wait_until(lambda: len(assistant.states("van_17")) == len(ENTITIES)), assistant.states("van_17")
        weighed_and_shown(assistant, store, 3, HEAVY)
        for entity, state in ((GROSS, "2600.4"), (OVERLOAD, "on"), (CONNECTED, "on")):  # each takes it for itself
            assert wait_until(lambda entity=entity, state=state: assistant.state(entity) == state), entity
        states = assistant.states("van_17")
        assert states["sensor.van_17_rear_axle"]["state"] == "unknown"  # which is not 0
        payload = states[PAYLOAD]["attributes"]
        assert (payload["unit_of_measurement"], payload["device_class"]) == ("kg", "weight")
    # switched off: it is seen to be away, and its last weight stays, as that of a parked van
    assert wait_until(lambda: assistant.state(CONNECTED) == "off"), assistant.state(CONNECTED)
    assert assistant.state(PAYLOAD) == "103.0"


def test_it_comes_back_after_a_restart_of_home_assistant(home: tuple[HomeAssistant, Broker], store: Store) -> None:
    assistant, broker = home
    with vehicle(store, broker):
        weighed_and_shown(assistant, store, 40)
        assistant.restart()
        assert wait_until(lambda: PAYLOAD in assistant.states("van_17")), assistant.log
        weighed_and_shown(assistant, store, 41)


def test_a_parked_van_keeps_its_weight_over_a_restart(home: tuple[HomeAssistant, Broker], store: Store) -> None:
    assistant, broker = home
    with vehicle(store, broker):
        weighed_and_shown(assistant, store, 80)
        assistant.restart()
        assert wait_until(lambda: assistant.state(PAYLOAD) == "180.0"), (assistant.state(PAYLOAD), assistant.log)
