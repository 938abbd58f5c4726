"""Stopping the parts of the service within one deadline, and work beside its event loop."""

import asyncio
import logging
import math
import threading
import time
from collections.abc import Callable, Coroutine, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any, Final, Generic, TypeVar

from gateway.log import Event, log_event
from gateway.part import ServicePart

T = TypeVar("T")
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


class Questions(ThreadPoolExecutor):
    """Thread pool for client requests that may wait for a lock or a disk. Its shutdown does not wait for them."""

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Abandon hanging tasks, because the event loop would wait for its executor forever."""
        super().shutdown(wait=False, cancel_futures=True)


async def in_own_thread(work: Callable[[], object]) -> None:
    """Run ``work`` in its own thread while the event loop goes on. Raises what ``work`` raises.

    It does not use the loop's pool, which client requests may have exhausted.
    """
    loop = asyncio.get_running_loop()
    done: asyncio.Future[None] = loop.create_future()

    def end(failure: BaseException | None) -> None:
        if not done.done():
            done.set_result(None) if failure is None else done.set_exception(failure)

    def run() -> None:
        failure: BaseException | None = None
        try:
            work()
        except Exception as raised:  # noqa: BLE001 - raised again if it is awaited
            failure = raised
        with suppress(RuntimeError):  # the loop is closed: nobody waits any more
            loop.call_soon_threadsafe(end, failure)

    threading.Thread(target=run, name="beside", daemon=True).start()
    await done


class Periodic(Generic[T]):
    """Does some work of the event loop every so often; a turn never overlaps the one before."""

    def __init__(self, work: Callable[[], Coroutine[Any, Any, T]]) -> None:
        self._work = work
        self._task: asyncio.Task[T] | None = None
        self._begun_s = -math.inf

    def go_on(self, every_s: float) -> T | None:
        """Begin the next turn if ``every_s`` have passed -> the result of one that has ended. Raises what it raised."""
        task, ended = self._task, None
        if task is not None and task.done():
            self._task, ended = None, task.result()
        if self._task is None and time.monotonic() - self._begun_s >= every_s:
            self._begun_s = time.monotonic()
            self._task = asyncio.create_task(self._work())
        return ended


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
