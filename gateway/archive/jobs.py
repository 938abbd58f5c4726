"""Jobs: one vehicle's drives of one month in order, by one calibration, named by the hash of their inputs.

If a log continues the one before it, the drive continues with its window and load epoch. So a job begins with the
pipeline at the end of the logs before it (``lead_in``), and may leave a window open for the next job.
"""

import functools
import hashlib
import json
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import groupby
from pathlib import Path
from typing import Any, Final

from gateway.archive.dataset import SCHEMA_VERSION
from gateway.archive.manifest import Assignment
from gateway.archive.places import Location
from gateway.archive.receipts import Slot
from gateway.archive.survey import Facts, LogFile, SurveyedLog
from gateway.core.batch_settings import BatchSettings
from gateway.setup import Setup
from gateway.units import NS_PER_S
from gateway.weighing.flow import Identity

PACKAGE: Final = Path(__file__).parents[1]


@functools.cache
def software() -> str:
    """springscale 1.2.3 code 0123456789ab."""
    return f"springscale {version('springscale')} code {code_id()}"


def code_id(package: Path = PACKAGE) -> str:
    """Hash of every module of the package, as installed."""
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        digest.update(f"{path.relative_to(package).as_posix()}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


LEAD_IN_NS: Final = 25 * 3600 * NS_PER_S
"""Logs that began so long before a job's first may still be under way in its first drive: a day's log, and an hour."""
UNKNOWN_MONTH: Final = "unknown"


@dataclass(frozen=True, slots=True)
class JobLog:
    """A log of a job: its place, its surveyed facts, and its start, or its place in time if it has no frame."""

    log: LogFile
    facts: SurveyedLog
    start_ns: int

    @property
    def month(self) -> str:
        """The month under which it is filed, UTC."""
        return f"{datetime.fromtimestamp(self.start_ns // NS_PER_S, UTC):%Y-%m}" if self.start_ns else UNKNOWN_MONTH


@dataclass(frozen=True, slots=True)
class ArchiveJob:
    """The complete input of a worker, which determines its result.

    ``next_ns`` is the first frame of the following log in another job; None without one.
    """

    dataset: Location
    slot: Slot
    identity: Identity
    setup: Setup
    settings: BatchSettings
    lead_in: tuple[JobLog, ...]
    logs: tuple[JobLog, ...]
    next_ns: int | None
    inputs: Mapping[str, Any]

    @property
    def size(self) -> int:
        return sum(one.log.size for one in self.logs)


def plan(
    dataset: Location, assignment: Assignment, logs: Sequence[LogFile], facts: Facts, settings: BatchSettings
) -> Iterator[ArchiveJob]:
    """The jobs of one assignment, month by month. Logs without facts are left out."""
    setup = assignment.setup
    common = {
        "schema": SCHEMA_VERSION,
        "software": software(),
        "vehicle": assignment.vehicle,
        "vin": assignment.vin,
        "estimator": setup.estimator,
        "calibration": setup.calibration.id if setup.calibration else None,
        "signals": signals_id(setup),
        "settings": asdict(settings),
        "limits": setup.limits.stated(),
    }
    identity = Identity(assignment.vehicle, assignment.vin)
    for month, lead_in, own, next_ns in _months(_in_order(logs, facts, assignment.span_ns)):
        inputs = {
            **common,
            "lead_in": [one.facts.sha256 for one in lead_in],
            "logs": [[one.log.name, one.facts.sha256] for one in own],
            "next_ns": next_ns,
        }
        slot = Slot(assignment.vehicle, month, hash_of(inputs))
        yield ArchiveJob(dataset, slot, identity, setup, settings, tuple(lead_in), tuple(own), next_ns, inputs)


def _months(logs: Sequence[JobLog]) -> Iterator[tuple[str, Sequence[JobLog], Sequence[JobLog], int | None]]:
    """Month by month: the lead-in logs, those of the month, and the start of the next one."""
    end = 0
    for month, group in groupby(logs, key=lambda one: one.month):
        begin, end = end, end + len(list(group))
        first = bisect_left(logs, logs[begin].start_ns - LEAD_IN_NS, key=lambda one: one.start_ns)
        yield month, logs[first:begin], logs[begin:end], logs[end].start_ns if end < len(logs) else None


def _in_order(logs: Sequence[LogFile], facts: Facts, span_ns: tuple[int, int]) -> list[JobLog]:
    """The logs of a span of time by first frame; one without a frame keeps its place by name."""
    known = [(log, facts[log.key]) for log in sorted(logs, key=lambda log: log.name) if log.key in facts]
    start_ns = next((told.first_ns for _, told in known if told.first_ns is not None), 0)
    found = []
    for log, told in known:
        start_ns = start_ns if told.first_ns is None else told.first_ns
        found.append(JobLog(log, told, start_ns))
    here = (one for one in found if not one.start_ns or span_ns[0] <= one.start_ns < span_ns[1])  # 0: nobody knows
    return sorted(here, key=lambda one: one.start_ns)


def hash_of(inputs: Mapping[str, Any]) -> str:
    """A job's name: the same for the same inputs, on any computer."""
    text = json.dumps(inputs, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def signals_id(setup: Setup) -> str:
    """Hash of a signal map's content with its databases resolved, without names and comments."""
    held = setup.signal_map
    content = repr((held.channel, held.j1939, str(held.zone), [(m, sorted(m.fields.items())) for m in held.messages]))
    return "sha256:" + hashlib.sha256(content.encode()).hexdigest()
