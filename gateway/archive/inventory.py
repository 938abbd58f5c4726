"""The content of an archive and its progress, without processing anything."""

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Final

from gateway.archive.drives import JobDrives
from gateway.archive.jobs import ArchiveJob, plan
from gateway.archive.manifest import Assignment, Manifest
from gateway.archive.places import Location, PlaceError
from gateway.archive.receipts import Slot, receipts, slots_done, slots_failed
from gateway.archive.survey import Facts, LogFile, keep_facts, known_facts, logs_of, survey
from gateway.errors import ConfigurationError, SpringscaleError

AT_A_TIME: Final = 16  # chosen: concurrent requests to a store
RECEIPTS_ASKED: Final = 20  # chosen: receipts read for the earlier speed
WORTH_TIMING: Final = 1_000_000  # chosen: least bytes of a timed log


@dataclass(slots=True)
class Inventory:
    """Every vehicle's logs, and the known facts about their content."""

    manifest: Manifest
    dataset: Location
    logs: list[list[LogFile]]  # by assignment
    facts: dict[str, Facts]  # by vehicle
    lost: dict[str, str] = field(default_factory=dict)  # what could not be reached, and why

    @property
    def all_logs(self) -> list[LogFile]:
        """The logs of all vehicles, each once: a folder may occur under several calibrations of a vehicle."""
        return list({log.key: log for group in self.logs for log in group}.values())

    @property
    def size(self) -> int:
        return sum(log.size for log in self.all_logs)

    @property
    def n_vehicles(self) -> int:
        return len(self.facts)

    def unknown(self) -> Iterator[tuple[str, list[LogFile]]]:
        """By vehicle: the logs that were not surveyed yet."""
        logs: dict[str, dict[str, LogFile]] = {vehicle: {} for vehicle in self.facts}
        for assignment, group in zip(self.manifest.assignments, self.logs, strict=True):
            facts = self.facts[assignment.vehicle]
            logs[assignment.vehicle] |= {log.key: log for log in group if log.key not in facts}
        return ((vehicle, list(new.values())) for vehicle, new in logs.items() if new)

    def learn(self, vehicle: str, facts: Facts) -> None:
        """Store the facts in the data set for the next run."""
        self.facts[vehicle] |= facts
        keep_facts(self.dataset, vehicle, self.facts[vehicle])

    def jobs(self) -> list[ArchiveJob]:
        """The jobs of every fully surveyed vehicle, the largest first: a missing log would change its job."""
        pairs = list(zip(self.manifest.assignments, self.logs, strict=True))
        in_part = {assignment.vehicle for assignment, group in pairs if not self._is_known(assignment, group)}
        found: list[ArchiveJob] = []
        for assignment, group in pairs:
            if assignment.vehicle not in in_part:
                facts = self.facts[assignment.vehicle]
                found += plan(self.dataset, assignment, group, facts, self.manifest.settings)
        return sorted(found, key=lambda job: (-job.size, job.slot))

    def _is_known(self, assignment: Assignment, group: list[LogFile]) -> bool:
        facts = self.facts[assignment.vehicle]
        return str(assignment.logs) not in self.lost and all(log.key in facts for log in group)


def look(manifest: Manifest, dataset: Location) -> Inventory:
    """List every vehicle's logs. Raises ConfigurationError if there are none, PlaceError for the data set."""
    vehicles = sorted({assignment.vehicle for assignment in manifest.assignments})
    with ThreadPoolExecutor(AT_A_TIME) as asking:  # a store takes its time for each, and many at once
        listed = list(asking.map(lambda assignment: _listed(manifest, assignment), manifest.assignments))
        facts = dict(zip(vehicles, asking.map(lambda vehicle: known_facts(dataset, vehicle), vehicles), strict=True))
    logs = [found if isinstance(found, list) else [] for found in listed]
    pairs = zip(manifest.assignments, listed, strict=True)
    lost = {str(assignment.logs): str(found) for assignment, found in pairs if isinstance(found, PlaceError)}
    if not any(logs) and not lost:
        raise ConfigurationError(
            f"{manifest.where}: not one log in the folders of its vehicles, the first of which is "
            f"{manifest.assignments[0].logs}; see logs and pattern there"
        )
    return Inventory(manifest, dataset, logs, facts, lost)


def _listed(manifest: Manifest, assignment: Assignment) -> list[LogFile] | PlaceError:
    try:
        return logs_of(manifest, assignment)
    except PlaceError as fault:
        return fault


@dataclass(frozen=True, slots=True)
class Forecast:
    """The remaining work and its duration; seconds are None if unknown.

    ``n_new_logs`` were not surveyed, so their jobs are not yet in ``n_jobs``.
    """

    n_vehicles: int
    n_logs: int
    size: int
    n_new_logs: int
    n_jobs: int
    n_done: int
    n_failed: int
    size_to_do: int
    rate: float | None  # bytes a second of one worker
    n_workers: int
    is_timed_before: bool  # by receipts; else on one log, just now

    @property
    def remaining_s(self) -> float | None:
        """The duration with this number of workers."""
        return 0.0 if not self.size_to_do else self.size_to_do / (self.rate * self.n_workers) if self.rate else None

    def to_json(self) -> dict[str, Any]:
        told = {
            name: getattr(self, name) for name in ("n_vehicles", "n_logs", "n_new_logs", "n_jobs", "n_done", "n_failed")
        }
        rate = {"bytes_per_s_and_worker": self.rate, "n_workers": self.n_workers, "remaining_s": self.remaining_s}
        return {**told, "bytes": self.size, "bytes_to_do": self.size_to_do, **rate}


def forecast(inventory: Inventory, n_workers: int) -> Forecast:
    """The jobs that a run would execute. Writes nothing; without receipts to estimate the speed, one log is timed."""
    dataset, jobs = inventory.dataset, inventory.jobs()
    done, failed = set(slots_done(dataset)), set(slots_failed(dataset))
    to_do = [job for job in jobs if job.slot not in done | failed]
    seen = {one.log.key for job in jobs for one in job.logs}
    size_to_do = sum(job.size for job in to_do)
    size_to_do += sum(log.size for log in inventory.all_logs if log.key not in seen)
    rate = rate_before(dataset, sorted(done))
    return Forecast(
        n_vehicles=inventory.n_vehicles,
        n_logs=len(inventory.all_logs),
        size=inventory.size,
        n_new_logs=sum(len(logs) for _, logs in inventory.unknown()),
        n_jobs=len(jobs),
        n_done=sum(job.slot in done for job in jobs),
        n_failed=sum(job.slot in failed - done for job in jobs),
        size_to_do=size_to_do,
        rate=rate or (rate_of_one_log(inventory) if size_to_do else None),
        n_workers=n_workers,
        is_timed_before=rate is not None,
    )


def rate_before(dataset: Location, done: list[Slot]) -> float | None:
    """Bytes per second of one worker, from some receipts; None without any."""
    asked = set(done[:: max(1, len(done) // RECEIPTS_ASKED)])
    told = [receipt["run"] for receipt in receipts(dataset, lambda slot: slot in asked)]
    took_s = sum(run["took_s"] for run in told)
    return sum(run["bytes"] for run in told) / took_s if took_s > 0.0 else None


def rate_of_one_log(inventory: Inventory) -> float | None:
    """Bytes per second of surveying and weighing one log here; None if that fails."""
    pairs = [(log, i) for i, group in enumerate(inventory.logs) for log in group if log.size]
    worth = [pair for pair in pairs if pair[0].size >= WORTH_TIMING]
    if not pairs:
        return None
    log, i = min(worth, key=lambda pair: pair[0].size) if worth else max(pairs, key=lambda pair: pair[0].size)
    begun_s = time.monotonic()
    facts = survey([log]).facts
    try:
        for job in plan(
            inventory.dataset, inventory.manifest.assignments[i], [log], facts, inventory.manifest.settings
        ):
            JobDrives(job).take(job.logs[0], None)
    except SpringscaleError:
        return None
    return log.size / (time.monotonic() - begun_s)
