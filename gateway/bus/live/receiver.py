"""The interface of all receivers, and the bounded queue between the receive thread and the pipeline."""

import threading
import time
from dataclasses import dataclass
from typing import Final, Protocol

from gateway.bus.frames import join, take
from gateway.records import Frames

DRAINED_FRAMES: Final = 4096
"""Chosen: at once. Stamps that jump at random end a window with every row, which costs up to 1 ms a frame: this bounds
one turn of the pipeline to 4 s, of the 20 s that the watchdog waits."""


@dataclass(frozen=True, slots=True)
class Burst:
    """Data frames that came together in order, the numbers of others, and whether bus-off came behind all frames.

    ``n_clock_sets`` and ``n_clock_wraps`` tell how often the adapter's own clock was dated, and began again at 0.
    """

    frames: Frames
    error_frames: int = 0
    is_bus_off: bool = False
    remote_frames: int = 0
    n_clock_sets: int = 0
    n_clock_wraps: int = 0


class Receiver(Protocol):
    """An open CAN channel that is only listened to."""

    @property
    def dropped_kernel(self) -> int:
        """Frames the kernel lost for us since opening."""
        ...

    def receive(self, timeout_s: float) -> Burst:
        """The received frames, waiting up to ``timeout_s`` for a first one. Raises OSError or can.CanError."""
        ...

    def close(self) -> None:
        """Give the channel back."""
        ...


class Inbox:
    """Frames in order of arrival; one thread puts, one drains.

    When it is full, new frames are dropped and counted. With ``waits_for_room`` the putting thread waits instead: right
    for an in-process bus, whose sender can wait, wrong for a real one.
    """

    def __init__(self, capacity_frames: int, width: int, *, waits_for_room: bool = False) -> None:
        self._capacity = capacity_frames
        self._width = width
        self._waits_for_room = waits_for_room
        self._bursts: list[Frames] = []
        self._n_waiting = 0
        self._n_dropped = 0
        self._is_closed = False
        self._changed = threading.Condition()

    @property
    def dropped(self) -> int:
        """Frames lost because the pipeline did not keep up."""
        return self._n_dropped

    def __len__(self) -> int:
        return self._n_waiting

    def put(self, frames: Frames) -> None:
        """Add a burst; frames without room are dropped and counted."""
        with self._changed:
            if self._waits_for_room:
                self._changed.wait_for(lambda: self._n_waiting < self._capacity or self._is_closed)
            elif len(frames) > self._capacity - self._n_waiting:
                room = self._capacity - self._n_waiting
                self._n_dropped += len(frames) - room
                frames = take(frames, slice(room))
            if len(frames):
                self._bursts.append(frames)
                self._n_waiting += len(frames)
                self._changed.notify_all()

    def drain(self, timeout_s: float) -> Frames | None:
        """The waiting frames, at most DRAINED_FRAMES of them; None if there are none within ``timeout_s``."""
        deadline = time.monotonic() + timeout_s
        with self._changed:
            while not self._bursts and not self._is_closed:
                left_s = deadline - time.monotonic()
                if left_s <= 0 or not self._changed.wait(left_s):
                    break
            room, n_bursts = DRAINED_FRAMES, 0
            while n_bursts < len(self._bursts) and (room := room - len(self._bursts[n_bursts])) >= 0:
                n_bursts += 1
            bursts, self._bursts = self._bursts[:n_bursts], self._bursts[n_bursts:]
            if self._bursts and not bursts:
                bursts = [take(self._bursts[0], slice(DRAINED_FRAMES))]
                self._bursts[0] = take(self._bursts[0], slice(DRAINED_FRAMES, None))
            self._n_waiting -= sum(map(len, bursts))
            self._changed.notify_all()
        return join(bursts, self._width) if bursts else None

    def close(self) -> None:
        """Close for new frames and wake the waiting thread. The frames inside can still be drained."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
