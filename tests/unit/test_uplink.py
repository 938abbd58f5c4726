"""The uplink's own logic against a link that does what the test says."""

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.estimates import make_record
from support.log import fields_of, names
from support.patience import PATIENCE_S, wait_until

from gateway.config import VehicleSection
from gateway.config.sections import UplinkSection
from gateway.errors import ConfigurationError
from gateway.log import Event
from gateway.part import BackOff
from gateway.store import Retention, Store
from gateway.uplink.forwarder import NotTakenError
from gateway.uplink.link import BrokerAnswer
from gateway.uplink.outbox import Outbox, OutboxMessage
from gateway.uplink.settings import UplinkSettings, uplink_settings
from gateway.uplink.uplink import Uplink

KNOWN = dict(UplinkSection(host="fleet.example"))
SETTINGS = UplinkSettings(host="broker.example", port=8883, topic="springscale/van-17", client_id="springscale-van-17")


class FakeBroker:
    """Takes what it is sent; ``answer`` says what to reply to the n-th message, or breaks the link; None: nothing."""

    def __init__(self, answer: Callable[[int, OutboxMessage], BrokerAnswer | None]) -> None:
        self.taken: list[OutboxMessage] = []
        self.n_connections = 0
        self._answer = answer
        self._n_sent = 0

    def __call__(self, *_: Any) -> "FakeBroker":
        self.n_connections += 1
        return self

    def send(self, message: OutboxMessage, is_stopping: Callable[[], bool]) -> BrokerAnswer | None:
        self._n_sent += 1
        answer = self._answer(self._n_sent, message)
        if answer is None:
            wait_until(is_stopping)
        elif answer.is_accepted:
            self.taken.append(message)
        return answer

    def check(self) -> None: ...
    def close(self) -> None: ...
    def abandon(self) -> None: ...


def accepted(_n: int, _letter: OutboxMessage) -> BrokerAnswer:
    return BrokerAnswer(True, False, "Success")


def fill(store: Store, n: int) -> list[str]:
    records = [make_record(i) for i in range(n)]
    for record in records:
        store.write_estimate(record)
    assert store.flush(PATIENCE_S)
    return [record["id"] for record in records]


def deliver(store: Store, broker: FakeBroker, is_done: Callable[[Uplink], bool]) -> Uplink:
    """Runs an uplink until ``is_done`` and stops it."""
    uplink = Uplink(SETTINGS, Outbox(store, "fleet"), {}, broker, BackOff(0.001, 0.002))
    uplink.start()
    assert wait_until(lambda: is_done(uplink)), uplink.report()
    uplink.stop()
    assert not uplink.is_alive()
    assert store.flush(PATIENCE_S)
    return uplink


def test_everything_stored_is_delivered_once_and_in_order(store: Store) -> None:
    ids = fill(store, 250)
    broker = FakeBroker(accepted)
    deliver(store, broker, lambda uplink: uplink.report().n_delivered == 250)
    assert [message.id for message in broker.taken] == ids
    assert store.reader().delivery("fleet").n_waiting == 0


def test_a_later_start_goes_on_where_the_last_one_ended(store: Store) -> None:
    fill(store, 5)
    deliver(store, FakeBroker(accepted), lambda uplink: uplink.report().n_delivered == 5)
    new = make_record(99)
    store.write_estimate(new)
    broker = FakeBroker(accepted)
    deliver(store, broker, lambda uplink: uplink.report().n_delivered == 1)
    assert [message.id for message in broker.taken] == [new["id"]]


def test_after_a_break_only_the_message_in_flight_is_repeated(store: Store) -> None:
    ids = fill(store, 40)
    breaks = {7, 8, 23}

    def answer(n: int, message: OutboxMessage) -> BrokerAnswer | None:
        if n in breaks:
            broker.taken.append(message)  # it arrived, its answer did not
            raise NotTakenError("cut")
        return accepted(n, message)

    broker = FakeBroker(answer)
    uplink = deliver(store, broker, lambda uplink: uplink.report().n_delivered >= 40)
    assert uplink.report().n_cuts == len(breaks)
    came = [message.id for message in broker.taken]
    assert list(dict.fromkeys(came)) == ids
    assert len(came) - len(ids) == len(breaks)
    assert broker.n_connections == 1 + len(breaks)


def test_a_temporary_refusal_is_retried(store: Store) -> None:
    ids = fill(store, 3)
    answers = iter(["Quota exceeded", "Not authorized"])

    def answer(n: int, message: OutboxMessage) -> BrokerAnswer:
        reason = next(answers, None)
        return accepted(n, message) if reason is None else BrokerAnswer(False, False, reason)

    broker = FakeBroker(answer)
    uplink = deliver(store, broker, lambda uplink: uplink.report().n_delivered == 3)
    assert [message.id for message in broker.taken] == ids
    assert uplink.report().n_refused == 0


def test_a_permanent_refusal_is_counted_without_delaying_others(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    ids = fill(store, 6)

    def answer(n: int, message: OutboxMessage) -> BrokerAnswer:
        if message.id == ids[2]:
            return BrokerAnswer(False, True, "Packet too large")
        return accepted(n, message)

    broker = FakeBroker(answer)
    uplink = deliver(store, broker, lambda uplink: uplink.report().n_delivered == 5)
    assert [message.id for message in broker.taken] == [*ids[:2], *ids[3:]]
    assert uplink.report().n_refused == 1
    assert fields_of(caplog, Event.UPLINK_REFUSED)["id"] == ids[2]


def test_one_message_is_in_flight_at_a_time(store: Store) -> None:
    fill(store, 3)
    sent: list[OutboxMessage] = []

    def silent(_n: int, message: OutboxMessage) -> None:
        sent.append(message)

    uplink = deliver(store, FakeBroker(silent), lambda uplink: bool(sent))
    assert len(sent) == 1
    assert uplink.report().n_delivered == 0
    assert store.reader().delivery("fleet").n_waiting == 3


def test_waiting_records_are_counted_without_a_link(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.uplink.forwarder.LOOK_S", 0.01)
    fill(store, 3)

    def unreachable(*_: Any) -> FakeBroker:
        raise NotTakenError("no route to host")

    uplink = Uplink(SETTINGS, Outbox(store, "fleet"), {}, unreachable, BackOff(60.0, 60.0))
    uplink.start()
    assert wait_until(lambda: uplink.report().n_waiting == 3)
    store.write_estimate(make_record(9))
    assert wait_until(lambda: uplink.report().n_waiting == 4)
    uplink.stop()
    assert not uplink.is_alive()
    assert uplink.report().waiting_age_s is not None
    assert (uplink.report().n_connections, uplink.report().n_cuts) == (0, 0)


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


def test_spectra_are_not_sent(store: Store) -> None:
    store.write_estimate(make_record(1, with_spectra=True))
    broker = FakeBroker(accepted)
    deliver(store, broker, lambda uplink: uplink.report().n_delivered == 1)
    assert "spectra" not in broker.taken[0].text


def test_undelivered_records_that_retention_removes_are_counted(tmp_path: Path) -> None:
    now_ns = [1_790_000_000 * 10**9]
    store = Store.open(tmp_path, Retention(max_age_s=60.0), clock_ns=lambda: now_ns[0])
    fill(store, 2)
    broker = FakeBroker(accepted)
    deliver(store, broker, lambda uplink: uplink.report().n_delivered == 2)
    for n in range(10, 13):
        store.write_estimate(make_record(n))
    assert store.flush(PATIENCE_S)
    now_ns[0] += 120 * 10**9
    store.write_estimate(make_record(20))  # a write looks at age
    assert store.flush(PATIENCE_S)
    store.close()  # the writer looks at age after it has told of the write
    assert store.reader().delivery("fleet").n_pruned == 3  # the two delivered ones were removed as well
    assert store.reader().delivery("fleet").n_waiting == 1


def test_a_database_that_was_replaced_is_delivered_from_its_first_row(tmp_path: Path) -> None:
    store = Store.open(tmp_path / "a")
    fill(store, 3)
    outbox = Outbox(store, "fleet")
    for message in outbox.next_messages(10):
        outbox.delivered(message)
    assert store.flush(PATIENCE_S)
    store.close()
    other = Store.open(tmp_path / "b")
    ids = fill(other, 2)
    outbox._journal, outbox._follower = other, other.follow(outbox._kinds, outbox._follower.place, lambda: None)
    assert [message.id for message in outbox.next_messages(10)] == ids
    other.close()


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
    ],
)
def test_settings_that_contradict_each_other_are_refused(section: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        UplinkSection(**section)


def test_the_log_reports_connects_and_disconnects(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "gateway")
    fill(store, 3)
    faults = iter(["no route", "no route", "no name", None, None])

    def connect(*_: Any) -> FakeBroker:
        if (fault := next(faults)) is not None:
            raise NotTakenError(fault)
        return broker()

    def answer(n: int, message: OutboxMessage) -> BrokerAnswer:
        if n == 2:
            raise NotTakenError("cut")
        return accepted(n, message)

    broker = FakeBroker(answer)
    uplink = Uplink(SETTINGS, Outbox(store, "fleet"), {}, connect, BackOff(0.001, 0.002))
    uplink.start()
    assert wait_until(lambda: uplink.report().n_delivered == 3)
    uplink.stop()
    assert names(caplog) == [
        Event.UPLINK_NOT_REACHED,  # twice for one reason is one line
        Event.UPLINK_NOT_REACHED,
        Event.UPLINK_CONNECTED,
        Event.UPLINK_LOST,
        Event.UPLINK_CONNECTED,
    ]
    assert fields_of(caplog, Event.UPLINK_NOT_REACHED) == {"broker": "broker.example:8883", "fault": "no name"}
    assert fields_of(caplog, Event.UPLINK_LOST) == {"broker": "broker.example:8883", "fault": "cut"}
