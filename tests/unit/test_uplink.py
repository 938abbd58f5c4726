"""The uplink's own logic against a broker that does what the test says, and its settings."""

import random
import socket
from pathlib import Path
from typing import Any

import pytest
from support.broker import CuttableLink
from support.estimates import make_record
from support.log import fields_of, names
from support.patience import PATIENCE_S, wait_until
from support.ports import free_port
from support.sequence import drained
from support.small_broker import SmallBroker

from gateway.config import VehicleSection
from gateway.config.sections import UplinkSection
from gateway.errors import ConfigurationError
from gateway.log import Event
from gateway.part import BackOff
from gateway.store import Retention, Store
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import UplinkSettings, uplink_settings
from gateway.uplink.uplink import Uplink


def fill(store: Store, n: int) -> None:
    for i in range(n):
        store.write_estimate(make_record(i))
    assert store.flush(PATIENCE_S)


def started(store: Store, port: int) -> Uplink:
    settings = UplinkSettings(host="127.0.0.1", port=port, topic="springscale/van-17", client_id="van-17", tls=False)
    uplink = Uplink(settings, Outbox(store, "fleet"), {}, BackOff(0.001, 0.002))
    uplink.start()
    return uplink


def test_one_message_is_under_way_at_a_time(store: Store) -> None:
    fill(store, 3)
    sent: list[str] = []

    def silent_on_estimates(topic: str) -> int | None:
        sent.append(topic)
        return 0 if topic.endswith("/status") else None

    with SmallBroker(1 << 20, "puback", code_of=silent_on_estimates) as broker:
        uplink = started(store, broker.port)
        assert wait_until(lambda: len(sent) > 1)
        uplink.stop()
    assert sent[:2] == ["springscale/van-17/status", "springscale/van-17/estimates"]
    assert "springscale/van-17/estimates" not in sent[2:]
    assert uplink.report().n_delivered == 0
    assert store.reader().delivery("fleet").n_waiting == 3


def test_waiting_records_are_counted_without_a_link(
    store: Store, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("gateway.uplink.sender.LOOK_S", 0.01)
    monkeypatch.setattr("gateway.uplink.sender.IDLE_S", 0.01)
    fill(store, 3)
    uplink = started(store, free_port())
    assert wait_until(lambda: uplink.report().n_waiting == 3)
    store.write_estimate(make_record(9))
    assert wait_until(lambda: uplink.report().n_waiting == 4)
    assert wait_until(lambda: "refused" in (uplink.report().last_fault or ""))
    uplink.stop()
    assert not uplink.is_alive()
    assert uplink.report().waiting_age_s is not None
    assert (uplink.report().n_connections, uplink.report().n_cuts) == (0, 0)
    assert names(caplog) == [Event.UPLINK_NOT_REACHED]  # many times for one reason is one line


def test_waiting_records_are_counted_while_a_message_waits_for_the_link(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gateway.uplink.sender.LOOK_S", 0.01)
    monkeypatch.setattr("gateway.uplink.uplink.TURN_S", 0.01)
    fill(store, 3)
    silent_on_estimates = lambda topic: 0 if topic.endswith("/status") else None  # noqa: E731
    with SmallBroker(1 << 20, "puback", code_of=silent_on_estimates) as broker, CuttableLink(broker.port) as link:
        uplink = started(store, link.port)
        assert wait_until(lambda: uplink.report().n_waiting == 3 and uplink.report().is_connected)
        link.cut_for_good()
        store.write_estimate(make_record(9))
        assert wait_until(lambda: uplink.report().n_waiting == 4 and not uplink.report().is_connected)
        uplink.stop()
    assert not uplink.is_alive()


def test_a_broker_that_accepts_and_says_nothing_is_a_fault(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.uplink.uplink.ANSWER_TIMEOUT_S", 0.05)
    monkeypatch.setattr("gateway.uplink.sender.IDLE_S", 0.01)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        uplink = started(store, silent.getsockname()[1])
        assert wait_until(lambda: "did not answer" in (uplink.report().last_fault or ""))
        uplink.stop()
    assert not uplink.is_alive()


def test_the_log_reports_connects_and_cuts(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "gateway")
    with SmallBroker(1 << 20, "puback") as broker, CuttableLink(broker.port) as link:
        uplink = started(store, link.port)
        assert wait_until(lambda: Event.UPLINK_CONNECTED in names(caplog))
        link.cut()
        assert wait_until(lambda: names(caplog).count(Event.UPLINK_CONNECTED) == 2)
        uplink.stop()
    assert names(caplog) == [Event.UPLINK_CONNECTED, Event.UPLINK_LOST, Event.UPLINK_CONNECTED]
    assert "was lost" in fields_of(caplog, Event.UPLINK_LOST)["fault"]
    assert (uplink.report().n_connections, uplink.report().n_cuts) == (2, 1)


def test_spectra_are_not_sent(store: Store) -> None:
    store.write_estimate(make_record(1, with_spectra=True))
    (message,) = drained(Outbox(store, "fleet"))
    assert "spectra" not in message.text


def test_the_waiting_age_is_that_of_the_oldest_record(tmp_path: Path) -> None:
    now_ns = [1_790_000_000 * 10**9]
    store = Store.open(tmp_path, clock_ns=lambda: now_ns[0])
    cursors: list[str | None] = [None]
    for n, pause_s in enumerate((40, 20, 5)):
        cursors.append(store.write_estimate(make_record(n)))
        assert store.flush(PATIENCE_S)
        now_ns[0] += pause_s * 10**9
    first_ns = 1_790_000_000 * 10**9
    for cursor, wait_s in zip(cursors, (0, 40, 60, None), strict=True):
        if cursor is not None:
            store.write_delivery("fleet", cursor)
            assert store.flush(PATIENCE_S)
        assert store.reader().delivery("fleet").oldest_ns == (None if wait_s is None else first_ns + wait_s * 10**9)
    store.close()


def test_undelivered_records_that_retention_removes_are_counted(tmp_path: Path) -> None:
    now_ns = [1_790_000_000 * 10**9]
    store = Store.open(tmp_path, Retention(max_age_s=60.0), clock_ns=lambda: now_ns[0])
    fill(store, 2)
    assert len(drained(Outbox(store, "fleet"))) == 2
    for n in range(10, 13):
        store.write_estimate(make_record(n))
    assert store.flush(PATIENCE_S)
    now_ns[0] += 120 * 10**9
    store.write_estimate(make_record(20))  # a write looks at age
    assert store.flush(PATIENCE_S)
    store.close()  # the writer looks at age after it has told of the write
    assert store.reader().delivery("fleet").n_pruned == 3  # the two delivered ones were removed as well
    assert store.reader().delivery("fleet").n_waiting == 1


def test_a_cursor_of_another_database_is_not_remembered(store: Store) -> None:
    fill(store, 1)
    assert not store.write_delivery("fleet", "00000000-5")
    assert store.flush(PATIENCE_S)
    assert store.reader().delivery("fleet").cursor is None


def test_the_back_off_grows_to_its_ceiling_and_resets() -> None:
    back_off = BackOff(1.0, 8.0, random.Random(1))
    pauses = [back_off.next_s() for _ in range(2000)]
    assert max(pauses[5:]) > 7.5
    assert all(0.0 <= pause <= ceiling for pause, ceiling in zip(pauses, [1, 2, 4, *[8] * 1997], strict=True))
    assert sum(pauses[5:]) / len(pauses[5:]) == pytest.approx(4.0, rel=0.05)
    back_off.reset()
    assert back_off.next_s() <= 1.0


def test_settings_name_the_vehicle(tmp_path: Path) -> None:
    settings = uplink_settings(UplinkSection(host="fleet.example"), VehicleSection(id="van-17"))
    assert (settings.port, settings.topic, settings.client_id) == (8883, "springscale/van-17", "springscale-van-17")
    assert uplink_settings(UplinkSection(), VehicleSection()) is None


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ({"host": "b", "topic": "fleet/+"}, "MQTT allows no"),
        ({"host": "b", "ca": "absent.pem"}, "cannot be used"),
        ({"host": "b", "username": "van", "password_file": "absent"}, "cannot be read"),
    ],
)
def test_an_unusable_setting_is_reported_at_the_start(section: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        uplink_settings(UplinkSection(**section), VehicleSection(id="van-17"))


def test_a_vehicle_without_a_name_of_its_own_is_given_no_uplink() -> None:
    for vehicle in (VehicleSection(), VehicleSection(id="vehicle")):
        with pytest.raises(ConfigurationError, match=r"set \[vehicle\] id"):
            uplink_settings(UplinkSection(host="fleet.example"), vehicle)


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ({"host": "b", "key": "k.pem"}, "belong together"),
        ({"host": "b", "password_file": "p"}, "needs username"),
        ({"host": "b", "tls": False}, "in the clear"),
        ({"host": f"{'b' * 64}.example"}, "nor a name that a host can have"),
        *(({"host": "b", key: "x" * 65_536}, "1000 characters") for key in ("topic", "client_id", "username")),
    ],
)
def test_settings_that_contradict_each_other_are_refused(section: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        UplinkSection(**section)
