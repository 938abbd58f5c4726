"""The MQTT discovery messages for Home Assistant fit the records that they describe."""

import json
import math
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from jinja2.sandbox import SandboxedEnvironment
from support.broker import Listener, needs_mosquitto, running_broker
from support.estimates import make_estimate, make_record, with_everything
from support.patience import wait_until

from gateway.config import VehicleSection
from gateway.config.sections import UplinkSection
from gateway.errors import ConfigurationError
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate, Weight, Weights
from gateway.records import Why
from gateway.store import Store
from gateway.uplink.home_assistant import discovery
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import uplink_settings
from gateway.uplink.uplink import Uplink

BIRTH = {"vehicle_id": "van-17", "vin": "WVWZZZ1KZAW000001", "version": "1.2.3", "estimator": "cross_spectrum"}


def told(**changed: Any) -> dict[str, Any]:
    _, text = discovery("homeassistant", "springscale/van-17", BIRTH | changed)
    return json.loads(text)


RETAINED = {"springscale/van-17/latest", "springscale/van-17/status"}


def states(estimate: Estimate) -> dict[str, str]:
    """Each entity's state after a record, rendered as Home Assistant does: in a sandbox, JSON as value_json."""
    templates = SandboxedEnvironment()
    record = json.loads(json.dumps(estimate_to_json(estimate))) | {"state": "online"}
    components = told()["components"]
    return {
        key: templates.from_string(component["value_template"]).render(value_json=record)
        for key, component in components.items()
    }


def test_an_estimate_is_shown_as_it_is() -> None:
    weights = Weights(gross=Weight(1711.3, 6.1, 2000.0, None), front_axle=Weight(1006.1, 5.4, 1000.0, None))
    found = states(replace(with_everything(3), weights=weights))
    assert (found["payload"], found["payload_std"], found["gross"]) == ("103.0", "6.0", "1711.3")
    assert (found["front_axle"], found["rear_axle"], found["overload"]) == ("1006.1", "None", "ON")
    assert found["weighed"].startswith("1970-01-01T00:20:00")
    assert found["refused"] == ""


def test_unknown_weights_are_unknown_and_no_overload_is_off() -> None:
    """Home Assistant takes the word None for "unknown"."""
    refused = states(make_estimate(3, Why.TOO_SLOW))
    assert {refused[key] for key in ("payload", "payload_std", "gross", "front_axle", "overload")} == {"None"}
    assert refused["refused"] == "too_slow"
    light = Weights(gross=Weight(1500.0, 6.1, 2000.0, None), front_axle=Weight(800.0, 5.4, math.nan, None))
    assert states(replace(make_estimate(3), weights=light))["overload"] == "OFF"


def test_the_message_has_what_device_discovery_asks_for() -> None:
    found = told()
    assert found["device"]["identifiers"] == ["springscale_van-17"]
    assert found["device"]["serial_number"] == "WVWZZZ1KZAW000001"
    assert found["origin"]["name"] == "springscale"
    assert found["state_topic"] == "springscale/van-17/latest"
    assert not any("availability" in key for key in found)  # a parked vehicle's weights are there
    components = found["components"]
    assert components["refused"]["state_topic"] == "springscale/van-17/estimates"
    assert components["connected"]["state_topic"] == "springscale/van-17/status"
    assert components["front_share"]["suggested_display_precision"] == 2
    assert components["weighed"]["device_class"] == "timestamp"
    names = [component["unique_id"] for component in found["components"].values()]
    assert len(set(names)) == len(names)
    for component in found["components"].values():
        assert component["platform"] in ("sensor", "binary_sensor")
    assert "serial_number" not in told(vin=None)["device"]


def test_a_name_that_no_topic_may_hold_stays_different_from_others() -> None:
    topics = {
        discovery("homeassistant", "x", BIRTH | {"vehicle_id": name})[0] for name in ("van.17", "van-17", "van_17")
    }
    assert len(topics) == 3
    assert all("." not in topic for topic in topics)


@contextmanager
def delivered(folder: Path, prefix: str, *records: dict[str, Any], **broker: str) -> Iterator[int]:
    """The port of a broker that an uplink has given all of these, with discovery under ``prefix``."""
    section = UplinkSection(host="127.0.0.1", tls=False, home_assistant=prefix)
    with running_broker(folder, **broker) as running, closing(Store.open(folder / "state")) as store:
        for record in records:
            store.write_estimate(record)
        settings = uplink_settings(section.model_copy(update={"port": running.port}), VehicleSection(id="van-17"))
        uplink = Uplink(settings, Outbox(store, "fleet"), BIRTH)
        uplink.start()
        assert wait_until(lambda: uplink.report().n_delivered == len(records)), uplink.report()
        uplink.stop()
        yield running.port


@needs_mosquitto
def test_it_is_retained_at_a_real_broker_and_estimates_still_go_out(tmp_path: Path) -> None:
    with delivered(tmp_path, "ha", make_record(1)) as port:
        listener = Listener(port, "ha/#")
        assert listener.wait_for(1)
        listener.close()
    (message,) = listener.heard
    assert (message.topic, message.retain) == ("ha/device/springscale_van-17/config", True)
    assert json.loads(message.payload) == told()


@needs_mosquitto
def test_a_late_subscriber_gets_the_last_weights_after_a_refusal(tmp_path: Path) -> None:
    """After its restart Home Assistant showed nothing until the next estimate."""
    with delivered(tmp_path, "ha", make_record(1), make_record(2), make_record(3, Why.TOO_SLOW)) as port:
        listener = Listener(port, "springscale/van-17/#")
        assert wait_until(lambda: {message.topic for message in listener.heard} == RETAINED)
        listener.close()
    (latest,) = [message for message in listener.heard if message.topic.endswith("latest")]
    assert latest.retain
    assert json.loads(latest.payload)["id"] == make_record(2)["id"]


@needs_mosquitto
def test_a_refused_discovery_message_does_not_stop_estimates(tmp_path: Path) -> None:
    (tmp_path / "acl").write_text("topic read #\ntopic write springscale/#\n")
    # with an unlimited queue, which the other tests have, mosquitto 2.0.11 cuts who writes where it may not
    extra = f"allow_anonymous true\nacl_file {tmp_path}/acl\nmax_queued_messages 1000"
    with delivered(tmp_path, "homeassistant", make_record(1), extra=extra):
        pass


def test_a_forbidden_prefix_is_reported() -> None:
    section = UplinkSection(host="fleet.example", home_assistant="home/#")
    with pytest.raises(ConfigurationError, match=r"home_assistant 'home/#'"):
        uplink_settings(section, VehicleSection(id="van-17"))
