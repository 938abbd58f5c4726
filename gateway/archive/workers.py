"""Runs jobs on the workers of a Dask cluster: one of this computer's own, or that of a scheduler on the network.

A worker that is killed loses its task, which another one repeats; a task over which workers die again and again is
given up.
"""

import logging
import os
from collections.abc import Callable
from concurrent.futures import CancelledError, Executor, Future
from types import TracebackType
from typing import Any, Final, TypeVar

import distributed

from gateway.archive.places import PlaceError
from gateway.errors import ConfigurationError

Answer = TypeVar("Answer")

CONNECT_WITHIN_S: Final = 15  # chosen


class Workers(Executor):
    """The current workers of a cluster, as an executor; functions and arguments must be importable and picklable."""

    def __init__(self, client: Any, own_cluster: Any = None) -> None:
        """``client`` is connected; ``own_cluster`` ends with it, another one's scheduler and workers go on."""
        self._client, self._own_cluster = client, own_cluster
        self._executor = client.get_executor(pure=False, retries=0)

    @property
    def n_workers(self) -> int:
        """Threads of all workers: the number of concurrent jobs."""
        return max(1, int(sum(self._client.nthreads().values())))

    def submit(self, fn: Callable[..., Answer], /, *args: Any, **kwargs: Any) -> Future[Answer]:
        """Run it on any worker; the task of a lost worker is repeated by another. ``answer_of`` gives the result."""
        submitted: Future[Answer] = self._executor.submit(fn, *args, **kwargs)
        return submitted

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Disconnect; with ``cancel_futures`` at once."""
        self._executor.shutdown(wait=wait and not cancel_futures)
        self._client.close()
        if self._own_cluster is not None:
            self._own_cluster.close()

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for what was submitted, unless the block was left by an exception."""
        self.shutdown(cancel_futures=kind is not None)


def local_workers(n_workers: int | None = None) -> Workers:
    """Processes of this computer, one for each core available to this process unless stated, each with one thread."""
    cluster = distributed.LocalCluster(
        n_workers=n_workers or len(os.sched_getaffinity(0)),
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",  # of Dask's own pages: with None they would want port 8787
        silence_logs=logging.CRITICAL,  # the summary says what failed and why
    )
    return Workers(distributed.Client(cluster, set_as_default=False), cluster)


def workers_of(address: str) -> Workers:
    """The workers of a scheduler. Raises ConfigurationError for another address, PlaceError if nobody answers."""
    try:
        client = distributed.Client(address, timeout=CONNECT_WITHIN_S, set_as_default=False)
    except ValueError as fault:
        raise ConfigurationError(
            f"{address}: no address of a Dask scheduler such as tcp://10.0.0.5:8786: {fault}"
        ) from None
    except OSError as fault:
        raise PlaceError(
            f"{address}: no Dask scheduler answers within {CONNECT_WITHIN_S} s: start one with `dask scheduler`, "
            f"workers with `dask worker {address} --nthreads 1` ({type(fault).__name__})"
        ) from None
    if not client.nthreads():
        client.close()
        raise PlaceError(f"{address}: has no workers yet: start them with `dask worker {address} --nthreads 1`")
    return Workers(client)


def answer_of(task: Future[Answer]) -> Answer:
    """What a task of ``Workers`` returned. Raises what it raised, and PlaceError if its cluster dropped it or its
    workers were killed.
    """
    try:
        return task.result()
    except CancelledError:
        raise PlaceError("the cluster dropped the job: its scheduler went away, or was stopped") from None
    except distributed.KilledWorker:
        raise PlaceError(
            "several processes died over it without a word: out of memory, or killed; "
            "see the system's log, and try fewer workers"
        ) from None
