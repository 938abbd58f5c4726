"""A bus that repeats one drive, as fast as the service reads it."""

import time
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from gateway.bus.frames import empty_frames, take
from gateway.bus.receiver import Burst
from gateway.records import Frames
from gateway.units import NS_PER_S

DAY_S: Final = 86_400  # seconds
BURST_S: Final = 10.0  # chosen: of driving per burst
PARKED_BURST: Final = 5000  # frames of the first drive at a time, so that all windows are kept: those wait for the disk


class EndlessDrive:
    """A receiver that repeats the frames of one drive, each day's driving followed by a night of silence."""

    dropped_kernel = 0

    def __init__(self, drive: Frames, hours_a_day: float, n_days: int) -> None:
        self.days_done = 0
        self.is_over = False
        self._drive, self._n_days = drive, n_days
        self._length_ns = int(drive.t_ns[-1] - drive.t_ns[0]) + 20 * NS_PER_S  # parked a little between drives
        self._drives_a_day = max(1, round(hours_a_day * 3600 * NS_PER_S / self._length_ns))
        pieces = (drive.t_ns - drive.t_ns[0]) // int(BURST_S * NS_PER_S)
        self._edges = [*np.searchsorted(pieces, np.arange(pieces[-1] + 1)), len(drive)]
        self._bursts = self._all_bursts()

    def receive(self, timeout_s: float) -> Burst:
        """The next ten seconds of driving; empty bursts once the week is over."""
        frames = next(self._bursts, None)
        if frames is None:
            self.is_over = True
            time.sleep(timeout_s)
            return Burst(empty_frames(self._drive.payload.shape[1]))
        return Burst(frames)

    def close(self) -> None:
        """Nothing to release."""

    def _all_bursts(self) -> Iterator[Frames]:
        for day in range(self._n_days):
            for drive in range(self._drives_a_day):
                later_ns = day * DAY_S * NS_PER_S + drive * self._length_ns
                for begin, end in pairwise(self._edges):
                    part = take(self._drive, slice(begin, end))
                    yield Frames(part.t_ns + later_ns, part.can_id, part.length, part.payload)
            self.days_done = day + 1
