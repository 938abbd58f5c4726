"""Executors of jobs: independent processes on all cores of this computer, or many computers through Dask.

The standard library's process pool breaks as a whole if one process dies; a killed one here loses only its task.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from multiprocessing.connection import Connection
from typing import Any, Final, TypeVar

from gateway.allocator import keep_freed_memory
from gateway.archive.places import PlaceError
from gateway.errors import ConfigurationError, SpringscaleError

Answer = TypeVar("Answer")

MOST_DEATHS: Final = 3  # chosen: of workers over one job; after that the job is the cause
ONE_THREAD: Final = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_STARTING: Final = multiprocessing.get_context("forkserver")  # a plain fork would copy our threads and connections
_STARTING.set_forkserver_preload(["gateway.archive.run"])  # once for all of them


class WorkerKilledError(SpringscaleError):
    """A job's workers were killed repeatedly."""


class Processes(Executor):
    """An executor like those of concurrent.futures; functions and arguments must be importable by name and
    picklable.
    """

    def __init__(self, n_workers: int | None = None) -> None:
        """``n_workers`` processes, or one for each core available to this process."""
        self.n_workers = n_workers or len(os.sched_getaffinity(0))
        self._own = threading.local()
        self._workers: set[_Worker] = set()
        self._is_over = False
        self._lock = threading.Lock()
        self._threads = ThreadPoolExecutor(self.n_workers, thread_name_prefix="worker")

    def submit(self, fn: Callable[..., Answer], /, *args: Any, **kwargs: Any) -> Future[Answer]:
        """Run it in the next free process."""
        return self._threads.submit(self._done_by_worker, fn, args, kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End every process; with ``cancel_futures`` immediately."""
        if not cancel_futures:
            self._threads.shutdown(wait=wait)
        with self._lock:
            self._is_over = True
            for worker in self._workers:
                worker.end()
        self._threads.shutdown(wait=wait, cancel_futures=True)

    def _done_by_worker(self, fn: Callable[..., Answer], args: Any, kwargs: Any) -> Answer:
        for _ in range(MOST_DEATHS):
            worker = self._worker()
            try:
                is_good, answer = worker.ask((fn, args, kwargs))
            except (EOFError, OSError):  # the other end is gone
                self._bury(worker)
                continue
            if is_good:
                result: Answer = answer
                return result
            raise answer
        raise WorkerKilledError(
            f"{MOST_DEATHS} processes died over it without a word: out of memory, or killed; "
            "see the system's log, and try fewer workers"
        )

    def _worker(self) -> "_Worker":
        """This thread's own process."""
        worker: _Worker | None = getattr(self._own, "worker", None)
        if worker is None:
            with self._lock:
                if self._is_over:
                    raise WorkerKilledError("the work was stopped")
                worker = self._own.worker = _Worker()
                self._workers.add(worker)
        return worker

    def _bury(self, worker: "_Worker") -> None:
        with self._lock:
            self._workers.discard(worker)
            self._own.worker = None
            worker.end()


class _Worker:
    """A process that handles one request after another."""

    def __init__(self) -> None:
        for name in ONE_THREAD:
            os.environ.setdefault(name, "1")  # a core has one worker; more threads would only fight for it
        self._pipe, theirs = _STARTING.Pipe()
        self._process = _STARTING.Process(target=_answer, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()

    def ask(self, question: Any) -> tuple[bool, Any]:
        """Whether the request succeeded, and its result. Raises EOFError or OSError if the process has died."""
        self._pipe.send(question)
        answer: tuple[bool, Any] = self._pipe.recv()
        return answer

    def end(self) -> None:
        self._process.kill()
        self._process.join()
        self._pipe.close()


def _answer(pipe: "Connection[Any, Any]") -> None:
    """The main loop of a process. It ignores Ctrl-C; the driver handles it and ends the process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    keep_freed_memory()
    while True:
        try:
            fn, args, kwargs = pipe.recv()
        except EOFError:  # the driver has ended
            return
        try:
            answer = (True, fn(*args, **kwargs))
        except Exception as fault:  # noqa: BLE001 - it belongs to who asked
            answer = (False, fault)
        try:
            _send(pipe, answer)
        except OSError:  # who asked is gone
            return


def _send(pipe: "Connection[Any, Any]", answer: tuple[bool, Any]) -> None:
    try:
        pipe.send(answer)
    except (TypeError, AttributeError, ValueError) as fault:  # what cannot be pickled
        pipe.send((False, RuntimeError(f"{answer[1]!r} cannot be sent back: {fault}")))


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
        told.set_exception(PlaceError("the cluster dropped the job: its scheduler went away, or was stopped"))
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


Workers = Processes | Cluster
