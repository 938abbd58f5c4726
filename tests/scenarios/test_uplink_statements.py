"""Statements of loads that a real broker sends down to a vehicle."""

import json
import subprocess
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final

import paho.mqtt.client as mqtt
import pytest
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from support.broker import Broker, CuttableLink, needs_mosquitto, running_broker
from support.estimates import make_record
from support.learner import LearnerBench
from support.patience import PATIENCE_S, wait_until

from gateway.errors import RefusedError
from gateway.part import BackOff
from gateway.status import StatementsHeard
from gateway.store import Store
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import UplinkSettings
from gateway.uplink.statements_topic import MOST_BYTES, StatementsDesk, TakeStatements
from gateway.uplink.uplink import Uplink

TOPIC: Final = "springscale/van-17/statements"
NOTE: Final = {"from": "2026-11-26T07:40:00Z", "source": "delivery_note", "ref": "LS-1", "load": {"payload_kg": 310}}
EMPTY: Final = {"from": "2026-11-26T09:40:00Z", "source": "empty", "ref": "E"}
TABLE: Final = "from;source;payload_kg;ref\n2026-11-26T11:00Z;delivery_note;120;LS-2\n2026-11-26T13:00Z;empty;;E-2\n"
ACL: Final = Path(__file__).parents[2] / "deploy/fleet/mosquitto/acl"


@pytest.fixture
def bench(tmp_path: Path) -> LearnerBench:
    return LearnerBench(tmp_path / "learner")


def taking(bench: LearnerBench) -> TakeStatements:
    """Hands a message on as the service does."""
    return partial(bench.learner.loads.import_all, where="the message", may_come_again=True)


@contextmanager
def uplink(port: int, folder: Path, take: TakeStatements, **changed: Any) -> Iterator[Uplink]:
    """A vehicle's uplink, connected."""
    kept = {"host": "127.0.0.1", "port": port, "topic": "springscale/van-17", "client_id": "van-17", "tls": False}
    settings = UplinkSettings(**{**kept, "statements": True, **changed})
    with closing(Store.open(folder / "state")) as store:
        part = Uplink(settings, Outbox(store, "fleet"), {}, back_off=BackOff(0.01, 0.1), take_statements=take)
        part.start()
        assert wait_until(lambda: part.report().is_connected), part.report()
        yield part
        part.stop()


def heard(part: Uplink) -> StatementsHeard:
    return part.report().statements or StatementsHeard()


def send(port: int, content: object, *, kind: str | None = None, retain: bool = False, user: str | None = None) -> None:
    """Publish as the back-end does."""
    client = mqtt.Client(CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv5)
    if user is not None:
        client.username_pw_set(user, "secret")
    client.connect("127.0.0.1", port)
    client.loop_start()
    properties = Properties(PacketTypes.PUBLISH)
    if kind is not None:
        properties.ContentType = kind
    payload = content if isinstance(content, str | bytes) else json.dumps(content)
    client.publish(TOPIC, payload, qos=1, retain=retain, properties=properties).wait_for_publish(PATIENCE_S)
    client.disconnect()
    client.loop_stop()


def stated(bench: LearnerBench) -> list[tuple[str, str]]:
    """Ref and state of every statement, the oldest first."""
    items = json.loads(bench.learner.loads.page())["items"]
    return [(one["ref"], one["state"]) for one in reversed(items)]


@needs_mosquitto
def test_one_statement_a_list_and_a_table_are_taken(tmp_path: Path, bench: LearnerBench) -> None:
    with running_broker(tmp_path) as broker, uplink(broker.port, tmp_path, taking(bench)) as part:
        send(broker.port, NOTE)
        send(broker.port, [EMPTY], kind="application/json; charset=utf-8")
        send(broker.port, TABLE, kind="text/csv")
        assert wait_until(lambda: heard(part).n_taken == 3), part.report()
    assert [ref for ref, _ in stated(bench)] == ["LS-1", "E", "LS-2", "E-2"]
    assert {one["by"] for one in json.loads(bench.learner.loads.page())["items"]} == {"mqtt"}
    assert heard(part) == StatementsHeard(n_taken=3)


BAD: Final = {
    "no JSON": ("{", None, "not valid JSON"),
    "no text": (b"\xff\xfe\x00\xd8", None, "the message"),
    "nothing": ("", None, "the message"),
    "half a character": ('{"from": "2026-11-26T07:40:00Z", "source": "empty", "ref": "\\ud800"}', None, "surrogate"),
    "no load": ([{"from": "2026-11-26T07:40:00Z", "source": "scale"}], None, "load"),
    "another kind": ("x", "image/png", "'image/png': send application/json or text/csv"),
    "too deep": ("[" * 100_000, None, "the message"),
    "too large": (b" " * (MOST_BYTES + 1), None, "split it"),
}


@needs_mosquitto
def test_a_bad_message_is_refused_counted_and_reported_without_delaying_others(
    tmp_path: Path, bench: LearnerBench
) -> None:
    """Records go out and later statements come in; a restart does not meet the bad ones again."""
    with running_broker(tmp_path) as broker, uplink(broker.port, tmp_path, taking(bench)) as part:
        for n, (content, kind, why) in enumerate(BAD.values(), 1):
            send(broker.port, content, kind=kind)
            assert wait_until(lambda n=n: heard(part).n_refused == n), part.report()
            assert why in (heard(part).last_refusal or "")
        send(broker.port, NOTE)
        assert wait_until(lambda: heard(part).n_taken == 1), part.report()
        assert part.report().n_cuts == 0
        part.stop()
        with uplink(broker.port, tmp_path / "later", taking(bench)) as later:
            send(broker.port, EMPTY)
            assert wait_until(lambda: heard(later).n_taken == 1), later.report()
            assert heard(later).n_refused == 0
    assert [ref for ref, _ in stated(bench)] == ["LS-1", "E"]


@needs_mosquitto
def test_a_bad_row_is_reported_and_the_good_ones_are_taken(tmp_path: Path, bench: LearnerBench) -> None:
    with running_broker(tmp_path) as broker, uplink(broker.port, tmp_path, taking(bench)) as part:
        send(broker.port, TABLE + "soon;empty;;E-3\n")
        assert wait_until(lambda: heard(part).n_taken == 1), part.report()
    assert heard(part).n_refused == 1
    assert (heard(part).last_refusal or "").startswith("row 4: from: soon: no time")
    assert len(stated(bench)) == 2


@needs_mosquitto
def test_a_repeated_statement_counts_once_and_restores_nothing(tmp_path: Path, bench: LearnerBench) -> None:
    """A retained message comes with every connection, and after a withdrawal too."""
    with running_broker(tmp_path) as broker, CuttableLink(broker.port) as link:
        send(broker.port, [NOTE, EMPTY], retain=True)
        with uplink(link.port, tmp_path, taking(bench)) as part:
            assert wait_until(lambda: heard(part).n_taken == 1), part.report()
            send(broker.port, [NOTE, EMPTY])
            assert wait_until(lambda: heard(part).n_taken == 2), part.report()
            assert len(stated(bench)) == 2
            ids = {one["ref"]: one["id"] for one in json.loads(bench.learner.loads.page())["items"]}
            bench.learner.loads.withdraw(ids["LS-1"], "local")
            link.cut()
            assert wait_until(lambda: heard(part).n_taken == 3), part.report()
    assert stated(bench) == [("LS-1", "withdrawn"), ("E", "waiting")]


@needs_mosquitto
def test_statements_for_an_absent_vehicle_arrive_when_it_returns(tmp_path: Path, bench: LearnerBench) -> None:
    with running_broker(tmp_path) as broker:
        with uplink(broker.port, tmp_path, taking(bench)) as part:
            send(broker.port, NOTE)
            assert wait_until(lambda: heard(part).n_taken == 1), part.report()
        send(broker.port, EMPTY)
        broker.stop()
        broker.start()
        with uplink(broker.port, tmp_path, taking(bench)) as part:
            assert wait_until(lambda: heard(part).n_taken == 1), part.report()
    assert [ref for ref, _ in stated(bench)] == ["LS-1", "E"]


@needs_mosquitto
def test_a_disk_that_fails_keeps_the_message_at_the_broker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.uplink.sender.IDLE_S", 0.05)
    answers = [RefusedError("not_stored", "the disk is full")] * 3

    def take(content: bytes, by: str) -> str:
        if answers:
            raise answers.pop()
        return '{"problems": []}'

    with running_broker(tmp_path) as broker, uplink(broker.port, tmp_path, take) as part:
        send(broker.port, NOTE)
        assert wait_until(lambda: heard(part).n_taken == 1), part.report()
        assert heard(part) == StatementsHeard(n_taken=1, last_refusal="the disk is full")


@needs_mosquitto
def test_off_it_hears_nothing(tmp_path: Path, bench: LearnerBench) -> None:
    with running_broker(tmp_path) as broker, uplink(broker.port, tmp_path, taking(bench), statements=False) as part:
        send(broker.port, NOTE, retain=True)
        with closing(Store.open(tmp_path / "other")) as store:
            store.write_estimate(make_record(1))
        assert part.report().statements is None
    assert stated(bench) == []


@contextmanager
def guarded_broker(folder: Path) -> Iterator[Broker]:
    """A broker with the access list as it is shipped."""
    passwords = folder / "passwords"
    passwords.write_text("van-17:secret\nvan-18:secret\nfleet-dispatcher:secret\n")
    passwords.chmod(0o600)
    subprocess.run(["mosquitto_passwd", "-U", passwords], check=True)
    lines = f"allow_anonymous false\npassword_file {passwords}\nacl_file {ACL}\nmax_queued_messages 1000"
    with running_broker(folder, lines) as broker:
        yield broker


@needs_mosquitto
def test_the_shipped_access_list_lets_the_dispatcher_state_and_no_other_vehicle(
    tmp_path: Path, bench: LearnerBench
) -> None:
    secret = tmp_path / "secret"
    secret.write_text("secret\n")
    own = {"username": "van-17", "password_file": secret}
    with guarded_broker(tmp_path) as broker, uplink(broker.port, tmp_path, taking(bench), **own) as part:
        send(broker.port, NOTE, user="van-18")
        send(broker.port, EMPTY, user="fleet-dispatcher")
        assert wait_until(lambda: heard(part).n_taken == 1), part.report()
    assert [ref for ref, _ in stated(bench)] == ["E"]


def test_any_exception_on_a_message_is_a_refusal() -> None:
    def take(content: bytes, by: str) -> str:
        raise ZeroDivisionError

    desk = StatementsDesk(take)
    assert desk.is_done(mqtt.MQTTMessage())
    assert desk.report == StatementsHeard(n_refused=1, last_refusal="ZeroDivisionError()")
