"""The webhook against a real receiver: killed, slow, cut, failing, refusing, with TLS; and the sender killed."""

import random
import ssl
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
import trustme
from support.patience import PATIENCE_S, wait_until
from support.ports import free_port
from support.receiver import SECRET_TEXT, Fault, Receiver, cut, slow, status, trickle

from gateway.log import Event
from gateway.part import BackOff
from gateway.records import json_line
from gateway.store import Store
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import WebhookSettings
from gateway.uplink.webhook import Webhook

KINDS = ("alarm", "event")

SENDER = """
import pathlib, sys, time
from gateway.store import Store
from gateway.uplink.outbox import Outbox
from gateway.part import BackOff
from gateway.uplink.settings import WebhookSettings
from gateway.uplink.webhook import Webhook

store = Store.open(pathlib.Path(sys.argv[1]))
settings = WebhookSettings(url=f"http://127.0.0.1:{sys.argv[2]}/hook", secret_file=pathlib.Path(sys.argv[3]))
outbox = Outbox(store, settings.queue, only=settings.kinds)
Webhook(settings, outbox, back_off=BackOff(0.01, 0.05)).start()
print("started", flush=True)
time.sleep(600)
"""


@pytest.fixture
def secret_file(tmp_path: Path) -> Path:
    path = tmp_path / "secret"
    path.write_text(SECRET_TEXT)
    return path


class Sending:
    """A store with letters in it, and a webhook that takes them to a port."""

    def __init__(self, directory: Path, port: int, secret_file: Path, **changed: object) -> None:
        self.store = Store.open(directory)
        settings = WebhookSettings(
            url=f"http://127.0.0.1:{port}/hook", secret_file=secret_file, timeout_s=5.0, give_up_h=1.0
        )
        settings = settings.model_copy(update=changed)
        self.clock_s = 1.0
        self.kept: list[tuple[str, dict[str, str]]] = []
        self.webhook = Webhook(
            settings,
            Outbox(self.store, settings.queue, only=settings.kinds),
            lambda kind, detail: self.kept.append((kind, dict(detail))),
            BackOff(0.005, 0.02),
            clock_s=lambda: self.clock_s,
        )
        self.webhook.start()

    def __enter__(self) -> "Sending":
        return self

    def __exit__(self, *_: object) -> None:
        self.webhook.stop(PATIENCE_S)
        self.store.close()


def tell(store: Store, *numbers: int) -> list[str]:
    """Entries, some of them nothing that the receiver wants -> ids of the letters that it should get."""
    wanted = []
    for n in numbers:
        kind = ("alarm", "trip", "event")[n % 3]
        record = {"id": f"{kind}-{n}", "revision": 1, "kind": "drift", "where": "zero", "t_end": None}
        store.write_entry(kind, record["id"], n, json_line(record))
        if kind in KINDS:
            wanted.append(f"{kind}-{n}-1")
    return wanted


FAULTS = {
    "500": status(500),
    "503": status(503, Retry_After="0"),
    "429": status(429),
    "302": status(302, Location="/other"),
    "401": status(401),
    "cut": cut,
    **{f"wait {wait}": status(503, Retry_After=wait) for wait in ("-3", "soon", "Thu, 01 Jan 1970 00:17:10 GMT")},
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_each_fault_is_retried_in_order(tmp_path: Path, secret_file: Path, fault: Fault) -> None:
    with Receiver([fault, status(200), fault, fault]) as receiver:
        with Sending(tmp_path / "state", receiver.port, secret_file) as sending:
            wanted = tell(sending.store, *range(9))
            assert wait_until(lambda: len(receiver.ids) == len(wanted))
        assert receiver.ids == wanted
        assert receiver.wrong == []
        assert len(receiver.seen) == len(wanted) + 3
    report = sending.webhook.report()
    assert (report.n_delivered, report.n_failed, report.n_dead, report.last_fault) == (len(wanted), 3, 0, None)


def test_through_cuts_failures_restarts_of_the_receiver_and_kills_of_the_sender(
    tmp_path: Path, secret_file: Path
) -> None:
    """Each letter taken; by id each once, and the first of each in its turn."""
    dice = random.Random(18)
    with_store = Store.open(tmp_path / "state")
    wanted = tell(with_store, *range(450))
    with_store.close()
    port = free_port()
    blows = dice.sample(["kill"] * 5 + ["restart"] * 4, 9)
    moments = sorted(dice.sample(range(20, len(wanted) - 20), len(blows)))
    weather = [cut, status(500), status(503), status(429), slow(0.02)]
    with ExitStack() as at_the_end:
        receivers = [Receiver(_some(dice, weather), port)]
        sender = _sender(tmp_path / "state", port, secret_file)
        at_the_end.callback(lambda: _kill(sender))
        for moment, blow in zip(moments, blows, strict=True):
            assert _have_come(moment, receivers), f"stuck before a {blow}"
            if blow == "kill":
                _kill(sender)
                sender = _sender(tmp_path / "state", port, secret_file)
            else:
                receivers[-1].close()  # what it has read by then it may still take
                receivers.append(Receiver(_some(dice, weather), port))
        at_the_end.callback(receivers[-1].close)
        assert _have_come(len(wanted), receivers)
    assert list(dict.fromkeys(letter_id for each in receivers for letter_id, _ in each.taken)) == wanted
    assert [fault for each in receivers for fault in each.wrong] == []


def _have_come(n: int, receivers: list[Receiver]) -> bool:
    return wait_until(lambda: len({letter_id for each in receivers for letter_id in each.ids}) >= n)


def _some(dice: random.Random, weather: list[Fault]) -> list[Fault]:
    return [dice.choice(weather) if dice.random() < 0.15 else status(200) for _ in range(1000)]


def _sender(state: Path, port: int, secret_file: Path) -> "subprocess.Popen[str]":
    process = subprocess.Popen(
        [sys.executable, "-c", SENDER, str(state), str(port), str(secret_file)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "started\n"
    process.stdout.close()
    return process


def _kill(process: "subprocess.Popen[str]") -> None:
    process.kill()
    process.wait()


def test_deliveries_start_when_the_receiver_appears(tmp_path: Path, secret_file: Path) -> None:
    port = free_port()
    with Sending(tmp_path / "state", port, secret_file) as sending:
        wanted = tell(sending.store, *range(6))
        assert wait_until(lambda: "refused" in (sending.webhook.report().last_fault or ""))
        sending.clock_s = 1e6  # however long: who is away gave no answer
        with Receiver(port=port) as receiver:
            assert wait_until(lambda: len(receiver.ids) == len(wanted))
            assert receiver.ids == wanted
    assert sending.webhook.report().n_dead == 0


@pytest.mark.parametrize("fault", [slow(2.0), trickle], ids=["slow", "trickle"])
def test_a_request_that_times_out_is_retried(tmp_path: Path, secret_file: Path, fault: Fault) -> None:
    with (
        Receiver([fault]) as receiver,
        Sending(tmp_path / "state", receiver.port, secret_file, timeout_s=0.3) as sending,
    ):
        wanted = tell(sending.store, 0, 3)
        assert wait_until(lambda: len(receiver.ids) == len(wanted))
        assert receiver.ids == wanted
        assert sending.webhook.report().n_failed == 1


def test_a_permanently_refused_message_does_not_delay_others(tmp_path: Path, secret_file: Path) -> None:
    with (
        Receiver([status(413)]) as receiver,
        Sending(tmp_path / "state", receiver.port, secret_file) as sending,
    ):
        wanted = tell(sending.store, *range(6))
        assert wait_until(lambda: len(receiver.ids) == len(wanted) - 1)
        assert receiver.ids == wanted[1:]
        report = sending.webhook.report()
        assert report.n_dead == 1
        assert sending.kept[0][0] == Event.WEBHOOK_REFUSED.value.replace(" ", "_")
        assert sending.kept[0][1]["id"] == wanted[0]


def test_refused_for_long_enough_the_queue_moves_on(tmp_path: Path, secret_file: Path) -> None:
    """A 404 is of the address, and is waited out; not for ever."""
    with (
        Receiver([status(404)] * 500) as receiver,
        Sending(tmp_path / "state", receiver.port, secret_file) as sending,
    ):
        wanted = tell(sending.store, *range(6))
        assert wait_until(lambda: len(receiver.seen) >= 6)
        assert set(receiver.seen) == {wanted[0]}
        sending.clock_s = 3602.0
        assert wait_until(lambda: sending.webhook.report().n_dead == 1)
        n_seen = len(receiver.seen)
        assert wait_until(lambda: len(receiver.seen) >= n_seen + 9)
        assert sending.webhook.report().n_dead == 1  # each letter has the whole time of its own
        receiver.faults.clear()
        assert wait_until(lambda: receiver.ids[-1:] == wanted[-1:])
        dead = [detail["id"] for _, detail in sending.kept]
    assert dead + receiver.ids == wanted


@pytest.mark.parametrize("code", [400, 401, 403, 422, 500])
def test_no_alarm_is_given_up_at_a_receiver_that_refuses_all(tmp_path: Path, secret_file: Path, code: int) -> None:
    """Its clock or its secret is off: a 400 buried twenty alarms in 32 s."""
    with (
        Receiver([status(code)] * 40) as receiver,
        Sending(tmp_path / "state", receiver.port, secret_file) as sending,
    ):
        wanted = tell(sending.store, *range(20))
        assert wait_until(lambda: len(receiver.ids) == len(wanted))
        assert receiver.ids == wanted
        assert sending.webhook.report().n_dead == 0


def test_retry_after_is_heeded(tmp_path: Path, secret_file: Path) -> None:
    with (
        Receiver([status(503, Retry_After="3600")]) as receiver,
        Sending(tmp_path / "state", receiver.port, secret_file) as sending,
    ):
        tell(sending.store, 0)
        assert wait_until(lambda: sending.webhook.report().n_failed == 1)
        time.sleep(0.2)  # ten times the longest pause without it
        assert len(receiver.seen) == 1


def test_tls_is_checked(tmp_path: Path, secret_file: Path) -> None:
    authority, stranger = trustme.CA(), trustme.CA()
    ca, other = tmp_path / "ca.pem", tmp_path / "other.pem"
    authority.cert_pem.write_to_path(str(ca))
    stranger.cert_pem.write_to_path(str(other))
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    authority.issue_cert("localhost").configure_cert(tls)
    with Receiver(tls=tls) as receiver:
        known = {"url": f"https://localhost:{receiver.port}/hook"}
        with Sending(tmp_path / "wrong", receiver.port, secret_file, ca=other, **known) as sending:
            tell(sending.store, 0)
            assert wait_until(lambda: "CERTIFICATE_VERIFY_FAILED" in (sending.webhook.report().last_fault or ""))
        assert receiver.seen == []
        with Sending(tmp_path / "right", receiver.port, secret_file, ca=ca, **known) as sending:
            wanted = tell(sending.store, 0, 3)
            assert wait_until(lambda: receiver.ids == wanted)
        assert receiver.wrong == []


def test_a_missing_secret_is_reported_until_it_is_back(tmp_path: Path, secret_file: Path) -> None:
    with Receiver() as receiver, Sending(tmp_path / "state", receiver.port, secret_file) as sending:
        secret_file.unlink()
        wanted = tell(sending.store, 0)
        assert wait_until(lambda: "secret_file" in (sending.webhook.report().last_fault or ""))
        secret_file.write_text(SECRET_TEXT)
        assert wait_until(lambda: receiver.ids == wanted)
