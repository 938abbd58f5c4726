"""What there is before anything is weighed: every log's hash and the instant of its first frame.

A log is read once for that, whole, on any worker; what was found is kept in the data set (``logs/vehicle=X.json``), and
holds as long as the log's size and stamp do.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from gateway.archive.manifest import Assignment, Manifest
from gateway.archive.places import Place, PlaceError
from gateway.bus.logs import open_whole_log
from gateway.errors import ConfigurationError, LogUnreadableError, ReaderMissingError

KNOWN: Final = "logs"  # folder of the data set
MOST_LOGS: Final = 32  # surveyed in one go
MOST_BYTES: Final = 64_000_000


@dataclass(frozen=True, slots=True)
class LogFile:
    """A log where it lies. ``name`` is what rows and receipts call it."""

    place: Place
    path: str
    name: str
    size: int
    stamp: str

    @property
    def key(self) -> str:
        """Different for any other log, and for this one with another content."""
        return f"{self.place.url}/{self.path} {self.size} {self.stamp}"


@dataclass(frozen=True, slots=True)
class LogFacts:
    """What a log's content tells. ``first_ns`` is None, and ``fault`` says why, where it has no readable frame."""

    sha256: str
    first_ns: int | None
    fault: str | None = None


Facts = dict[str, LogFacts]  # by LogFile.key


@dataclass(frozen=True, slots=True)
class Surveyed:
    """Of one go: what was found, and what could not be reached (by name: why)."""

    facts: Facts
    lost: dict[str, str]


def logs_of(manifest: Manifest, assignment: Assignment) -> list[LogFile]:
    """The logs in a vehicle's folder, by name. Raises PlaceError."""
    place, shown = assignment.logs, assignment.shown
    found = (item for item in place.items() if manifest.is_log(item.path))
    return [LogFile(place, item.path, f"{shown}/{item.path}", item.size, item.stamp) for item in found]


def survey(logs: Sequence[LogFile]) -> Surveyed:
    """Read every log once; what cannot be reached now is told as lost. Raises ConfigurationError without a library."""
    facts: Facts = {}
    lost: dict[str, str] = {}
    for log in logs:
        try:
            facts[log.key] = _facts_of(log)
        except (FileNotFoundError, PlaceError) as fault:
            lost[log.name] = str(fault)
    return Surveyed(facts, lost)


def in_goes(logs: Iterable[LogFile]) -> Iterator[tuple[LogFile, ...]]:
    """Logs in groups that are worth a worker's turn."""
    group: list[LogFile] = []
    for log in logs:
        group.append(log)
        if len(group) >= MOST_LOGS or sum(one.size for one in group) >= MOST_BYTES:
            yield tuple(group)
            group = []
    if group:
        yield tuple(group)


def known_facts(dataset: Place, vehicle: str) -> Facts:
    """What an earlier run has found of a vehicle's logs."""
    try:
        told: Mapping[str, Any] = json.loads(dataset.read(_path(vehicle)))
        return {key: LogFacts(**facts) for key, facts in told.items()}
    except (FileNotFoundError, ValueError, TypeError):  # none yet, or not as this version writes it: looked at anew
        return {}


def keep_facts(dataset: Place, vehicle: str, facts: Facts) -> None:
    """Remember what was found, for the next run."""
    told = {key: {"sha256": one.sha256, "first_ns": one.first_ns, "fault": one.fault} for key, one in facts.items()}
    dataset.replace(_path(vehicle), (json.dumps(told, indent=0, sort_keys=True) + "\n").encode())


def _path(vehicle: str) -> str:
    return f"{KNOWN}/vehicle={vehicle}.json"


def _facts_of(log: LogFile) -> LogFacts:
    with log.place.fetched(log.path) as fetched:
        try:
            chunks, report = open_whole_log(fetched.path)
            first_ns = next((int(chunk.t_ns[0]) for chunk in chunks if len(chunk)), None)
            if first_ns is None:
                report.require_frames()
        except ReaderMissingError as fault:  # no fault of the log
            raise ConfigurationError(str(fault).replace(str(fetched.path), log.name)) from None
        except LogUnreadableError as fault:
            return LogFacts(fetched.sha256, None, str(fault).replace(str(fetched.path), log.name))
        except Exception as fault:  # noqa: BLE001 - a reader's surprise is this log's fault, not that of the others
            return LogFacts(fetched.sha256, None, f"{log.name}: cannot be read: {fault!r}")
    return LogFacts(fetched.sha256, first_ns)
