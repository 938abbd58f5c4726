"""The uplink against a real broker: cuts, restarts, kill -9, TLS, refusals, presence."""

import itertools
import json
import random
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
import trustme
from support.alarms import LIMIT_KG, AlarmBench, of_load
from support.broker import CuttableLink, Listener, needs_mosquitto, running_broker
from support.estimates import make_record
from support.patience import PATIENCE_S, wait_until
from support.sequence import BackEnd

from gateway.part import BackOff
from gateway.store import Store
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import UplinkSettings
from gateway.uplink.uplink import Uplink

pytestmark = needs_mosquitto

N_ESTIMATES = 3_000
N_CUTS, N_RESTARTS, N_KILLS = 10, 3, 7

DELIVERER = """
import pathlib, sys, time
from gateway.store import Store
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import UplinkSettings
from gateway.uplink.uplink import Uplink
from gateway.part import BackOff

store = Store.open(pathlib.Path(sys.argv[1]))
broker = {"host": "127.0.0.1", "port": int(sys.argv[2]), "tls": False}
settings = UplinkSettings(**broker, topic="springscale/van-17", client_id="springscale-van-17")
Uplink(settings, Outbox(store, "fleet"), {}, back_off=BackOff(0.01, 0.1)).start()
print("started", flush=True)
time.sleep(600)
"""


def settings_of(port: int, **changed: object) -> UplinkSettings:
    kept = {"host": "127.0.0.1", "port": port, "topic": "springscale/van-17", "client_id": "van-17", "tls": False}
    return UplinkSettings(**{**kept, **changed})


def started(store: Store, settings: UplinkSettings) -> Uplink:
    uplink = Uplink(settings, Outbox(store, "fleet"), {"vehicle_id": "van-17"}, back_off=BackOff(0.01, 0.1))
    uplink.start()
    return uplink


def test_thousands_of_estimates_arrive_in_order_through_twenty_cuts_restarts_and_kills(tmp_path: Path) -> None:
    dice = random.Random(17)
    state = tmp_path / "state"
    ids = _stored_beforehand(state)
    blows = dice.sample(["cut"] * N_CUTS + ["restart"] * N_RESTARTS + ["kill"] * N_KILLS, N_CUTS + N_RESTARTS + N_KILLS)
    moments = sorted(dice.sample(range(N_ESTIMATES // 50, N_ESTIMATES - N_ESTIMATES // 50), len(blows)))
    on_disk = []  # how many the store knew to be delivered after each kill
    with running_broker(tmp_path) as broker, CuttableLink(broker.port) as link, ExitStack() as at_the_end:
        listener = Listener(broker.port, "springscale/+/estimates")
        at_the_end.callback(listener.close)
        deliverer = _deliverer(state, link.port)
        at_the_end.callback(lambda: _kill(deliverer))  # whichever it is by then
        for moment, blow in zip(moments, blows, strict=True):
            assert listener.wait_for(moment), f"stuck before the next {blow}"
            if blow == "cut":
                link.cut()
            elif blow == "restart":
                broker.stop()
                broker.start()
            else:
                _kill(deliverer)
                link.cut()
                on_disk.append(_n_delivered(state))
                deliverer = _deliverer(state, link.port)
        wait_until(lambda: json.loads(listener.heard[-1].payload)["id"] == ids[-1])
    back_end = BackEnd()
    for message in listener.heard:
        back_end.take(message.payload.decode())
    assert (list(back_end.ids), back_end.missing) == (ids, [])
    came = _places(listener, ids)
    assert list(dict.fromkeys(came)) == list(range(len(ids)))  # all of them, each first seen in its turn
    steps = list(itertools.pairwise(came))
    assert sum(after == before for before, after in steps) <= link.n_connections  # after a break the one under way
    assert {after for before, after in steps if after < before} <= set(on_disk)  # after a kill from what was on disk


def _places(listener: Listener, ids: list[str]) -> list[int]:
    """Which of ``ids`` came, without what the broker said again because it was stopped before it was thanked."""
    place = {known: n for n, known in enumerate(ids)}
    came: list[int] = []
    seen: set[int] = set()
    for message in listener.heard:
        n = place[json.loads(message.payload)["id"]]
        if not (message.dup and n in seen):
            came.append(n)
            seen.add(n)
    return came


def _kill(process: "subprocess.Popen[str]") -> None:
    process.kill()
    process.wait()


def _n_delivered(state: Path) -> int:
    store = Store.open(state)
    n_waiting = store.reader().delivery("fleet").n_waiting
    store.close()
    return N_ESTIMATES - n_waiting


def _stored_beforehand(state: Path) -> list[str]:
    store = Store.open(state)
    ids = []
    for n in range(N_ESTIMATES):
        record = make_record(n)
        ids.append(record["id"])
        store.write_estimate(record)
        if n % 1000 == 999:  # what waits in memory is bounded
            assert store.flush(PATIENCE_S)
    store.close()
    return ids


def _deliverer(state: Path, port: int) -> "subprocess.Popen[str]":
    tests = Path(__file__).parents[1]
    process = subprocess.Popen(
        [sys.executable, "-c", DELIVERER, str(state), str(port)], stdout=subprocess.PIPE, text=True, cwd=tests
    )
    assert process.stdout.readline() == "started\n"
    process.stdout.close()
    return process


def test_a_message_has_its_content_type(tmp_path: Path) -> None:
    with running_broker(tmp_path) as broker:
        listener = Listener(broker.port, "springscale/van-17/#")
        store = Store.open(tmp_path / "state")
        record = make_record(1)
        store.write_estimate(record)
        uplink = started(store, settings_of(broker.port))
        listener.wait_for(2)
        uplink.stop()
        listener.wait_for(3)
        listener.close()
        store.close()
    birth, estimate, farewell = listener.heard
    assert json.loads(birth.payload) == {"state": "online", "vehicle_id": "van-17"}
    assert estimate.topic == "springscale/van-17/estimates"
    assert estimate.properties.ContentType == "application/json"
    assert estimate.properties.UserProperty == [("id", record["id"])]
    assert json.loads(estimate.payload)["payload_kg"] == 101.0
    assert json.loads(farewell.payload) == {"state": "offline", "reason": "stopped"}


# paho leaves the socket of a handshake that failed to the garbage collector
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_over_tls_with_certificates_on_both_sides(tmp_path: Path) -> None:
    authority = trustme.CA()
    authority.cert_pem.write_to_path(tmp_path / "ca.pem")
    for name, issued in (("broker", authority.issue_cert("127.0.0.1")), ("van", authority.issue_cert("van-17"))):
        issued.private_key_pem.write_to_path(tmp_path / f"{name}.key")
        issued.cert_chain_pems[0].write_to_path(tmp_path / f"{name}.pem")
    extra = (
        f"allow_anonymous true\ncafile {tmp_path}/ca.pem\ncertfile {tmp_path}/broker.pem\n"
        f"keyfile {tmp_path}/broker.key\nrequire_certificate true"
    )
    ours = {"certificate": tmp_path / "van.pem", "key": tmp_path / "van.key"}
    stranger = trustme.CA()
    stranger.cert_pem.write_to_path(tmp_path / "stranger.pem")
    store = Store.open(tmp_path / "state")
    store.write_estimate(make_record(1))
    with running_broker(tmp_path, extra) as broker:
        wary = started(store, settings_of(broker.port, tls=True, ca=tmp_path / "stranger.pem", **ours))
        assert wait_until(lambda: "certificate verify failed" in (wary.report().last_fault or ""))
        wary.stop()
        uplink = started(store, settings_of(broker.port, tls=True, ca=tmp_path / "ca.pem", **ours))
        assert wait_until(lambda: uplink.report().n_delivered == 1), uplink.report()
        uplink.stop()
    store.close()
    assert wary.report().n_delivered == 0


def test_a_wrong_password_is_reported_and_a_corrected_one_works_without_a_restart(tmp_path: Path) -> None:
    passwords = tmp_path / "passwords"
    subprocess.run(["mosquitto_passwd", "-b", "-c", str(passwords), "van", "right"], check=True, capture_output=True)
    secret = tmp_path / "password"
    secret.write_text("wrong\n")
    store = Store.open(tmp_path / "state")
    store.write_estimate(make_record(1))
    with running_broker(tmp_path, f"allow_anonymous false\npassword_file {passwords}") as broker:
        uplink = started(store, settings_of(broker.port, username="van", password_file=secret))
        assert wait_until(lambda: "Not authorized" in (uplink.report().last_fault or "")), uplink.report()
        assert "wrong" not in (uplink.report().last_fault or "")
        secret.write_text("right\n")
        assert wait_until(lambda: uplink.report().n_delivered == 1), uplink.report()
        uplink.stop()
    store.close()


def test_a_topic_the_broker_forbids_loses_nothing(tmp_path: Path) -> None:
    allowed = tmp_path / "acl"
    allowed.write_text("topic read #\ntopic write springscale/van-17/status\n")
    store = Store.open(tmp_path / "state")
    store.write_estimate(make_record(1))
    with running_broker(tmp_path, f"allow_anonymous true\nacl_file {allowed}") as broker:
        uplink = started(store, settings_of(broker.port))
        assert wait_until(lambda: "Not authorized" in (uplink.report().last_fault or "")), uplink.report()
        uplink.stop()
    assert uplink.report().n_delivered == 0
    assert store.reader().delivery("fleet").n_waiting == 1
    store.close()


def test_a_killed_vehicle_is_announced_by_its_will(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.uplink.uplink.WILL_DELAY_S", 1)
    with running_broker(tmp_path) as broker, CuttableLink(broker.port) as link:
        listener = Listener(broker.port, "springscale/van-17/status")
        store = Store.open(tmp_path / "state")
        uplink = started(store, settings_of(link.port))
        listener.wait_for(1)
        link.cut_for_good()
        listener.wait_for(2)
        uplink.stop()
        listener.close()
        store.close()
    assert json.loads(listener.heard[-1].payload) == {"state": "offline", "reason": "lost"}


def test_an_alarm_is_retained_where_its_cause_has_its_topic(tmp_path: Path) -> None:
    """Who subscribes later hears how each stands; every revision goes out, in order with the rest."""
    bench = AlarmBench(tmp_path / "state")
    with running_broker(tmp_path) as broker:
        uplink = started(bench.store, settings_of(broker.port))
        first = Listener(broker.port, "springscale/van-17/#")
        for n, kg in enumerate((LIMIT_KG + 60.0, 100.0)):
            bench.weigh(of_load(n, kg, n_batches=2))
            assert first.wait_for(1 + 2 * (n + 1))  # the presence comes first
        first.close()
        later = Listener(broker.port, "springscale/van-17/alarms/#", client_id="later")
        assert later.wait_for(1)
        later.close()
        uplink.stop()
    bench.store.close()
    topics = [message.topic.removeprefix("springscale/van-17/") for message in first.heard]
    assert topics[1:] == ["estimates", "alarms/overload/gross"] * 2
    (kept,) = later.heard
    alarm = json.loads(kept.payload)
    assert (kept.retain, kept.topic, alarm["is_active"], alarm["revision"]) == (
        True, "springscale/van-17/alarms/overload/gross", False, 2,
    )  # fmt: skip
    assert dict(kept.properties.UserProperty)["id"] == f"{alarm['id']}-2"
