"""Many tasks, a bounded number of them under way: what comes back is handed on as it comes."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from itertools import islice
from typing import Any, Final, Protocol, TypeVar

Task = TypeVar("Task")
Answer = TypeVar("Answer")

AHEAD: Final = 2  # tasks under way for each worker, so that none waits for the driver


class Workers(Protocol):
    """An executor (concurrent.futures) that knows how many work for it."""

    @property
    def n_workers(self) -> int:
        """Tasks that are done at a time."""

    def submit(self, fn: Callable[..., Answer], /, *args: Any, **kwargs: Any) -> "Future[Answer]":
        """Have it done by one of them."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a run is: bytes done of all, and pieces of all."""

    what: str
    done: int
    total: int
    n_done: int
    n_total: int
    elapsed_s: float

    @property
    def rate(self) -> float:
        """Bytes a second so far; 0 before the first piece."""
        return self.done / self.elapsed_s if self.elapsed_s > 0.0 else 0.0

    @property
    def remaining_s(self) -> float | None:
        """At that rate; None before the first piece."""
        return (self.total - self.done) / self.rate if self.rate > 0.0 else None


OnProgress = Callable[[Progress], None]


def done_by(
    workers: Workers, fn: Callable[[Task], Answer], tasks: Iterable[Task]
) -> "Iterator[tuple[Task, Future[Answer]]]":
    """Each task with its future, in the order in which they finish; ``tasks`` may be endless."""
    waiting = iter(tasks)
    under_way: dict[Future[Answer], Task] = {}
    while True:
        n_free = max(0, AHEAD * workers.n_workers - len(under_way))
        under_way.update((workers.submit(fn, task), task) for task in islice(waiting, n_free))
        if not under_way:
            return
        for future in wait(under_way, return_when=FIRST_COMPLETED).done:
            yield under_way.pop(future), future
