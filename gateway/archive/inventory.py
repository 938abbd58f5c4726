"""The content of an archive: every vehicle's logs, and the jobs that follow from them."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Final

from gateway.archive.jobs import ArchiveJob, plan
from gateway.archive.manifest import Assignment, Manifest
from gateway.archive.places import Location, PlaceError
from gateway.archive.survey import Facts, LogFile, keep_facts, known_facts, logs_of
from gateway.errors import ConfigurationError

AT_A_TIME: Final = 16  # chosen: concurrent requests to a store


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
        """The logs that were not surveyed yet, by vehicle."""
        logs: dict[str, dict[str, LogFile]] = {vehicle: {} for vehicle in self.facts}
        for assignment, group in zip(self.manifest.assignments, self.logs, strict=True):
            facts = self.facts[assignment.vehicle]
            logs[assignment.vehicle] |= {log.key: log for log in group if log.key not in facts}
        return ((vehicle, list(new.values())) for vehicle, new in logs.items() if new)

    def learn(self, vehicle: str, facts: Facts) -> None:
        """Store the facts in the data set for the next run."""
        self.facts[vehicle] |= facts
        keep_facts(self.dataset, vehicle, self.facts[vehicle])

    def copies(self) -> dict[str, str]:
        """Names of logs with the content of another log of the same vehicle, each with that log, which counts."""
        first: dict[tuple[str, str], str] = {}
        found: dict[str, str] = {}
        for vehicle, log, content in self._surveyed():
            original = first.setdefault((vehicle, content), log)
            found |= {log: original} if original != log else {}
        return found

    def of_others(self) -> dict[str, str]:
        """Names of logs with the content of another vehicle's log, each with that log: one of them is misfiled."""
        first: dict[str, tuple[str, str]] = {}
        found: dict[str, str] = {}
        for vehicle, log, content in self._surveyed():
            owner, original = first.setdefault(content, (vehicle, f"{log} of {vehicle}"))
            found |= {f"{log} of {vehicle}": original} if owner != vehicle else {}
        return found

    def _surveyed(self) -> Iterator[tuple[str, str, str]]:
        """Vehicle, name and content of each log that has frames and is surveyed."""
        for assignment, group in zip(self.manifest.assignments, self.logs, strict=True):
            for log in group:
                told = self.facts[assignment.vehicle].get(log.key)
                if told is not None and told.first_ns is not None:
                    yield assignment.vehicle, log.name, told.content_sha256

    def jobs(self) -> list[ArchiveJob]:
        """The jobs of every fully surveyed vehicle, the largest first: a missing log would change its job.

        Copies of logs are left out.
        """
        copies = self.copies()
        pairs = list(zip(self.manifest.assignments, self.logs, strict=True))
        in_part = {
            assignment.vehicle
            for assignment, group in pairs
            if str(assignment.logs) in self.lost or any(log.key not in self.facts[assignment.vehicle] for log in group)
        }
        found: list[ArchiveJob] = []
        for assignment, group in pairs:
            if assignment.vehicle not in in_part:
                facts = self.facts[assignment.vehicle]
                own = [log for log in group if log.name not in copies]
                found += plan(self.dataset, assignment, own, facts, self.manifest.settings)
        return sorted(found, key=lambda job: (-job.size, job.slot))


def look(manifest: Manifest, dataset: Location) -> Inventory:
    """List every vehicle's logs. Raises ConfigurationError if there are none, PlaceError for the data set."""
    vehicles = sorted({assignment.vehicle for assignment in manifest.assignments})
    with ThreadPoolExecutor(AT_A_TIME) as asking:  # a store takes its time for each, and many at once
        listed = list(asking.map(_listed, manifest.assignments))
        facts = dict(zip(vehicles, asking.map(lambda vehicle: known_facts(dataset, vehicle), vehicles), strict=True))
    logs = [found if isinstance(found, list) else [] for found in listed]
    pairs = zip(manifest.assignments, listed, strict=True)
    lost = {str(assignment.logs): str(found) for assignment, found in pairs if isinstance(found, PlaceError)}
    if not any(logs) and not lost:
        raise ConfigurationError(
            f"{manifest.where}: not one log in the folders of its vehicles, the first of which is "
            f"{manifest.assignments[0].logs}; see logs there"
        )
    return Inventory(manifest, dataset, logs, facts, lost)


def _listed(assignment: Assignment) -> list[LogFile] | PlaceError:
    try:
        return logs_of(assignment)
    except PlaceError as fault:
        return fault
