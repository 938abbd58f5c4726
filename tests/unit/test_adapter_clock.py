"""Adapters whose stamps count from their own start, as python-can hands them on: dated, and continued over a wrap."""

import time

import can
import numpy as np
import pytest
from support.log import logged
from support.patience import wait_until

from gateway.bus.frames import ExactStamp
from gateway.bus.live.adapter_clock import COUNTER_S
from gateway.bus.live.python_can import PythonCanReceiver
from gateway.bus.live.source import LiveSource
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
    monkeypatch.setattr("gateway.bus.live.python_can.time.time", clock.time)
    monkeypatch.setattr("gateway.bus.live.python_can.time.time_ns", clock.time_ns)
    return clock


TICK_S = {"gs_usb": 1e-6, "canalystii": 1e-4, "serial": 1e-3, "systec": 1e-3}


def ticks(start: int, interface: str, times_s: np.ndarray) -> np.ndarray:
    """Stamps (n,) in s of a 32-bit counter that stands at ``start`` at time 0."""
    return (start + np.round(times_s / TICK_S[interface]).astype(np.int64)) % 2**32 * TICK_S[interface]


STEADY_S = np.arange(N) * PERIOD_S
PARKED_S = np.where(np.arange(N) < N // 2, STEADY_S, STEADY_S + 11_000.0)  # longer than two turns of gs_usb's counter
BEFORE_WRAP = 2**32 - 1
CASES = {  # interface, stamps (n,), arrivals after NOW_S (n,), times the clock is set, wraps
    **{f"{name} begins": (name, ticks(1000, name, STEADY_S), STEADY_S, 1, 0) for name in TICK_S},
    **{
        f"{name} wraps": (name, ticks(BEFORE_WRAP - round(1.995 / TICK_S[name]), name, STEADY_S), STEADY_S, 1, 1)
        for name in TICK_S
    },
    "gs_usb wraps while parked": ("gs_usb", ticks(1000, "gs_usb", PARKED_S), PARKED_S, 2, None),
    "gs_usb is replugged": ("gs_usb", 100.0 + STEADY_S - 99.0 * (np.arange(N) >= N // 2), STEADY_S, 2, 0),
    "pcan since the computer's start": ("pcan", 86_400.0 + STEADY_S, STEADY_S, 1, 0),
    "pcan since 1970": ("pcan", NOW_S + STEADY_S, STEADY_S, 0, 0),
    "slcan": ("slcan", NOW_S + STEADY_S, STEADY_S, 0, 0),
    "usb2can in milliseconds": ("usb2can", 1000.0 * (1.0 + STEADY_S), STEADY_S, 0, 0),
    "usb2can in microseconds": ("usb2can", 1e6 * (600.0 + STEADY_S), STEADY_S, 0, 0),
    "the system's clock learns the date": ("gs_usb", 7.0 + STEADY_S, STEADY_S + 1e6 * (np.arange(N) > 9), 2, 0),
    "a driver hands two frames over in the wrong order": (
        "gs_usb",
        ticks(BEFORE_WRAP - 2_000_000, "gs_usb", np.where(np.arange(N) % 2 == 0, STEADY_S + 0.02, STEADY_S)),
        STEADY_S,
        1,
        1,
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_an_adapters_own_clock_is_dated(case: str, clock: Clock) -> None:
    interface, stamps_s, after_s, n_sets, n_wraps = CASES[case]
    bus = FakeBus(clock, list(zip((NOW_S + after_s).tolist(), stamps_s.tolist(), strict=True)))
    receiver = PythonCanReceiver(bus, 8, interface=interface)  # type: ignore[arg-type] # as much as is asked
    bursts = [receiver.receive(1.0) for _ in range(N)]
    t_s = np.concatenate([burst.frames.t_ns for burst in bursts]) / 1e9
    assert len(t_s) == N
    assert np.abs(t_s - NOW_S - after_s).max() < 0.03
    assert sum(burst.n_clock_sets for burst in bursts) == n_sets
    if n_wraps is not None:
        assert sum(burst.n_clock_wraps for burst in bursts) == n_wraps


@pytest.mark.parametrize("interface", TICK_S)
def test_a_wrap_is_exact_whatever_the_delay_of_the_frames(interface: str, clock: Clock) -> None:
    """Steps of the stamps, not of the arrivals, which a USB hub delays by up to 0.1 s."""
    stamps_s = ticks(BEFORE_WRAP - round(1.995 / TICK_S[interface]), interface, STEADY_S)
    late_s = np.random.default_rng(1).uniform(0.0, 0.1, N)
    arrivals_s = np.maximum.accumulate(NOW_S + STEADY_S + late_s)
    receiver = PythonCanReceiver(FakeBus(clock, list(zip(arrivals_s, stamps_s, strict=True))), 8, interface=interface)
    t_ns = np.concatenate([receiver.receive(1.0).frames.t_ns for _ in range(N)])
    np.testing.assert_allclose(np.diff(t_ns) / 1e9, PERIOD_S, atol=1.01 * max(TICK_S[interface], 1e-6))


def test_every_known_counter_is_of_32_bits() -> None:
    assert {name: 2**32 * tick_s for name, tick_s in TICK_S.items()} == COUNTER_S


def test_recorded_stamps_of_an_undated_log_stay_exact(clock: Clock) -> None:
    """A replay on the in-process bus gives the batches of the log itself."""
    bus = FakeBus(clock, [(NOW_S, ExactStamp(t_ns)) for t_ns in (0, 0, 123_456_789)])
    burst = PythonCanReceiver(bus, 8).receive(1.0)  # type: ignore[arg-type] # as above
    assert (burst.frames.t_ns.tolist(), burst.n_clock_sets) == ([0, 0, 123_456_789], 0)


def test_the_counts_and_the_log_say_so(clock: Clock, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "gateway")
    stamps_s = ticks(BEFORE_WRAP - 1_995_000, "gs_usb", STEADY_S)
    bus = FakeBus(clock, list(zip((NOW_S + STEADY_S).tolist(), stamps_s.tolist(), strict=True)))
    receiver = PythonCanReceiver(bus, 8, interface="gs_usb")  # type: ignore[arg-type] # as above
    source = LiveSource("virtual", "adapter", MAP, open_receiver=lambda: receiver)
    source.start()
    assert wait_until(lambda: source.counts().frames == N)
    source.stop()
    counts = source.counts()
    assert (counts.clock_sets, counts.clock_wraps) == (1, 1)
    told = [fields for event, fields in logged(caplog) if event is Event.ADAPTER_CLOCK]
    assert [(one["n_sets"], one["n_wraps"]) for one in told] == [(1, 0), (0, 1)]
    assert told[0]["first_frame"] == time.strftime("%Y-%m-%dT%H:%M:%S.000000Z", time.gmtime(NOW_S))
