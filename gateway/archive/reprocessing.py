"""Reprocesses a whole archive: survey, plan, run the jobs without a receipt, and summarise.

with local_workers() as workers:
    summary = reprocess(load_manifest("fleet/archive.toml"), place_of("DATASET"), workers)
"""

import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, TypeVar

from gateway.archive.inventory import Inventory, look
from gateway.archive.job_run import JobOutcome, JobStatus, run
from gateway.archive.jobs import ArchiveJob
from gateway.archive.manifest import Manifest
from gateway.archive.places import Location
from gateway.archive.receipts import Slot, slots_done
from gateway.archive.survey import Facts, LogFile, survey
from gateway.archive.workers import Workers, answer_of
from gateway.errors import ConfigurationError

Task = TypeVar("Task")
Answer = TypeVar("Answer")
Piece = TypeVar("Piece", LogFile, ArchiveJob)


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a run: bytes done of all, and pieces of all."""

    what: str
    done: int
    total: int
    n_done: int
    n_total: int
    elapsed_s: float

    @property
    def rate(self) -> float:
        """Bytes per second so far; 0 before the first piece."""
        return self.done / self.elapsed_s if self.elapsed_s > 0.0 else 0.0

    @property
    def remaining_s(self) -> float | None:
        """The remaining time at that rate; None before the first piece."""
        return (self.total - self.done) / self.rate if self.rate > 0.0 else None


OnProgress = Callable[[Progress], None]


def done_by(
    workers: Workers, fn: Callable[[Task], Answer], tasks: Iterable[Task]
) -> "Iterator[tuple[Task, Future[Answer]]]":
    """Yields each task with its future as the tasks are completed; ``tasks`` may be endless.

    No more tasks than workers are under way: one that waits behind a task that kills its worker would be blamed too.
    """
    waiting = iter(tasks)
    under_way: dict[Future[Answer], Task] = {}
    while True:
        n_free = max(0, workers.n_workers - len(under_way))
        under_way.update((workers.submit(fn, task), task) for task in islice(waiting, n_free))
        if not under_way:
            return
        for future in wait(under_way, return_when=FIRST_COMPLETED).done:
            yield under_way.pop(future), future


@dataclass(slots=True)
class Summary:
    """The result of a run. ``outcomes`` are those of the jobs that it tried; ``n_already`` had a receipt before."""

    n_vehicles: int
    n_logs: int
    size: int
    n_jobs: int
    n_already: int
    outcomes: list[JobOutcome] = field(default_factory=list)
    lost: dict[str, str] = field(default_factory=dict)  # logs and jobs to retry, with reasons
    copies: dict[str, str] = field(default_factory=dict)  # logs left out, each with the log whose content it has
    of_others: dict[str, str] = field(default_factory=dict)  # logs of one content, of two vehicles
    took_s: float = 0.0

    @property
    def counts(self) -> dict[str, int]:
        """Number of jobs by what became of them."""
        found = Counter(outcome.status for outcome in self.outcomes)
        already = self.n_already + found[JobStatus.ALREADY]
        return {"done": found[JobStatus.DONE], "already": already, "lost": found[JobStatus.LOST]}

    @property
    def n_failed_logs(self) -> int:
        return sum(outcome.n_failed_logs for outcome in self.outcomes)

    @property
    def is_good(self) -> bool:
        """Whether nothing failed in this run, and nothing remains to do."""
        return not (self.n_failed_logs or self.lost)

    def to_json(self) -> dict[str, Any]:
        return {
            "n_vehicles": self.n_vehicles,
            "n_logs": self.n_logs,
            "bytes": self.size,
            "n_jobs": self.n_jobs,
            "jobs": self.counts,
            "n_batches": sum(outcome.n_batches for outcome in self.outcomes),
            "n_weighed": sum(outcome.n_weighed for outcome in self.outcomes),
            "n_failed_logs": self.n_failed_logs,
            "failures": [reason for outcome in self.outcomes for reason in outcome.failures],
            "refused": [text for outcome in self.outcomes for text in outcome.refused],
            "overlaps": [text for outcome in self.outcomes for text in outcome.overlaps],
            "lost": self.lost,
            "copies": self.copies,
            "of_others": self.of_others,
            "took_s": round(self.took_s, 3),
        }


def reprocess(
    manifest: Manifest,
    dataset: Location,
    workers: Workers,
    on_progress: OnProgress = lambda _: None,
) -> Summary:
    """Run every job of the archive without a receipt.

    Raises PlaceError if the data set cannot be reached, ConfigurationError if there is no log, or a worker runs another
    version of springscale.
    """
    begun_s = time.monotonic()
    inventory = look(manifest, dataset)
    _survey(inventory, workers, on_progress)
    jobs = inventory.jobs()
    done = set(slots_done(dataset))
    to_do = [job for job in jobs if job.slot not in done]
    summary = Summary(
        n_vehicles=inventory.n_vehicles,
        n_logs=len(inventory.all_logs),
        size=inventory.size,
        n_jobs=len(jobs),
        n_already=sum(job.slot in done for job in jobs),
        lost=dict(inventory.lost),
        copies=inventory.copies(),
        of_others=inventory.of_others(),
    )
    _weigh(to_do, workers, summary, on_progress)
    _retire(dataset, jobs)
    summary.took_s = time.monotonic() - begun_s
    return summary


def _answers(
    what: str, workers: Workers, fn: Callable[[Piece], Answer], pieces: Sequence[Piece], on_progress: OnProgress
) -> "Iterator[tuple[Piece, Future[Answer]]]":
    """Yields each piece of work with its answer as they come, and reports how far the run is."""
    total, done, begun_s = sum(piece.size for piece in pieces), 0, time.monotonic()
    for n, (piece, answer) in enumerate(done_by(workers, fn, pieces), 1):
        yield piece, answer
        done += piece.size
        on_progress(Progress(what, done, total, n, len(pieces), time.monotonic() - begun_s))


def _survey(inventory: Inventory, workers: Workers, on_progress: OnProgress) -> None:
    """Survey every new log; each vehicle's facts are stored when it is complete."""
    vehicle_of = {log: vehicle for vehicle, logs in inventory.unknown() for log in logs}
    left = Counter(vehicle_of.values())
    found: defaultdict[str, Facts] = defaultdict(dict)
    for log, answer in _answers("looking", workers, survey, list(vehicle_of), on_progress):
        vehicle = vehicle_of[log]
        try:
            found[vehicle][log.key] = answer_of(answer)
        except ConfigurationError:
            raise
        except Exception as fault:  # noqa: BLE001 - whatever happened to a worker, the other vehicles go on
            inventory.lost[log.name] = str(fault) or repr(fault)
        left[vehicle] -= 1
        if not left[vehicle]:
            inventory.learn(vehicle, found.pop(vehicle, {}))


def _weigh(jobs: Sequence[ArchiveJob], workers: Workers, summary: Summary, on_progress: OnProgress) -> None:
    for job, answer in _answers("weighing", workers, run, jobs, on_progress):
        outcome = _outcome(job, answer)
        summary.outcomes.append(outcome)
        if outcome.status is JobStatus.LOST:
            summary.lost[f"{job.slot.folder}/{job.slot.job}"] = outcome.failures[0]


def _outcome(job: ArchiveJob, answer: "Future[JobOutcome]") -> JobOutcome:
    try:
        return answer_of(answer)
    except ConfigurationError:  # a missing library or another version: no worker would do better
        raise
    except Exception as fault:  # noqa: BLE001 - a store, a cluster or a bug: the other jobs go on, this one is reported
        return JobOutcome(job.slot, JobStatus.LOST, job.size, failures=(str(fault) or repr(fault),))


def _retire(dataset: Location, jobs: Sequence[ArchiveJob]) -> None:
    """Remove outdated results of a month whose inputs changed, once all its new jobs have receipts."""
    planned: defaultdict[str, set[Slot]] = defaultdict(set)
    for job in jobs:
        planned[job.slot.folder].add(job.slot)
    done = set(slots_done(dataset))
    whole = {folder for folder, slots in planned.items() if slots <= done}
    for slot in done:
        if slot.folder in whole and slot not in planned[slot.folder]:
            dataset.remove(slot.receipt)
