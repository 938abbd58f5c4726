"""Adapters whose stamps count from their own start, as python-can hands them on, get dates of the system's clock."""

import time

import can
import numpy as np
import pytest
from support.log import logged
from support.patience import wait_until

from gateway.bus.frames import ExactStamp
from gateway.bus.listen import LiveSource
from gateway.bus.receiver import Receiver
from gateway.bus.signals import load_signal_map
from gateway.log import Event

NOW_S = 1_790_000_000.0
PERIOD_S = 0.01
N = 400
MAP = load_signal_map("springscale:reference")


class FakeBus:
    """An adapter: each message comes at its time of the system's clock, with the adapter's stamp."""

    def __init__(self, clock: "Clock", frames: list[tuple[float, float]]) -> None:
        self.clock, self.frames = clock, list(frames)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if not self.frames or (not timeout and self.frames[0][0] > self.clock.now_s):
            return None
        arrives_s, stamp_s = self.frames.pop(0)
        self.clock.now_s = max(self.clock.now_s, arrives_s)
        return can.Message(timestamp=stamp_s, arbitration_id=0x120, is_extended_id=False, data=bytes(8))

    def shutdown(self) -> None:
        """Does nothing: no device is open."""


class Clock:
    """The system's clock."""

    def __init__(self) -> None:
        self.now_s = NOW_S

    def time(self) -> float:
        return self.now_s

    def time_ns(self) -> int:
        return round(self.now_s * 1e9)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("gateway.bus.receiver.time.time", clock.time)
    monkeypatch.setattr("gateway.bus.receiver.time.time_ns", clock.time_ns)
    return clock


TICK_S = {"gs_usb": 1e-6, "canalystii": 1e-4, "serial": 1e-3, "systec": 1e-3}


def ticks(start: int, interface: str, times_s: np.ndarray) -> np.ndarray:
    """Stamps (n,) in s of a 32-bit counter that stands at ``start`` at time 0."""
    return (start + np.round(times_s / TICK_S[interface]).astype(np.int64)) % 2**32 * TICK_S[interface]


STEADY_S = np.arange(N) * PERIOD_S
PARKED_S = np.where(np.arange(N) < N // 2, STEADY_S, STEADY_S + 11_000.0)  # longer than two turns of gs_usb's counter
BEFORE_WRAP = 2**32 - 1
CASES = {  # stamps (n,), arrivals after NOW_S (n,), times the clock is set
    **{f"{name} begins": (ticks(1000, name, STEADY_S), STEADY_S, 1) for name in TICK_S},
    **{
        f"{name} begins again at 0": (ticks(BEFORE_WRAP - round(1.995 / TICK_S[name]), name, STEADY_S), STEADY_S, 2)
        for name in TICK_S
    },
    "gs_usb begins again while parked": (ticks(1000, "gs_usb", PARKED_S), PARKED_S, 2),
    "gs_usb is replugged": (100.0 + STEADY_S - 99.0 * (np.arange(N) >= N // 2), STEADY_S, 2),
    "pcan since the computer's start": (86_400.0 + STEADY_S, STEADY_S, 1),
    "neovi since 2007": (1_167_609_600.0 + 86_400.0 + STEADY_S, STEADY_S, 1),
    "ixxat of python-can 4.6.1": (1.5 * NOW_S + 142.0 + STEADY_S, STEADY_S, 1),
    "stamps since 1970": (NOW_S + STEADY_S, STEADY_S, 0),
    "usb2can in milliseconds": (1000.0 * (1.0 + STEADY_S), STEADY_S, N),
    "the system's clock learns the date": (7.0 + STEADY_S, STEADY_S + 1e6 * (np.arange(N) > 9), 2),
}


@pytest.mark.parametrize("case", CASES)
def test_an_adapters_own_clock_is_dated(case: str, clock: Clock) -> None:
    stamps_s, after_s, n_sets = CASES[case]
    bus = FakeBus(clock, list(zip((NOW_S + after_s).tolist(), stamps_s.tolist(), strict=True)))
    receiver = Receiver(bus, 8)  # type: ignore[arg-type] # as much as is asked
    bursts = [receiver.receive(1.0) for _ in range(N)]
    t_s = np.concatenate([burst.frames.t_ns for burst in bursts]) / 1e9
    assert len(t_s) == N
    assert np.abs(t_s - NOW_S - after_s).max() < 0.03
    assert sum(burst.clock_sets for burst in bursts) == n_sets


def test_recorded_stamps_of_an_undated_log_stay_exact(clock: Clock) -> None:
    """A replay on the in-process bus gives the batches of the log itself."""
    bus = FakeBus(clock, [(NOW_S, ExactStamp(t_ns)) for t_ns in (0, 0, 123_456_789)])
    burst = Receiver(bus, 8).receive(1.0)  # type: ignore[arg-type] # as above
    assert (burst.frames.t_ns.tolist(), burst.clock_sets) == ([0, 0, 123_456_789], 0)


def test_the_counts_and_the_log_say_so(clock: Clock, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "gateway")
    stamps_s = ticks(BEFORE_WRAP - 1_995_000, "gs_usb", STEADY_S)
    bus = FakeBus(clock, list(zip((NOW_S + STEADY_S).tolist(), stamps_s.tolist(), strict=True)))
    receiver = Receiver(bus, 8)  # type: ignore[arg-type] # as above
    source = LiveSource("virtual", "adapter", MAP, open_receiver=lambda: receiver)
    source.start()
    assert wait_until(lambda: source.counts().frames == N)
    source.stop()
    counts = source.counts()
    assert counts.clock_sets == 2
    told = [fields for event, fields in logged(caplog) if event is Event.ADAPTER_CLOCK]
    assert [one["n_sets"] for one in told] == [1, 1]
    assert told[0]["first_frame"] == time.strftime("%Y-%m-%dT%H:%M:%S.000000Z", time.gmtime(NOW_S))
