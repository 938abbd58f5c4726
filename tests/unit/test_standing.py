"""Whether the vehicle stands, and whether what was weighed is what is aboard."""

from dataclasses import replace

import numpy as np
import pytest
from support.estimates import make_estimate

from gateway.estimates.batch_estimate import Estimate
from gateway.records import Motion, Signal
from gateway.service.signal_watch import SignalWatch, StandingWatch

S = 1_000_000_000


class Driven:
    """A watch that is fed speeds second by second, and the clock it looks at."""

    def __init__(self, signal: Signal = Signal.SPEED, chunk_s: int = 7) -> None:
        self.now_s, self.t_s = 100.0, 1000
        self._signal, self._chunk_s = signal, chunk_s
        self.watch = StandingWatch(0.5, lambda: self.now_s)

    def at(self, speed_mps: float, for_s: int) -> int:
        """Drive or stand on -> the second at which that began."""
        begun_s = self.t_s
        while for_s > 0:
            n = min(for_s, self._chunk_s)
            t_ns = (self.t_s + np.arange(n)) * S
            self.now_s += n
            self.watch.saw(Motion((self._signal,), t_ns, np.full((n, 1), speed_mps)))
            self.t_s, for_s = self.t_s + n, for_s - n
        return begun_s

    def silence(self, for_s: int) -> None:
        self.t_s, self.now_s = self.t_s + for_s, self.now_s + for_s

    def knows(self, begun_s: int) -> bool:
        """Whether a batch from there on is of the load that is aboard."""
        return self.watch.is_of_this_load(batch(begun_s))


def batch(begun_s: int) -> Estimate:
    return replace(make_estimate(0), t_start_ns=begun_s * S, t_end_ns=(begun_s + 300) * S)


@pytest.mark.parametrize("signal", [Signal.SPEED, Signal.WHEEL_SPEED])
@pytest.mark.parametrize("chunk_s", [1, 7, 1000])
def test_a_stop_long_enough_to_load_makes_earlier_weighings_old(signal: Signal, chunk_s: int) -> None:
    driven = Driven(signal, chunk_s)
    before = driven.at(10.0, 300)
    assert driven.knows(before)
    driven.at(0.0, 90)
    after = driven.at(10.0, 20)
    assert not driven.knows(before)
    assert not driven.knows(after - 120)
    assert driven.knows(after)
    assert driven.watch.stood_s() is None


def test_a_red_light_changes_nothing() -> None:
    driven = Driven()
    before = driven.at(10.0, 300)
    driven.at(0.0, 40)
    driven.at(10.0, 20)
    assert driven.knows(before)


def test_a_bus_that_slept_is_a_vehicle_that_stood() -> None:
    driven = Driven()
    before = driven.at(10.0, 300)
    driven.silence(3600)
    assert driven.watch.stood_s() == pytest.approx(3600.0, abs=2.0)
    driven.at(10.0, 5)
    assert not driven.knows(before)
    assert driven.watch.stood_s() is None


def test_a_vehicle_stands_after_ten_seconds_or_at_the_beginning() -> None:
    driven = Driven(chunk_s=1)
    assert driven.watch.stood_s() == 0.0
    driven.at(0.0, 5)
    assert driven.watch.stood_s() == pytest.approx(5.0)
    driven.at(10.0, 5)
    driven.at(0.2, 9)
    assert driven.watch.stood_s() is None
    driven.at(0.2, 3)
    assert driven.watch.stood_s() == pytest.approx(12.0, abs=1.1)


def test_in_a_replay_the_frames_own_time_counts() -> None:
    driven = Driven(chunk_s=1000)
    driven.at(10.0, 100)
    driven.at(0.0, 30)
    driven.now_s -= 129.0  # all of it came within a second
    assert driven.watch.stood_s() == pytest.approx(30.0, abs=1.1)


def test_a_load_of_an_earlier_run_may_have_been_unloaded() -> None:
    driven = Driven()
    assert not driven.knows(0)
    driven.at(10.0, 5)
    assert not driven.knows(0)
    assert driven.knows(1000)


def test_the_standing_time_is_unknown_after_a_clock_step() -> None:
    driven = Driven()
    before = driven.at(10.0, 300)
    driven.t_s -= 200
    after = driven.at(10.0, 5)
    assert driven.knows(after)
    assert driven.watch.last_stop_ns == after * S
    assert not driven.knows(before - 1000)


def test_the_last_reading_of_the_vehicles_own_sensors_is_kept_and_no_other() -> None:
    signals = (Signal.SPEED, Signal.AXLE_WEIGHT, Signal.AIR_SPRING_PRESSURE)
    watch = SignalWatch(signals)
    nan = np.nan
    watch.saw(Motion(signals, np.arange(3) * S, np.array([[5.0, 800.0, nan], [5.0, nan, 4e5], [6.0, 812.5, nan]])))
    assert watch.readings == {Signal.AXLE_WEIGHT: 812.5, Signal.AIR_SPRING_PRESSURE: 4e5}
