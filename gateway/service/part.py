"""The common interface of the service's parts: started, watched and stopped in time in the same way."""

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from typing import ClassVar, Final, Protocol

from gateway.log import Event, log_event

STOP_WITHIN_S: Final = 25.0  # all parts together: less than systemd waits before it kills
PART_WITHIN_S: Final = 5.0  # one of them, where the pipeline and the disk are done
CLOSE_WITHIN_S: Final = 3.0  # kept for the last records of the stop itself


@dataclass(frozen=True)
class Part:
    """A row of the gateway's table.

    ``stop`` is given the seconds it may take. ``fault`` says what is wrong, for people; ``death`` why it no longer
    works, None while it does. The death of a vital part ends the process, so that systemd restarts it; that of another
    is shown, and the weighing goes on.
    """

    name: str
    start: Callable[[], object]
    stop: Callable[[float], object]
    fault: Callable[[], str | None] = lambda: None
    death: Callable[[], str | None] = lambda: None
    is_vital: bool = False

    def told(self) -> str | None:
        """Its fault, or its death."""
        death = None if self.is_vital else self.death()
        return self.fault() if death is None else f"{death}; weighing goes on, a restart brings it back"


class Sending(Protocol):
    """A part with a thread that sends estimates."""

    NAME: ClassVar[str]

    @property
    def fault(self) -> str | None: ...
    def start(self) -> None: ...
    def stop(self, timeout_s: float, /) -> None: ...
    def is_alive(self) -> bool: ...


class Deadline:
    """One moment for all parts of a stop."""

    def __init__(self, within_s: float = STOP_WITHIN_S, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._clock_s = clock_s
        self._end_s = clock_s() + within_s

    def left_s(self, most_s: float = STOP_WITHIN_S, *, keep_s: float = 0.0) -> float:
        """The share of one part of the time left, without the last ``keep_s``."""
        return max(0.0, min(most_s, self._end_s - keep_s - self._clock_s()))


class Questions(ThreadPoolExecutor):
    """Threads in which clients' questions wait for a lock or a disk. Its end waits for none of them."""

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Abandon tasks that hang: the event loop, which waits for its executor, would wait for ever."""
        super().shutdown(wait=False, cancel_futures=True)


async def in_own_thread(work: Callable[[], object]) -> None:
    """Run it in a thread of its own while the event loop goes on. Raises what it raises.

    Not in the loop's pool: clients' requests may have used it up, and one that hangs keeps the process from ending.
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
        except Exception as raised:  # noqa: BLE001 - raised again where it is awaited
            failure = raised
        with suppress(RuntimeError):  # the loop is closed: nobody waits any more
            loop.call_soon_threadsafe(end, failure)

    threading.Thread(target=run, name="beside", daemon=True).start()
    await done


def stop_in_turn(parts: Sequence[Part], deadline: Deadline) -> list[str]:
    """Stop the last first -> names of those that did not stop in time; they are left behind.

    Each stops in a thread of its own: if it waits for a lock or a disk, the others wait no longer than the deadline.
    """
    late = []
    for part in reversed(parts):
        left_s = deadline.left_s(PART_WITHIN_S, keep_s=CLOSE_WITHIN_S)
        thread = threading.Thread(target=part.stop, args=(left_s,), name=f"stop {part.name}", daemon=True)
        thread.start()
        thread.join(left_s)
        if thread.is_alive():
            late.append(part.name)
            log_event(Event.PART_LATE, level=logging.ERROR, part=part.name)
    return late
