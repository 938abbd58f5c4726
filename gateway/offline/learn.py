"""A vehicle learns from the logs of its ordinary drives and from what is said of their loads.

    drives = read_drives(logs, signal_map, vehicle, moments(records), settings)
    learnt = learn(campaign, drives, told)

Each log is read once and cut into drives, where the vehicle stood for a minute; a drive is cut further where a
statement begins or ends inside it. Whatever cannot teach is named and counted.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from math import isfinite, nan
from pathlib import Path
from typing import Final

from gateway.bus.signals import SignalMap
from gateway.calibration.assigned import Assigned, Piece, assign, cut
from gateway.calibration.calibrate import OnFit, Outcome, calibrate_inspected, drive_name
from gateway.calibration.campaign import Campaign
from gateway.calibration.empties import looking_empty
from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.inspection.campaign import Inspection
from gateway.calibration.inspection.finding import Finding, Kind, RunVerdict, Severity
from gateway.calibration.inspection.log import LogFacts, SplitRun
from gateway.calibration.inspection.rows import row_facts
from gateway.calibration.inspection.run import inspect_run
from gateway.calibration.known_run import KnownRun
from gateway.calibration.statements import Statement
from gateway.calibration.statements_csv import ToldRow
from gateway.calibration.vehicle import FoundClaim, FoundLoad
from gateway.core.pool import LEAST_LOAD_S, can_be_pooled
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.errors import CalibrationImpossibleError, LogUnreadableError
from gateway.offline.campaigns import batches_of_motion, facts_of_log, read_whole_log
from gateway.records import Batch, Motion

MOST_DRIVES: Final = 40  # chosen: a fit of so many takes minutes; more of the same teach little
OF_CAMPAIGNS: Final = frozenset(
    {Kind.TOO_SHORT, Kind.BATCHES_LOST, Kind.UNSTEADY, Kind.SMOOTH_ROAD, Kind.SPEED_DIFFERS, Kind.NO_USABLE_BATCH}
)
"""Kinds of findings about drives that were meant to be alike; ordinary ones are not."""
LOOKED_FOR: Final = frozenset(Kind) - OF_CAMPAIGNS

OnLog = Callable[[int, int], None]  # (logs done, logs in all)


@dataclass(frozen=True, slots=True)
class Driven:
    """A piece of a log that can teach: its batches with the log that they are of."""

    log: Path
    facts: LogFacts
    piece: Piece
    batches: tuple[Batch, ...]

    @property
    def usable_s(self) -> float:
        """Driving in batches that are used."""
        return sum(batch.usable_s for batch in self.batches if not batch.rejected)


@dataclass(frozen=True, slots=True)
class Drives:
    """The pieces that can teach, in order of time, and what became of the rest of the logs."""

    driven: tuple[Driven, ...]
    n_logs: int
    unreadable: dict[Path, str] = field(default_factory=dict)
    repeated: dict[Path, Path] = field(default_factory=dict)
    faulty: dict[Path, tuple[Finding, ...]] = field(default_factory=dict)
    findings: dict[Path, tuple[Finding, ...]] = field(default_factory=dict)
    n_short: int = 0
    short_s: float = 0.0


def read_drives(
    logs: Sequence[Path],
    signal_map: SignalMap,
    vehicle: Vehicle,
    at_ns: Sequence[int],
    settings: BatchSettings,
    on_log: OnLog = lambda done, of: None,
) -> Drives:
    """The drives of the logs, cut at the moments ``at_ns`` too. A log with a fault of a sensor teaches nothing."""
    driven: list[Driven] = []
    drives = Drives((), len(logs))
    read: dict[str, Path] = {}
    n_drives = n_short = 0
    short_s = 0.0
    for done, log in enumerate(logs):
        on_log(done, len(logs))
        try:
            motion, report = read_whole_log(log, signal_map)
        except LogUnreadableError as fault:
            drives.unreadable[log] = str(fault)
            continue
        facts = facts_of_log(log, motion, motion, report, signal_map)
        if (first := read.setdefault(facts.sha256, log)) != log:
            drives.repeated[log] = first
            continue
        batches = [_with_short(batch, settings) for batch in batches_of_motion(motion, signal_map, settings)]
        findings = _findings(log, motion, batches, facts, signal_map, vehicle, settings)
        kept = drives.faulty if any(one.severity is Severity.FAULT for one in findings) else drives.findings
        if findings:
            kept[log] = findings
        if log in drives.faulty:
            continue
        for _, of_drive in groupby(batches, lambda batch: batch.drive_start_ns):
            n_drives += 1
            for span, found in _pieces(list(of_drive), motion, at_ns, signal_map, settings):
                if any(not batch.rejected for batch in found):
                    own = replace(facts, span_ns=span)
                    driven.append(Driven(log, own, Piece(*span, n_drives), tuple(found)))
                else:
                    n_short += 1
                    short_s += sum(batch.usable_s for batch in found)
    on_log(len(logs), len(logs))
    driven.sort(key=lambda one: one.piece.begin_ns)
    return replace(drives, driven=tuple(driven), n_short=n_short, short_s=short_s)


def _with_short(batch: Batch, settings: BatchSettings) -> Batch:
    """A stretch of driving that only lacks length teaches too."""
    is_enough = batch.rejected and batch.usable_s >= LEAST_LOAD_S and can_be_pooled(batch, settings)
    return replace(batch, rejected=()) if is_enough else batch


def _pieces(
    batches: list[Batch], motion: Motion, at_ns: Sequence[int], signal_map: SignalMap, settings: BatchSettings
) -> Iterator[tuple[tuple[int, int], list[Batch]]]:
    """A drive, whole or cut, with the batches of each piece."""
    begin_ns, end_ns = batches[0].t_start_ns, batches[-1].t_end_ns
    bounds = cut(begin_ns, end_ns, at_ns)
    if len(bounds) == 1:
        yield bounds[0], batches
        return
    for begin, end in bounds:
        rows = motion.rows((motion.t_ns >= begin) & (motion.t_ns < end))
        yield (begin, end), [_with_short(one, settings) for one in batches_of_motion(rows, signal_map, settings)]


def _findings(
    log: Path,
    motion: Motion,
    batches: Sequence[Batch],
    facts: LogFacts,
    signal_map: SignalMap,
    vehicle: Vehicle,
    settings: BatchSettings,
) -> tuple[Finding, ...]:
    """What is wrong with the sensors, the map or the log."""
    run = KnownRun(1, log.name, nan, nan, tuple(batches))
    whole = SplitRun(run, replace(run, batches=()), row_facts(motion, signal_map.traits), log=facts)
    return inspect_run(whole, vehicle, settings, LOOKED_FOR).findings


@dataclass(frozen=True, slots=True)
class Learnt:
    """The calibration, the drives it was made from with what is stated of each, and what became of each statement.

    drives, statements and ``holding`` (records that hold for it) go together, numbered from 1; ``n_unneeded`` drives of
    unknown load were not used.
    """

    outcome: Outcome
    drives: tuple[Driven, ...]
    statements: tuple[Statement, ...]
    holding: tuple[tuple[int, ...], ...]
    n_unneeded: int

    @property
    def loads(self) -> dict[int, FoundLoad]:
        """What was found of each drive's load, by its number."""
        taught = self.outcome.cross_spectrum
        by_name = {one.name: one for one in taught.loads} if taught else {}
        numbers = range(1, len(self.drives) + 1)
        return {number: by_name[drive_name(number)] for number in numbers if drive_name(number) in by_name}

    def claims_of(self, number: int) -> list[FoundClaim]:
        """What became of the statements about a drive."""
        taught = self.outcome.cross_spectrum
        return [one for one in (taught.claims if taught else ()) if one.drive == drive_name(number)]

    @property
    def empty(self) -> tuple[int, ...]:
        """The numbers of the drives of unknown load that look empty."""
        unknown = {number: one for number, one in self.loads.items() if not self.statements[number - 1].is_of_payload}
        members = looking_empty(list(unknown.values()), self.outcome.file.vehicle)
        return tuple(number for number, one in unknown.items() if any(one is member for member in members))


def matched(rows: Sequence[ToldRow], drives: Drives, vehicle: Vehicle) -> Assigned:
    """What these rows say of the drives."""
    return assign([row.record for row in rows], [one.piece for one in drives.driven], vehicle)


def learn(
    campaign: Campaign,
    drives: Drives,
    assigned: Assigned,
    *,
    like: CalibrationFile | None = None,
    command: str = "",
    on_fit: OnFit = lambda name, done, of: None,
) -> Learnt:
    """The calibration that the drives and statements of the campaign's vehicle give.

    Raises CalibrationImpossibleError if no drive can teach.
    """
    if not drives.driven:
        raise CalibrationImpossibleError(
            f"nothing to learn from in {drives.n_logs} logs: each drive needs a minute of steady driving with both "
            "sensors; what was found is above"
        )
    chosen = _chosen(drives.driven, assigned)
    split, verdicts = [], []
    for number, i in enumerate(chosen, 1):
        one, statement = drives.driven[i], assigned.statements[i]
        run = _run(number, one, statement, campaign.vehicle)
        split.append(SplitRun(run, replace(run, batches=()), log=one.facts))
        verdicts.append(RunVerdict(number, run.name))
    outcome = calibrate_inspected(
        campaign,
        Inspection(tuple(split), tuple(verdicts), ()),
        estimators=("cross_spectrum",),
        like=like,
        command=command,
        on_fit=on_fit,
    )
    return Learnt(
        outcome,
        tuple(drives.driven[i] for i in chosen),
        tuple(assigned.statements[i] for i in chosen),
        tuple(assigned.holding[i] for i in chosen),
        len(drives.driven) - len(chosen),
    )


def _chosen(driven: Sequence[Driven], assigned: Assigned) -> list[int]:
    """The drives that teach most, in order of time: those with a statement, then those with the most driving."""
    order = sorted(range(len(driven)), key=lambda i: (not assigned.holding[i], -driven[i].usable_s))
    return sorted(order[:MOST_DRIVES])


def _run(number: int, one: Driven, statement: Statement, vehicle: Vehicle) -> KnownRun:
    payload_kg = nan if statement.payload_kg is None else statement.payload_kg
    share_pct = nan
    if statement.front_share_pct is not None:
        share_pct = statement.front_share_pct
    elif isfinite(payload_kg) and statement.has_place:
        share_pct = front_share_pct(vehicle, payload_kg, statement.position_m)
    return KnownRun(
        number,
        one.log.name,
        payload_kg,
        share_pct,
        one.batches,
        statement.left_m,
        statement.payload_plus_minus_kg,
        said=statement,
    )
