"""When each signal was last received, its interval, and the last values of the vehicle's own load sensors."""

import time

import numpy as np

from gateway.records import STATIC, Motion, Signal
from gateway.units import NS_PER_S


class SignalWatch:
    """When each signal was last received and how often, for the status page. Written by one thread, read by any."""

    def __init__(self, signals: tuple[Signal, ...]) -> None:
        self.last_heard: dict[Signal, float] = {}
        self.rate_hz: dict[Signal, float] = {}
        self._signals = signals
        self._window: dict[Signal, tuple[int, int]] = {}  # first stamp and count since
        self.readings: dict[Signal, float] = {}  # the last of each static signal, in SI

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
