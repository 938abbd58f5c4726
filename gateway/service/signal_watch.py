"""Observation of the decoded rows: when each signal was last received, and whether the vehicle stands."""

import time
from collections.abc import Callable
from typing import Final

import numpy as np

from gateway.core.fusion import STOP_THAT_ENDS_EPOCH_S
from gateway.estimates.batch_estimate import Estimate
from gateway.records import F64, I64, STATIC, Motion, Signal
from gateway.units import NS_PER_S


class SignalWatch:
    """When each signal was last received and how often, for the status page. Written by one thread, read by any."""

    def __init__(self, signals: tuple[Signal, ...]) -> None:
        self.last_heard: dict[Signal, float] = {}
        self.rate_hz: dict[Signal, float] = {}
        self._signals = signals
        self._window: dict[Signal, tuple[int, int]] = {}  # first stamp and count since
        self.readings: dict[Signal, float] = {}  # last value of each static signal, in SI

    def saw(self, motion: Motion) -> None:
        """Note which signals these rows carry."""
        now = time.monotonic()
        for column, signal in enumerate(self._signals):
            known = np.isfinite(motion.columns[:, column])
            if not known.any():
                continue
            if signal in STATIC:
                self.readings[signal] = float(motion.columns[known, column][-1])
            self.last_heard[signal] = now
            newest_ns = int(motion.t_ns[known][-1])
            first_ns, n = self._window.get(signal, (newest_ns, 0))
            n += int(np.count_nonzero(known))
            elapsed_s = (newest_ns - first_ns) / NS_PER_S
            if elapsed_s >= 2.0 or elapsed_s < 0.0:
                self.rate_hz[signal] = max(0.0, n / elapsed_s) if elapsed_s > 0.0 else 0.0
                first_ns, n = newest_ns, 0
            self._window[signal] = (first_ns, n)


STANDS_AFTER_S: Final = 10.0  # chosen: shorter stops are traffic, as in core.journey
CLOCK_PUT_BACK_S: Final = 1.0  # chosen: after a larger step back the length of the stop is unknown


class StandingWatch:
    """How long the vehicle stands, and when it last stood long enough to load. Written by one thread, read by any.

    The time before the first row is unknown and counts as a stop.
    """

    def __init__(self, standstill_speed_mps: float, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._standstill_speed_mps = standstill_speed_mps
        self._clock_s = clock_s
        self._begun_s = clock_s()
        self._moved_ns: int | None = None  # last sample that moved, by the frames' time
        self._moved_s: float | None = None  # likewise by ours
        self._newest_ns: int | None = None
        self.last_stop_ns: int | None = None  # its begin, by the frames' time; None: it has not moved yet

    def saw(self, motion: Motion) -> None:
        """Process rows, in order of arrival."""
        if not len(motion):
            return
        if self._moved_ns is None:
            self._moved_ns = int(motion.t_ns[0])
        t_ns, speed_mps = _speed_of(motion)
        if not t_ns.size:
            return
        self._newest_ns = int(t_ns[-1])
        moving_ns = t_ns[speed_mps >= self._standstill_speed_mps]
        if not moving_ns.size:
            return
        before_ns = np.r_[self._moved_ns, moving_ns[:-1]]
        paused_s = (moving_ns - before_ns) / NS_PER_S
        is_long = (paused_s >= STOP_THAT_ENDS_EPOCH_S) | (paused_s < -CLOCK_PUT_BACK_S)
        if self.last_stop_ns is None:
            self.last_stop_ns = self._moved_ns
        if is_long.any():
            last = int(np.flatnonzero(is_long)[-1])
            self.last_stop_ns = int(min(before_ns[last], moving_ns[last]))
        self._moved_ns, self._moved_s = int(moving_ns[-1]), self._clock_s()

    def stood_s(self) -> float | None:
        """Seconds of standstill so far; None while the vehicle drives. A sleeping bus counts as a standstill."""
        silent_s = self._clock_s() - (self._begun_s if self._moved_s is None else self._moved_s)
        told_s = 0.0
        if self._newest_ns is not None and self._moved_ns is not None and self._moved_s is not None:
            told_s = (self._newest_ns - self._moved_ns) / NS_PER_S
        stood_s = max(silent_s, told_s)
        return stood_s if self._moved_s is None or stood_s >= STANDS_AFTER_S else None

    def is_of_this_load(self, estimate: Estimate) -> bool:
        """Whether the whole estimate is from after the last stop that was long enough to load or unload."""
        return self.last_stop_ns is not None and estimate.t_start_ns >= self.last_stop_ns


def _speed_of(motion: Motion) -> tuple[I64, F64]:
    """Times and speeds; the wheel speed if there is no other, as for batches."""
    t_ns, speed_mps = motion.of(Signal.SPEED)
    return (t_ns, speed_mps) if t_ns.size else motion.of(Signal.WHEEL_SPEED)
