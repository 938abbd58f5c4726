"""The drives of logs, for a vehicle that learns from them.

    drives = read_drives(logs, signal_map, vehicle, moments(records), settings)

Each log is read once and cut into drives, where the vehicle stood for a minute; a drive is cut further where a
statement begins or ends inside it. Whatever cannot teach is named and counted.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from gateway.bus.signals import SignalMap
from gateway.calibration.inspection.facts import LogFacts, row_facts
from gateway.calibration.inspection.finding import Finding, Severity
from gateway.calibration.kept import KeptBatch, kept_batch_of
from gateway.calibration.learning.from_pieces import inspected
from gateway.calibration.learning.spans import can_teach
from gateway.calibration.learning.windows import Driven, Pieces, pieces
from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.core.vehicle import Vehicle
from gateway.errors import LogUnreadableError
from gateway.offline.campaigns import facts_of_log, read_whole_log
from gateway.records import FIRST_DATED_NS, Batch, Motion
from gateway.units import NS_PER_S

OnLog = Callable[[int, int], None]  # (logs done, logs in all)


@dataclass(frozen=True, slots=True)
class Drives:
    """The pieces that can teach, in order of time, and what became of the rest of the logs."""

    pieces: Pieces
    n_logs: int
    unreadable: dict[Path, str] = field(default_factory=dict)
    repeated: dict[Path, Path] = field(default_factory=dict)
    faulty: dict[Path, tuple[Finding, ...]] = field(default_factory=dict)
    findings: dict[Path, tuple[Finding, ...]] = field(default_factory=dict)
    remarks: dict[Path, tuple[str, ...]] = field(default_factory=dict)  # of the reader, without what is a finding

    @property
    def driven(self) -> tuple[Driven, ...]:
        """The pieces that can teach."""
        return self.pieces.driven


def read_drives(
    logs: Sequence[Path],
    signal_map: SignalMap,
    vehicle: Vehicle,
    at_ns: Sequence[int],
    settings: BatchSettings,
    on_log: OnLog = lambda done, of: None,
) -> Drives:
    """The drives of the logs, cut at the moments ``at_ns`` too. A log with a fault of a sensor teaches nothing; of logs
    of the same driving the one with most of it counts.
    """
    drives = Drives(Pieces(()), len(logs))
    kept: dict[Path, _Read] = {}
    for done, log in enumerate(logs):
        on_log(done, len(logs))
        try:
            motion, report = read_whole_log(log, signal_map)
        except LogUnreadableError as fault:
            drives.unreadable[log] = str(fault)
            continue
        facts = facts_of_log(log, motion, motion, report, signal_map)
        remarks = report.remarks(with_decoder=False)
        drives.remarks[log] = tuple(one for one in remarks if not one.endswith(facts.clock))
        found = windows_of_motion(motion, signal_map, settings)
        findings = _findings(motion, found, facts, signal_map, vehicle, settings)
        if any(one.severity is Severity.FAULT for one in findings):
            drives.faulty[log] = findings
            continue
        new = _Read(found, [one.batch for one in found if can_teach(one.batch, settings)], facts.samples_sha256)
        same = [other for other, one in kept.items() if new.is_of_same_driving(one)]
        if same and new.driven_s <= sum(kept[other].driven_s for other in same):
            drives.repeated[log] = same[0]
            continue
        drives.repeated.update({other: log for other, first in drives.repeated.items() if first in same})
        for other in same:
            drives.repeated[other] = log
            del kept[other]
            drives.findings.pop(other, None)
        kept[log] = new
        if findings:
            drives.findings[log] = findings
    on_log(len(logs), len(logs))
    source = {one.batch.drive_start_ns: str(log) for log, read in kept.items() for one in read.windows}
    windows = [one for read in kept.values() for one in read.windows]
    return replace(drives, pieces=pieces(windows, at_ns, settings, lambda one: source[one.batch.drive_start_ns]))


@dataclass(frozen=True, slots=True)
class _Read:
    """The windows of a log, those that teach, and the hash of its samples."""

    windows: list[KeptBatch]
    teaching: list[Batch]
    samples_sha256: str

    @property
    def driven_s(self) -> float:
        return sum(one.usable_s for one in self.teaching)

    def is_of_same_driving(self, other: "_Read") -> bool:
        """Whether two logs have driving in common: copies of any name and format, a second recorder."""
        is_copy = bool(self.samples_sha256) and self.samples_sha256 == other.samples_sha256
        return is_copy or any(_is_same_driving(one, its) for one in self.teaching for its in other.teaching)


def _is_same_driving(one: Batch, other: Batch) -> bool:
    """Whether two windows are of the same driving.

    Of times without a date only the same begin tells it: other drives begin at 0 too, but would be joined with this.
    """
    begin_ns, end_ns = max(one.t_start_ns, other.t_start_ns), min(one.t_end_ns, other.t_end_ns)
    if begin_ns < FIRST_DATED_NS:
        return one.t_start_ns == other.t_start_ns
    return end_ns - begin_ns > NS_PER_S


def windows_of_motion(motion: Motion, signal_map: SignalMap, settings: BatchSettings) -> list[KeptBatch]:
    """Every window of these rows, as a service would keep it."""
    scheduler = Scheduler(settings, signal_map.traits)
    windows = []
    for steps in (scheduler.feed(motion), scheduler.flush()):
        windows += [kept_batch_of(one, scheduler.take_rows(), signal_map.traits) for one in steps]
    return windows


def _findings(
    motion: Motion,
    windows: Sequence[KeptBatch],
    facts: LogFacts,
    signal_map: SignalMap,
    vehicle: Vehicle,
    settings: BatchSettings,
) -> tuple[Finding, ...]:
    """What is wrong with the sensors, the map or the log."""
    batches = [replace(one.batch, rejected=()) if can_teach(one.batch, settings) else one.batch for one in windows]
    return inspected(batches, row_facts(motion, signal_map.traits), facts, vehicle, settings)
