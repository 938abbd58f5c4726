"""Whether the vehicle stands, and whether its load may have changed since the last weighing."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.fusion import STOP_THAT_ENDS_EPOCH_S
from gateway.estimate import Estimate
from gateway.records import F64, I64, Motion, Signal
from gateway.units import NS_PER_S

STANDS_AFTER_S: Final = 10.0  # a shorter stop is traffic, as for core.journey
CLOCK_PUT_BACK_S: Final = 1.0  # nobody knows then how long it stood


@dataclass(frozen=True, slots=True)
class Stop:
    """From the last moving sample to the next one, by the frames' time."""

    begin_ns: int
    end_ns: int


class StandingWatch:
    """Called with every row; written by one thread, read by any.

    The time before the first row is unknown: that counts as a stop.
    """

    def __init__(self, standstill_speed_mps: float, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._standstill_speed_mps = standstill_speed_mps
        self._clock_s = clock_s
        self._begun_s = clock_s()
        self._moved_ns: int | None = None  # last sample that moved, by the frames' time
        self._moved_s: float | None = None  # likewise by ours
        self._newest_ns: int | None = None
        self.last_stop: Stop | None = None  # None: it has not moved yet

    def saw(self, motion: Motion) -> None:
        """Rows in order of arrival."""
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
        if self.last_stop is None:
            self.last_stop = Stop(self._moved_ns, int(moving_ns[0]))
        if is_long.any():
            last = int(np.flatnonzero(is_long)[-1])
            self.last_stop = Stop(int(min(before_ns[last], moving_ns[last])), int(moving_ns[last]))
        self._moved_ns, self._moved_s = int(moving_ns[-1]), self._clock_s()

    def stood_s(self) -> float | None:
        """How long it has stood by now; None while it drives. A bus that sleeps is a vehicle that stands."""
        silent_s = self._clock_s() - (self._begun_s if self._moved_s is None else self._moved_s)
        told_s = 0.0
        if self._newest_ns is not None and self._moved_ns is not None and self._moved_s is not None:
            told_s = (self._newest_ns - self._moved_ns) / NS_PER_S
        stood_s = max(silent_s, told_s)
        return stood_s if self._moved_s is None or stood_s >= STANDS_AFTER_S else None

    def is_of_this_load(self, estimate: Estimate) -> bool:
        """Whether all that was driven for it was driven since the last stop long enough to load or unload."""
        return self.last_stop is not None and estimate.t_start_ns >= self.last_stop.begin_ns


def _speed_of(motion: Motion) -> tuple[I64, F64]:
    """The wheels' speed if there is no other, as for batches."""
    t_ns, speed_mps = motion.of(Signal.SPEED)
    return (t_ns, speed_mps) if t_ns.size else motion.of(Signal.WHEEL_SPEED)
