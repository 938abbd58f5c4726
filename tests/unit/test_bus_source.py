"""The live source against interfaces that fail in every way real ones do."""

import errno
import threading
import time

import can
import pytest
from support.encoded import frames_of
from support.log import logged, names
from support.patience import PATIENCE_S, wait_until

from gateway.bus import listen as source_module
from gateway.bus.frames import empty_frames
from gateway.bus.listen import LiveSource, SourceState
from gateway.bus.receiver import Burst
from gateway.bus.signals import load_signal_map
from gateway.errors import BusError
from gateway.log import Event

MAP = load_signal_map("springscale:reference")


def frames(n, first_ns=0):
    return frames_of((first_ns + i, 0x130, bytes(4)) for i in range(n))


class ScriptedInterface:
    """Stands in for an interface: plays a script of bursts and faults, then stays silent.

    An exception in the script is raised by receive; wrapped in ``AtOpening`` it is raised by opening.
    """

    def __init__(self, *script):
        self.script = list(script)
        self.n_opened = 0
        self.n_closed = 0
        self.dropped_kernel = 0
        self.is_played = threading.Event()

    def open(self):
        if self.script and isinstance(self.script[0], AtOpening):
            raise self.script.pop(0).fault
        self.n_opened += 1
        return self

    def receive(self, timeout_s):
        if not self.script:
            self.is_played.set()
            time.sleep(0.01)
            return Burst(empty_frames(8))
        if isinstance(self.script[0], AtOpening):
            raise OSError(errno.ENETDOWN, "Network is down")
        step = self.script.pop(0)
        if isinstance(step, BaseException):
            raise step
        return step

    def close(self):
        self.n_closed += 1


class AtOpening:
    def __init__(self, fault):
        self.fault = fault


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch):
    monkeypatch.setattr(source_module, "FIRST_PAUSE_S", 0.001)
    monkeypatch.setattr(source_module, "LONGEST_PAUSE_S", 0.002)


@pytest.fixture
def listen():
    started = []

    def listen(*script, silence_s=2.0 * PATIENCE_S, **options):
        interface = ScriptedInterface(*script)
        source = LiveSource("socketcan", "can9", MAP, open_receiver=interface.open, silence_s=silence_s, **options)
        started.append(source)
        source.start()
        return source, interface

    yield listen
    for source in started:
        source.stop()


def wait_for(condition):
    assert wait_until(condition), "waited in vain"


def test_a_full_inbox_shows_in_the_counts(listen):
    source, interface = listen(Burst(frames(2000)), inbox_frames=1500)
    assert interface.is_played.wait(PATIENCE_S)
    assert source.counts().dropped_inbox == 500


FAULTS = {
    "interface down": (OSError(errno.ENETDOWN, "Network is down"), "the interface is down: ip link set can9 up"),
    "interface removed": (OSError(errno.ENODEV, "No such device"), "does not exist"),
    "driver error": (can.CanOperationError("adapter unplugged"), "adapter unplugged"),
    "driver error with a system number": (can.CanOperationError("x", errno.ENETDOWN), "interface is down"),
    "no permission": (PermissionError(errno.EPERM, "Operation not permitted"), "no permission"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_while_receiving_is_told_and_the_channel_opened_again(fault, listen):
    error, told = FAULTS[fault]
    source, interface = listen(Burst(frames(1)), error, error, Burst(frames(1)))
    assert interface.is_played.wait(PATIENCE_S)
    assert (interface.n_opened, interface.n_closed) == (3, 2)
    assert source.counts().reconnects == 2
    assert source.counts().frames == 2
    assert source.state is SourceState.RECEIVING
    assert source.failure is None
    assert told in source_module.system_reason(error, source._channel)


class Pauses(threading.Event):
    """A stop that takes no time to wait for: it notes how long it was waited for, and comes after ``n`` waits."""

    def __init__(self, n):
        super().__init__()
        self.asked_s = []
        self._n = n

    def wait(self, timeout=None):
        self.asked_s.append(timeout)
        if len(self.asked_s) == self._n:
            self.set()
        return self.is_set()


def test_a_failing_channel_is_retried_with_pauses(monkeypatch):
    monkeypatch.setattr(source_module, "FIRST_PAUSE_S", 0.25)
    monkeypatch.setattr(source_module, "LONGEST_PAUSE_S", 5.0)
    missing = ScriptedInterface(*[AtOpening(OSError(errno.ENODEV, "No such device"))] * 7)
    source = LiveSource("socketcan", "can9", MAP, open_receiver=missing.open)
    source._stopping = pauses = Pauses(7)
    source.start()
    wait_for(lambda: source.state is SourceState.STOPPED)
    assert pauses.asked_s == [0.5, 1.0, 2.0, 4.0, 5.0, 5.0, 5.0]


def test_a_bus_with_only_unmapped_frames_is_distinguished_from_a_silent_one(listen, monkeypatch):
    packets = iter(range(1000, 10**9, 10))
    monkeypatch.setattr(source_module, "packets_received", lambda channel: next(packets))
    source, _ = listen(Burst(frames(1)), silence_s=0.02)
    wait_for(lambda: source.reason and "none has a mapped identifier" in source.reason)
    assert source.state is SourceState.BUS_SILENT


def test_bus_off_is_a_fault_until_frames_come_again(listen):
    bus_off = Burst(empty_frames(8), error_frames=1, is_bus_off=True)
    source, interface = listen(Burst(frames(1)), bus_off, Burst(empty_frames(8)))
    assert interface.is_played.wait(PATIENCE_S)
    assert source.state is SourceState.READER_FAULT
    assert source.reason == "bus-off: ip link set can9 type can restart-ms 100"
    assert source.counts().error_frames == 1
    interface.script.append(Burst(frames(1)))
    wait_for(lambda: source.state is SourceState.RECEIVING)


def test_an_exception_in_the_thread_becomes_a_reader_fault(listen):
    source, interface = listen(Burst(frames(1)), ZeroDivisionError("a bug"))
    wait_for(lambda: source.reason and "the receive thread died" in source.reason)
    assert isinstance(source.failure, ZeroDivisionError)
    assert source.state is SourceState.READER_FAULT
    assert interface.n_closed == 1
    assert len(source.inbox.drain(PATIENCE_S)) == 1  # what had come is not lost, and nobody waits for more
    assert source.inbox.drain(PATIENCE_S) is None


def test_a_driver_that_is_not_installed_kills_the_source_with_a_clear_word(listen):
    source, _ = listen(AtOpening(BusError("interface 'pcan' cannot be used here")))
    assert isinstance(source.failure, BusError)


def test_kernel_drops_are_summed_over_reconnects(listen):
    source, interface = listen(Burst(frames(1)), OSError(errno.ENETDOWN, "down"), Burst(frames(1)))
    interface.dropped_kernel = 7
    wait_for(lambda: interface.n_opened == 2 and source.counts().dropped_kernel >= 7)


def test_stopping_closes_the_channel(listen):
    source, interface = listen(Burst(frames(1)))
    source.stop()
    assert source.state is SourceState.STOPPED
    assert interface.n_closed == 1
    assert source.failure is None


def test_options_an_interface_does_not_take_are_told():
    source = LiveSource("socketcand", "can0", MAP)
    source.start()
    wait_for(lambda: source.reason)
    assert source.state is SourceState.READER_FAULT
    source.stop()


def test_the_log_tells_when_the_bus_goes_and_comes_and_why(listen, caplog):
    caplog.set_level("INFO", "gateway")
    down, gone = OSError(errno.ENETDOWN, "Network is down"), OSError(errno.ENODEV, "No such device")
    source, interface = listen(
        Burst(frames(1)),
        Burst(frames(1)),
        down,
        AtOpening(down),
        AtOpening(gone),
        Burst(empty_frames(8)),
        silence_s=0.02,
    )
    wait_for(lambda: source.state is SourceState.BUS_SILENT)
    interface.script.append(Burst(frames(1)))
    wait_for(lambda: source.counts().frames == 3)
    source.stop()
    assert names(caplog)[:6] == [
        Event.BUS_RECEIVING,
        Event.BUS_FAULT,  # down; that it stays so is no news
        Event.BUS_FAULT,  # gone
        Event.BUS_REOPENED,
        Event.BUS_SILENT,
        Event.BUS_RECEIVING,
    ]
    told = [fields for event, fields in logged(caplog) if event is Event.BUS_FAULT]
    assert [fields["reason"].partition(":")[0] for fields in told] == [
        "the interface is down",
        "the interface does not exist (not plugged in, or removed)",
    ]
    assert all((fields["interface"], fields["channel"]) == ("socketcan", "can9") for fields in told)


def test_an_unknown_interface_names_the_known():
    with pytest.raises(BusError, match=r"'sockercan' is unknown; known are .*socketcan"):
        LiveSource("sockercan", "can0", MAP)
