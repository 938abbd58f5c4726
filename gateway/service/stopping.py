"""Stopping the parts of the service within one deadline."""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from typing import Final

from gateway.log import Event, log_event
from gateway.part import ServicePart

STOP_WITHIN_S: Final = 25.0  # chosen: for all parts together: less than systemd waits before it kills the process
PART_WITHIN_S: Final = 5.0  # chosen: for one part, after the pipeline and the store
CLOSE_WITHIN_S: Final = 3.0  # chosen: reserved for the last records of the stop itself


class Deadline:
    """The deadline shared by all parts of a stop."""

    def __init__(self, within_s: float = STOP_WITHIN_S, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._clock_s = clock_s
        self._end_s = clock_s() + within_s

    def left_s(self, most_s: float = STOP_WITHIN_S, *, keep_s: float = 0.0) -> float:
        """Seconds left for one part, at most ``most_s``, with the last ``keep_s`` reserved."""
        return max(0.0, min(most_s, self._end_s - keep_s - self._clock_s()))


def stop_in_turn(parts: Sequence[ServicePart], deadline: Deadline) -> list[str]:
    """Stop the parts in reverse order -> names of those that did not stop in time, which are abandoned.

    Each part stops in its own thread, so a part that waits for a lock or a disk delays the others only up to the
    deadline.
    """
    late = []
    for part in reversed(parts):
        left_s = deadline.left_s(PART_WITHIN_S, keep_s=CLOSE_WITHIN_S)
        thread = threading.Thread(target=part.stop, args=(left_s,), name=f"stop {part.NAME}", daemon=True)
        thread.start()
        thread.join(left_s)
        if thread.is_alive():
            late.append(part.NAME)
            log_event(Event.PART_LATE, level=logging.ERROR, part=part.NAME)
    return late
