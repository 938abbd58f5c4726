"""Health is what succeeds, not what is quiet: a part that stopped working is a fault until it works again."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import can
import pytest
from support.estimates import make_record
from support.patience import PATIENCE_S, wait_until
from support.small_broker import SmallBroker

from gateway.bus import listen as live_source
from gateway.bus.listen import LiveSource, SourceState
from gateway.bus.receiver import Receiver
from gateway.bus.signals import load_signal_map
from gateway.part import BackOff
from gateway.status import (
    BusStatus,
    RecordStatus,
    State,
    Status,
    StoreStatus,
    UplinkStatus,
    WebhookStatus,
    judged,
)
from gateway.store import Store
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import UplinkSettings
from gateway.uplink.uplink import Uplink

MAP = load_signal_map("springscale:reference")
FRAME_ID = MAP.messages[0].frame_id
GOOD = Status(version="1", state=State.ESTIMATING, uptime_s=1.0, calibration_id="sha256:ab")
BROKER, RECEIVER = UplinkStatus("fleet.example:8883"), WebhookStatus("https://fleet.example:443")
VERDICTS: dict[str, tuple[dict[str, Any], str | None, str | None]] = {  # change, why not ready, warning
    "all is well": ({"uplink": replace(BROKER, is_connected=True), "webhook": RECEIVER}, None, None),
    "a parked vehicle": ({"state": State.WAITING_FOR_BUS}, None, None),
    "an unreadable bus": (
        {"state": State.READER_FAULT, "bus": BusStatus(last_fault="can0: no such device")}, "no such device", None
    ),
    "no calibration": ({"calibration_id": None}, "no calibration", None),
    "a full disk": (
        {"store": StoreStatus("degraded", "disk full", n_held=3)}, "disk full", "memory only (disk full): 3 are not"
    ),
    "a missing table": (
        {"store": StoreStatus("degraded", "no such table")}, "no such table", "memory only (no such table)"
    ),
    "a damaged database": ({"store": StoreStatus(set_aside="a.db.damaged-1")}, None, "a.db.damaged-1"),
    "lost records": ({"store": StoreStatus(n_dropped=2)}, None, "2 records are lost"),
    "a broker that refuses": (
        {"uplink": replace(BROKER, is_connected=True, last_fault="not authorized", n_waiting=4)}, None, "4 wait"
    ),
    "a broker that is away": ({"uplink": replace(BROKER, last_fault="timed out")}, None, "(timed out)"),
    "a receiver that refuses": ({"webhook": replace(RECEIVER, last_fault="403")}, None, "(403)"),
    "a ring log without room": ({"record": RecordStatus(last_fault="no room")}, None, "not being recorded (no room)"),
}  # fmt: skip


@pytest.mark.parametrize("what", VERDICTS)
def test_ready_and_warnings_follow_from_the_status_alone(what: str) -> None:
    change, not_ready, warning = VERDICTS[what]
    told = judged(GOOD.model_copy(update=change), ())
    assert told.is_ready is (not_ready is None)
    assert (not_ready or "") in (told.not_ready_reason or "")
    assert (warning or "") in " ".join(told.warnings)
    assert bool(told.warnings) is (warning is not None)
    for said in told.warnings:
        assert said[1:] in told.state_in_words


class Broker:
    """An uplink to a broker that answers as ``code_of`` says, with three records to deliver."""

    def __init__(self, folder: Path, code_of: Callable[[str], int | None]) -> None:
        self.store = Store.open(folder)
        for n in range(3):
            self.store.write_estimate(make_record(n))
        self.broker = SmallBroker(1 << 20, "puback", code_of=code_of)

    def __enter__(self) -> "Broker":
        self.broker.__enter__()
        settings = UplinkSettings(
            host="127.0.0.1", port=self.broker.port, tls=False, topic="springscale/van-17", client_id="van-17"
        )
        self.uplink = Uplink(settings, Outbox(self.store, "q"), {}, back_off=BackOff(0.01, 0.05))
        self.uplink.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.uplink.stop()
        self.broker.__exit__(None, None, None)
        self.store.close()


NEVER, NOT_AUTHORIZED, QUOTA, INVALID, TAKEN = None, 0x87, 0x97, 0x99, 0x00
BROKERS: dict[str, tuple[Callable[[str], int | None], str]] = {
    "never acknowledges": (lambda topic: NEVER, "did not acknowledge"),
    "acknowledges the birth alone": (
        lambda topic: TAKEN if topic.endswith("/status") else NEVER, "did not acknowledge"
    ),
    "authorizes nothing": (lambda topic: NOT_AUTHORIZED, "Not authorized"),
    "authorizes no estimates": (
        lambda topic: TAKEN if topic.endswith("/status") else NOT_AUTHORIZED, "Not authorized"
    ),
    "has no room": (lambda topic: TAKEN if topic.endswith("/status") else QUOTA, "Quota exceeded"),
    "finds every estimate invalid": (
        lambda topic: TAKEN if topic.endswith("/status") else INVALID, "Payload format invalid"
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", BROKERS)
def test_a_broker_that_takes_nothing_is_a_fault(what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was connected, without a fault."""
    monkeypatch.setattr("gateway.uplink.uplink.ANSWER_TIMEOUT_S", 0.2)
    code_of, fault = BROKERS[what]
    with Broker(tmp_path, code_of) as there:
        assert wait_until(lambda: fault in (there.uplink.report().last_fault or ""))
        assert any(
            fault in said for said in judged(GOOD.model_copy(update={"uplink": there.uplink.report()}), ()).warnings
        )
        there.broker.code_of = lambda topic: TAKEN
        there.store.write_estimate(make_record(9))
        assert wait_until(lambda: there.uplink.report().last_fault is None and there.uplink.report().n_delivered)


def closes(_: SmallBroker) -> bytes:
    raise EOFError


@pytest.mark.parametrize(
    ("greets", "fault"),
    [
        (closes, "closed the connection without an answer"),
        (lambda _: bytes([0x20, 3, 0, NOT_AUTHORIZED, 0]), "refused the connection: Not authorized"),
    ],
)
def test_a_broker_that_takes_no_connection_is_a_fault(
    greets: Callable[[SmallBroker], bytes], fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that closed every connection was tried for ever, and nothing said so."""
    with monkeypatch.context() as patch:
        patch.setattr(SmallBroker, "_connack", greets)
        with Broker(tmp_path, lambda topic: TAKEN) as there:
            assert wait_until(lambda: fault in (there.uplink.report().last_fault or ""))
            patch.undo()
            assert wait_until(lambda: there.uplink.report().n_delivered == 3)
            assert there.uplink.report().last_fault is None


class ScriptedBus:
    """A bus of python-can that gives these messages, then none."""

    def __init__(self, *messages: can.Message | None) -> None:
        self._messages = list(messages)

    def recv(self, timeout_s: float) -> can.Message | None:
        if self._messages:
            return self._messages.pop(0)
        time.sleep(timeout_s)
        return None

    def shutdown(self) -> None: ...


def frame() -> can.Message:
    return can.Message(arbitration_id=FRAME_ID, is_extended_id=False, data=bytes(8), timestamp=time.time())


def remote() -> can.Message:
    return can.Message(arbitration_id=FRAME_ID, is_extended_id=False, is_remote_frame=True, dlc=8)


def error(error_class: int) -> can.Message:
    return can.Message(arbitration_id=error_class, is_error_frame=True, timestamp=time.time())


BUS_OFF, RESTARTED = 0x40, 0x100  # CAN_ERR_BUSOFF and CAN_ERR_RESTARTED of linux/can/error.h
BURSTS = {
    "bus-off behind frames": ([frame(), frame(), error(BUS_OFF)], SourceState.READER_FAULT),
    "bus-off and another error behind frames": ([frame(), error(BUS_OFF), error(0x4)], SourceState.READER_FAULT),
    "bus-off alone": ([error(BUS_OFF)], SourceState.READER_FAULT),
    "frames behind bus-off": ([error(BUS_OFF), error(RESTARTED), frame()], SourceState.BUS_SILENT),
    "another error behind frames": ([frame(), error(0x4)], SourceState.BUS_SILENT),
}


@contextmanager
def listening(receiver: Any, silence_s: float = 0.1) -> Iterator[LiveSource]:
    source = LiveSource("socketcan", "can9", MAP, open_receiver=lambda: receiver, silence_s=silence_s)
    source.start()
    yield source
    source.stop()


@pytest.mark.parametrize("what", BURSTS)
@pytest.mark.parametrize("interface", ["socketcan", "socketcand"])
def test_a_burst_is_judged_by_the_order_of_its_frames_and_errors(what: str, interface: str) -> None:
    messages, state = BURSTS[what]
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with closing(near), closing(far):
        kernel_socket = near if interface == "socketcan" else None
        bus: Any = ScriptedBus(*messages)
        with listening(Receiver(bus, 8, kernel_socket, has_error_classes=True)) as source:
            assert wait_until(lambda: source.state is state)
            assert ("ip link set can9 type can restart-ms 100" in source.reason) is (state is SourceState.READER_FAULT)
            assert source.counts().error_frames == sum(message.is_error_frame for message in messages)


OTHERS: dict[str, tuple[list[can.Message | None], str]] = {  # None ends a burst
    "data and remote frames": (
        [frame(), remote(), frame(), None, remote(), remote()],
        "no data frame for 0.1 s, only 2 remote frames",
    ),
    "remote frames alone": ([remote()] * 5, "no data frame for 0.1 s, only 5 remote frames"),
    "error frames alone": ([error(0x4)] * 4, "only 4 error frames; check the bit rate and the wiring"),
    "an error frame as the bus goes to sleep": (
        [frame(), None, error(0x4)],
        "no data frame for 0.1 s, only 1 error frame",
    ),
    "error and remote frames": ([frame(), None, error(0x4), remote()], "only 1 error frame and 1 remote frame"),
    "data frames last": (
        [remote(), error(0x4), frame()],
        "no frame for 0.1 s: the vehicle is asleep or the channel is not connected",
    ),
}


@pytest.mark.parametrize("what", OTHERS)
def test_every_message_is_counted_and_a_bus_without_data_frames_says_what_it_carries(what: str) -> None:
    bursts, reason = OTHERS[what]
    messages, bus = [one for one in bursts if one], cast(Any, ScriptedBus(*bursts))
    with listening(Receiver(bus, 8)) as source:
        assert wait_until(lambda: source.state is SourceState.BUS_SILENT)
        counts = source.counts()
        assert (source.reason or "").endswith(reason)
    bus_status = BusStatus(last_fault=source.reason)
    status = GOOD.model_copy(update={"state": State.WAITING_FOR_BUS, "bus": bus_status})
    assert status.sentence().startswith(f"No mapped frame comes: {source.reason}. ")
    assert counts.remote_frames == sum(message.is_remote_frame for message in messages)
    assert counts.frames + counts.remote_frames + counts.error_frames == len(messages)


IMPOSSIBLE: dict[str, dict[str, Any]] = {
    "30 bits": {"arbitration_id": 0x2000_0000, "is_extended_id": True},
    "33 bits": {"arbitration_id": 1 << 33, "is_extended_id": True},
    "12 bits of a standard identifier": {"arbitration_id": 0x800, "is_extended_id": False},
    "a negative identifier": {"arbitration_id": -1, "is_extended_id": True},
    "an identifier of text": {"arbitration_id": "120", "is_extended_id": False},
    "65 bytes": {"arbitration_id": FRAME_ID, "is_extended_id": False, "is_fd": True, "data": bytes(65)},
}


@pytest.mark.parametrize("what", IMPOSSIBLE)
def test_a_message_that_no_bus_can_carry_is_counted_as_an_error(what: str) -> None:
    """python-can passes on what an adapter has read in noise; an identifier of 33 bits ended the service."""
    bus: Any = ScriptedBus(frame(), can.Message(timestamp=time.time(), **IMPOSSIBLE[what]), frame())
    with listening(Receiver(bus, 8)) as source:
        assert wait_until(lambda: source.counts().frames == 2)
        assert source.counts().error_frames == 1


@pytest.mark.parametrize("stamp", [None, "12.5", float("nan"), float("inf"), -1.0, 1e300])
def test_a_stamp_that_is_no_time_is_dated_by_the_system(stamp: Any) -> None:
    message = frame()
    message.timestamp = stamp
    bus: Any = ScriptedBus(message)
    with listening(Receiver(bus, 8)) as source:
        (t_ns,) = source.inbox.drain(PATIENCE_S).t_ns.tolist()
    assert abs(t_ns / 1e9 - time.time()) < PATIENCE_S


class NoisyBus(ScriptedBus):
    """Gives its messages; then its parser fails, once."""

    def __init__(self, failure: Exception) -> None:
        super().__init__(frame())
        self._failures = [failure]

    def recv(self, timeout_s: float) -> can.Message | None:
        if not self._messages and self._failures:
            raise self._failures.pop()
        return super().recv(timeout_s)


@pytest.mark.parametrize(
    ("failure", "reason"),
    [
        *(
            (kind("x"), "what the adapter sends cannot be read")
            for kind in (ValueError, IndexError, AttributeError, TypeError)
        ),
        (UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid"), "what the adapter sends cannot be read"),
        (can.CanOperationError("the adapter is gone"), "the adapter is gone"),
        (OSError(5, "Input/output error"), "Input/output error"),
    ],
    ids=lambda one: type(one).__name__,
)
def test_any_exception_of_an_adapter_is_a_fault_and_the_bus_is_reopened(failure: Exception, reason: str) -> None:
    """What came before it is not lost; any but two kinds of exception ended the service."""
    bus: Any = NoisyBus(failure)
    with listening(Receiver(bus, 8), silence_s=30.0) as source:
        assert wait_until(lambda: source.state is SourceState.READER_FAULT)
        assert reason in source.reason
        assert source.counts().frames == 1
        assert source.death() is None


@contextmanager
def socketcand(*, closes: bool) -> Iterator[int]:
    """The port of a server that greets, gives one frame and closes, or falls silent."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        kept: list[socket.socket] = []

        def serve() -> None:
            with suppress(OSError):
                while True:
                    near, _ = server.accept()
                    kept.append(near)
                    near.sendall(b"< hi >")
                    for _ in ("< open >", "< rawmode >"):
                        near.recv(64)
                        near.sendall(b"< ok >")
                    time.sleep(0.1)  # python-can takes an answer and a frame in one piece for a wrong answer
                    near.sendall(f"< frame {FRAME_ID:X} 23.424242 0011223344556677 >".encode())
                    if closes:
                        near.close()

        threading.Thread(target=serve, daemon=True).start()
        yield int(server.getsockname()[1])
        server.shutdown(socket.SHUT_RDWR)
        for near in kept:
            near.close()


@pytest.mark.parametrize(
    ("closes", "state", "reason"),
    [(True, SourceState.READER_FAULT, "closed the connection"), (False, SourceState.BUS_SILENT, "no frame for 0.5 s")],
)
def test_the_end_of_a_connection_is_a_fault_and_no_silence(
    closes: bool, state: SourceState, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bus was silent for ever, the service ready, and python-can took a third of a core."""
    monkeypatch.setattr(live_source, "LONGEST_PAUSE_S", 0.5)
    with socketcand(closes=closes) as port:
        where = {"host": "127.0.0.1", "port": port}
        source = LiveSource("socketcand", "can0", MAP, options=where, silence_s=0.5)
        source.start()
        assert wait_until(lambda: source.state is state and reason in source.reason and source.counts().frames >= 1)
        assert (source.counts().reconnects >= 1) is closes
        source.stop()
