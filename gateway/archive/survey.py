"""Surveys logs before processing: every log's hash, that of its unpacked content, and the time of its first frame.

Each log is read completely once, and a packed one unpacked once more, on any worker. The facts are stored in the data
set (``logs/vehicle=X.json``), and are valid as long as the log's size and stamp are unchanged.
"""

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final
from zoneinfo import ZoneInfo

from gateway.archive.manifest import Assignment
from gateway.archive.places import Fetched, Location
from gateway.bus.logs import is_named_as_log, open_whole_log
from gateway.bus.logs.packed import is_packed, open_log_file
from gateway.errors import ConfigurationError, LogUnreadableError, ReaderMissingError

KNOWN: Final = "logs"  # folder of the data set


@dataclass(frozen=True, slots=True)
class LogFile:
    """A log and its place. ``name`` is its name in rows and receipts."""

    place: Location
    path: str
    name: str
    size: int
    stamp: str
    zone: ZoneInfo | None = None

    @property
    def key(self) -> str:
        """Unique for each log, content and zone of its date."""
        return f"{self.place.url}/{self.path} {self.size} {self.stamp} {self.zone or 'UTC'}"


@dataclass(frozen=True, slots=True)
class SurveyedLog:
    """Facts about a log's content. ``first_ns`` is None without a readable frame; ``fault`` then has the reason.

    Logs of one ``content_sha256`` are copies of each other, packed or not.
    """

    sha256: str
    content_sha256: str
    first_ns: int | None
    fault: str | None = None


Facts = dict[str, SurveyedLog]  # by LogFile.key


def logs_of(assignment: Assignment) -> list[LogFile]:
    """The logs in a vehicle's folder, by name. Raises PlaceError."""
    place, shown = assignment.logs, assignment.shown
    found = (item for item in place.items() if is_log(item.path))
    zone = assignment.setup.signal_map.zone
    return [LogFile(place, item.path, f"{shown}/{item.path}", item.size, item.stamp, zone) for item in found]


def is_log(path: str) -> bool:
    """Whether a file is a log by its name: it has the suffix of one, packed or not."""
    name = path.rpartition("/")[2]
    return not name.startswith(".") and is_named_as_log(name)


def known_facts(dataset: Location, vehicle: str) -> Facts:
    """Facts about a vehicle's logs from an earlier run."""
    try:
        told: Mapping[str, Any] = json.loads(dataset.read(_path(vehicle)))
        return {key: SurveyedLog(**facts) for key, facts in told.items()}
    except (FileNotFoundError, ValueError, TypeError):  # none yet, or of another version: survey again
        return {}


def keep_facts(dataset: Location, vehicle: str, facts: Facts) -> None:
    """Store the facts for the next run."""
    told = {key: asdict(one) for key, one in facts.items()}
    dataset.replace(_path(vehicle), (json.dumps(told, indent=0, sort_keys=True) + "\n").encode())


def _path(vehicle: str) -> str:
    return f"{KNOWN}/vehicle={vehicle}.json"


def survey(log: LogFile) -> SurveyedLog:
    """The facts of a log. Raises FileNotFoundError, PlaceError, or ConfigurationError without a library."""
    with log.place.fetched(log.path) as fetched:
        content_sha256 = _content_sha256(fetched)
        try:
            first_ns = _first_ns(log, fetched.path)
        except ReaderMissingError as fault:  # no fault of the log
            raise ConfigurationError(str(fault).replace(str(fetched.path), log.name)) from None
        except LogUnreadableError as fault:
            why = str(fault).replace(str(fetched.path), log.name)
        except Exception as fault:  # noqa: BLE001 - a reader's surprise is this log's fault, not that of the others
            why = f"{log.name}: cannot be read: {fault!r}"
        else:
            return SurveyedLog(fetched.sha256, content_sha256, first_ns)
    return SurveyedLog(fetched.sha256, content_sha256, None, why)


def _first_ns(log: LogFile, path: Path) -> int:
    """The time of the first frame. Raises LogUnreadableError without one that has a date."""
    chunks, report = open_whole_log(path, zone=log.zone)
    first_ns = next((int(chunk.t_ns[0]) for chunk in chunks if len(chunk)), 0)
    if not report.is_dated:
        for _ in chunks:
            pass  # to its end: other faults of its stamps are told first
        report.require_dates()
    return first_ns


def _content_sha256(fetched: Fetched) -> str:
    """Hash of a log's unpacked content; that of the file itself if its packing is damaged."""
    with suppress(EOFError, OSError), open_log_file(fetched.path) as stream:
        if is_packed(stream):
            return hashlib.file_digest(stream, "sha256").hexdigest()  # type: ignore[arg-type] # it has readinto
    return fetched.sha256
