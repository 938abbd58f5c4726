"""One table over every path that is tried again: a hundred failures leave no descriptor, thread or memory behind."""

import errno
import gc
import socket
import threading
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest
import trustme
from can.interfaces.socketcan import socketcan
from support.encoded import frames_of
from support.estimates import make_record
from support.patience import PATIENCE_S, wait_until
from support.ports import free_port
from support.receiver import SECRET_TEXT, Receiver, cut, status

from gateway.bus import feeder as feeder_module
from gateway.bus import listen as live
from gateway.bus.feeder import Feeder, Gpsd
from gateway.bus.listen import LiveSource
from gateway.bus.ring_log import RingLog
from gateway.bus.signals import load_signal_map
from gateway.log import LOGGER
from gateway.part import BackOff
from gateway.records import json_line
from gateway.store import Store
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import UplinkSettings, WebhookSettings
from gateway.uplink.uplink import Uplink
from gateway.uplink.webhook import Webhook

N_WARM, N_TRIES = 30, 100
MOST_BYTES_PER_TRY = 1000
CONNACK, REFUSED = b"\x20\x03\x00\x00\x00", b"\x20\x03\x00\x87\x00"

Tried = Callable[[], int]


@contextmanager
def serving(*answers: bytes) -> Iterator[int]:
    """A port at which each connection is answered so, one answer for each piece that it sends, and then closed."""
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def serve() -> None:
            with suppress(OSError):
                while True:
                    near, _ = listening.accept()
                    with near, suppress(OSError):
                        for answer in answers:
                            near.recv(65_536)
                            near.sendall(answer)
                        near.recv(1024)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield listening.getsockname()[1]
        listening.shutdown(socket.SHUT_RDWR)
    thread.join(PATIENCE_S)


class Tries:
    """Counts the calls of what it stands before."""

    def __init__(self, calls: Callable[..., object]) -> None:
        self.n = 0
        self._calls = calls

    def __call__(self, *arguments: object, **named: object) -> object:
        self.n += 1
        return self._calls(*arguments, **named)


@contextmanager
def forwarding(folder: Path, port: int, **changed: object) -> Iterator[Tried]:
    """An uplink with something to deliver to this port."""
    store = Store.open(folder / "state")
    store.write_estimate(make_record(1))
    known = {"host": "127.0.0.1", "port": port, "topic": "springscale/van-17", "client_id": "van-17", "tls": False}
    settings = UplinkSettings(**{**known, **changed})
    uplink = Uplink(settings, Outbox(store, "fleet"), {}, BackOff(0.001, 0.001))
    tries = Tries(uplink._before_connecting)
    uplink._before_connecting = tries  # type: ignore[method-assign, assignment] # counted
    uplink.start()
    yield lambda: tries.n
    uplink.stop(PATIENCE_S)
    store.close()


@contextmanager
def a_broker_that_is_away(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    with forwarding(folder, free_port()) as tried:
        yield tried


@contextmanager
def a_broker_that_refuses(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    with serving(REFUSED) as port, forwarding(folder, port) as tried:
        yield tried


@contextmanager
def a_broker_that_hangs_up(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    with serving(CONNACK) as port, forwarding(folder, port) as tried:
        yield tried


@contextmanager
def a_broker_of_another_authority(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    trustme.CA().cert_pem.write_to_path(folder / "ca.pem")
    with serving(b"this is no handshake") as port, forwarding(folder, port, tls=True, ca=folder / "ca.pem") as tried:
        yield tried


@contextmanager
def a_password_file_that_is_gone(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    """An uplink whose password file does not exist: each attempt once left a descriptor behind."""
    with forwarding(folder, free_port(), username="van", password_file=folder / "gone") as tried:
        yield tried


@contextmanager
def pushing(folder: Path, port: int, secret: str | None = SECRET_TEXT) -> Iterator[Tried]:
    """A webhook with something to deliver to this port."""
    if secret is not None:
        (folder / "secret").write_text(secret)
    store = Store.open(folder / "state")
    store.write_entry("alarm", "alarm-1", 1, json_line({"id": "alarm-1", "revision": 1, "kind": "a", "where": "b"}))
    settings = WebhookSettings(url=f"http://127.0.0.1:{port}/", secret_file=folder / "secret", send=("alarms",))
    webhook = Webhook(settings, Outbox(store, "hook", only=("alarm",)), back_off=BackOff(0.001, 0.001))
    webhook.start()
    yield lambda: webhook.report().n_failed
    webhook.stop(PATIENCE_S)
    store.close()


@contextmanager
def a_receiver_that_is_away(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    with pushing(folder, free_port()) as tried:
        yield tried


@contextmanager
def a_receiver_that_fails(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    with Receiver([status(500), cut, status(302)] * N_TRIES) as receiver, pushing(folder, receiver.port) as tried:
        yield tried


@contextmanager
def a_secret_that_is_gone(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    with pushing(folder, free_port(), secret=None) as tried:
        yield tried


@contextmanager
def listening(patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    patch.setattr(live, "FIRST_PAUSE_S", 0.0005)
    patch.setattr(live, "LONGEST_PAUSE_S", 0.001)
    source = LiveSource("socketcan", "can9", load_signal_map("springscale:reference"))
    source.start()
    yield lambda: source.counts().reconnects
    source.stop(PATIENCE_S)


@contextmanager
def an_interface_that_is_gone(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    def gone(*_: object) -> None:
        raise OSError(errno.ENODEV, "No such device")

    patch.setattr(socketcan, "create_socket", lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    patch.setattr(socketcan, "bind_socket", gone)
    with listening(patch) as tried:
        yield tried


@contextmanager
def an_interface_that_goes_down(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    def down(self: object, timeout: float | None) -> None:
        raise OSError(errno.ENETDOWN, "Network is down")

    patch.setattr(socketcan, "create_socket", lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    patch.setattr(socketcan, "bind_socket", lambda sock, channel: None)
    patch.setattr(socketcan.SocketcanBus, "_apply_filters", lambda self, filters: None)
    patch.setattr(socketcan.SocketcanBus, "_recv_internal", down)
    with listening(patch) as tried:
        yield tried


@contextmanager
def feeding(patch: pytest.MonkeyPatch, interface: str, gps: Gpsd | None) -> Iterator[None]:
    patch.setattr(feeder_module, "RETRY_S", 0.001)
    feeder = Feeder(interface, "retries", [], gps)
    thread = threading.Thread(target=feeder.run)
    thread.start()
    yield
    feeder.stop()
    thread.join(PATIENCE_S)


@contextmanager
def a_bus_that_the_feeder_cannot_open(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    tries = Tries(feeder_module.BusSink)
    patch.setattr(feeder_module, "BusSink", tries)
    with feeding(patch, "socketcan", None):
        yield lambda: tries.n


@contextmanager
def a_gpsd_that_hangs_up(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    with serving() as port:
        gps = Gpsd("127.0.0.1", port)
        tries = Tries(gps.read)
        gps.read = tries  # type: ignore[method-assign, assignment] # counted
        with feeding(patch, "virtual", gps):
            yield lambda: tries.n


@contextmanager
def a_disk_that_takes_no_frames(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Tried]:
    (folder / "record").write_text("a file where the folder should be")
    log = RingLog(folder / "record", "can0", 10**9, 0, write_s=0.001)
    tries = Tries(log._write_held)
    patch.setattr(log, "_write_held", tries)
    log.start()
    log.put(frames_of([(1000, 0x120, bytes(8))]))
    yield lambda: tries.n
    log.stop(PATIENCE_S)


PATHS = [
    a_broker_that_is_away,
    a_broker_that_refuses,
    a_broker_that_hangs_up,
    a_broker_of_another_authority,
    a_password_file_that_is_gone,
    a_receiver_that_is_away,
    a_receiver_that_fails,
    a_secret_that_is_gone,
    an_interface_that_is_gone,
    an_interface_that_goes_down,
    a_bus_that_the_feeder_cannot_open,
    a_gpsd_that_hangs_up,
    a_disk_that_takes_no_frames,
]


def descriptors() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


# paho leaves the socket of a handshake that failed to the garbage collector, python-can that of a missing interface
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.__name__)
def test_a_hundred_failures_leave_nothing_behind(
    path: Callable[..., Iterator[Tried]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(LOGGER, "disabled", True)  # pytest keeps what is logged
    with ExitStack() as at_the_end:
        tracemalloc.start()
        at_the_end.callback(tracemalloc.stop)
        tried = at_the_end.enter_context(path(tmp_path, monkeypatch))  # type: ignore[arg-type] # a context manager
        assert wait_until(lambda: tried() >= N_WARM)
        gc.collect()
        n_descriptors, n_threads = descriptors(), threading.active_count()
        before, _ = tracemalloc.get_traced_memory()
        n_before = tried()
        assert wait_until(lambda: tried() >= n_before + N_TRIES)
        n_more_descriptors, n_more_threads = descriptors() - n_descriptors, threading.active_count() - n_threads
        gc.collect()
        grown, _ = tracemalloc.get_traced_memory()
    assert n_more_descriptors < N_TRIES // 10
    assert n_more_threads < N_TRIES // 10
    assert grown - before < MOST_BYTES_PER_TRY * N_TRIES, grown - before
