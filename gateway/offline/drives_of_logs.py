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
    dates: dict[Path, tuple[str, ...]] = field(default_factory=dict)  # what is not known of them
    repeated: dict[Path, Path] = field(default_factory=dict)
    faulty: dict[Path, tuple[Finding, ...]] = field(default_factory=dict)
    findings: dict[Path, tuple[Finding, ...]] = field(default_factory=dict)

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
    """The drives of the logs, cut at the moments ``at_ns`` too. A log with a fault of a sensor teaches nothing."""
    drives = Drives(Pieces(()), len(logs))
    windows: list[KeptBatch] = []
    source: dict[int, Path] = {}
    for done, log in enumerate(logs):
        on_log(done, len(logs))
        try:
            motion, report = read_whole_log(log, signal_map)
        except LogUnreadableError as fault:
            drives.unreadable[log] = str(fault)
            continue
        if remarks := tuple(report.remarks_on_dates()):
            drives.dates[log] = remarks
        facts = facts_of_log(log, motion, motion, report, signal_map)
        found = windows_of_motion(motion, signal_map, settings)
        teaching = [one.batch for one in found if can_teach(one.batch, settings)]
        repeated = (one.batch for one in windows if any(_is_same_driving(one.batch, other) for other in teaching))
        if (same := next(repeated, None)) is not None:
            drives.repeated[log] = source[same.drive_start_ns]
            continue
        findings = _findings(motion, found, facts, signal_map, vehicle, settings)
        kept = drives.faulty if any(one.severity is Severity.FAULT for one in findings) else drives.findings
        if findings:
            kept[log] = findings
        if log in drives.faulty:
            continue
        windows += found
        source |= {one.batch.drive_start_ns: log for one in found}
    on_log(len(logs), len(logs))
    found_pieces = pieces(windows, at_ns, settings, lambda one: str(source[one.batch.drive_start_ns]))
    return replace(drives, pieces=found_pieces)


def _is_same_driving(one: Batch, other: Batch) -> bool:
    """Whether two windows are of the same driving: a log named twice, its packed copy, a second recorder.

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
