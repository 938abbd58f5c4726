"""Many computers: Dask's scheduler as an executor. Only this file uses Dask."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any, Final, TypeVar

from gateway.archive.places import PlaceError
from gateway.archive.processes import WorkerKilledError
from gateway.errors import ConfigurationError

Answer = TypeVar("Answer")

MISSING: Final = "--scheduler needs Dask: pip install 'springscale[cluster]', here and on every worker"
CONNECT_WITHIN_S: Final = 15  # chosen


class Cluster(Executor):
    """The current workers of a Dask scheduler."""

    def __init__(self, client: Any) -> None:
        """``client`` is connected."""
        self._client = client
        self._executor = client.get_executor(pure=False, retries=0)

    @property
    def n_workers(self) -> int:
        """Threads of all workers: the number of concurrent jobs."""
        return max(1, int(sum(self._client.nthreads().values())))

    def submit(self, fn: Callable[..., Answer], /, *args: Any, **kwargs: Any) -> Future[Answer]:
        """Run it on any worker; the task of a lost worker is repeated by another."""
        told: Future[Answer] = Future()
        asked: Future[Answer] = self._executor.submit(fn, *args, **kwargs)
        asked.add_done_callback(lambda done: _pass_on(done, told))
        return told

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Disconnect from the cluster; its scheduler and workers continue."""
        self._executor.shutdown(wait=wait and not cancel_futures)
        self._client.close()


def cluster(address: str) -> Cluster:
    """The cluster of a scheduler. Raises ConfigurationError without Dask, PlaceError if nobody answers."""
    distributed = _distributed()
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
    return Cluster(client)


def _pass_on(done: Future[Answer], told: Future[Answer]) -> None:
    """Pass on the answer, or the fault in our own words."""
    if done.cancelled():
        told.set_exception(PlaceError("the cluster has let go of it: its scheduler went away, or was told to stop"))
        return
    fault = done.exception()
    if fault is None:
        told.set_result(done.result())
    elif isinstance(fault, _distributed().KilledWorker):
        told.set_exception(
            WorkerKilledError("several workers died over it without a word: out of memory, or killed; see their logs")
        )
    else:
        told.set_exception(fault)


def _distributed() -> Any:
    """The library, loaded when a cluster is requested."""
    try:
        import distributed  # noqa: PLC0415 - an extra, see above
    except ModuleNotFoundError:
        raise ConfigurationError(MISSING) from None
    return distributed
