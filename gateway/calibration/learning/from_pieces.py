"""From pieces of drives and statements about them to a calibration."""

import hashlib
import json
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import chain
from math import isfinite, nan
from statistics import median
from typing import Final

import numpy as np

from gateway.calibration.assigned import Assigned, assign
from gateway.calibration.file import CalibrationFile
from gateway.calibration.found import FoundClaim, FoundLoad
from gateway.calibration.from_drives import OnFit, Outcome, calibrate_inspected
from gateway.calibration.inspection.across_runs import Inspection
from gateway.calibration.inspection.facts import InspectedRun, LogFacts, RowFacts
from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.calibration.inspection.run_checks import inspect_run
from gateway.calibration.learning.windows import Driven, chosen
from gateway.calibration.stated_drive import StatedDrive, drive_name
from gateway.calibration.statements import Statement
from gateway.core.batch_settings import BatchSettings
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.errors import CalibrationImpossibleError
from gateway.estimates.quantity import Z95
from gateway.records import Batch
from gateway.stated.statement import StatementRecord

OF_CAMPAIGNS: Final = frozenset(
    {Kind.TOO_SHORT, Kind.BATCHES_LOST, Kind.UNSTEADY, Kind.SMOOTH_ROAD, Kind.SPEED_DIFFERS, Kind.NO_USABLE_BATCH}
)
"""Kinds of findings about drives that were meant to be alike; ordinary ones are not."""
LOOKED_FOR: Final = frozenset(Kind) - OF_CAMPAIGNS
SCATTER_KG: Final = 5.0  # chosen: standard deviation of driver, tank and loose items
ALIKE: Final = 2.5  # chosen: standard deviations from the mode
LEAST_MEMBERS: Final = 2
SURE_SHARE: Final = 0.1  # chosen: of the largest payload; with a narrower interval about zero one drive is enough
STEP_KG: Final = 2.0  # chosen: of the search for the mode


@dataclass(frozen=True, slots=True)
class LearntDrive:
    """A piece of a drive that taught: what is stated of its load, and what was found of it.

    ``holding`` are the records that hold for it, ``claims`` say what became of each, ``load`` is None if the drive had
    too little steady driving.
    """

    number: int
    driven: Driven
    statement: Statement
    holding: tuple[int, ...]
    load: FoundLoad | None
    claims: tuple[FoundClaim, ...]


@dataclass(frozen=True, slots=True)
class Learnt:
    """The calibration, and the drives it was made from, numbered from 1.

    ``n_unneeded`` pieces of unknown load were not used, ``findings`` are of pieces that were left out for a fault of a
    sensor or of the map.
    """

    outcome: Outcome
    drives: tuple[LearntDrive, ...]
    n_unneeded: int
    findings: Mapping[str, tuple[Finding, ...]]

    def looking_empty(self, laden: Sequence[tuple[int, int]] = ()) -> tuple[int, ...]:
        """The numbers of the drives of unknown load that look empty; none of those at a time (ns) of ``laden``."""
        unknown = {
            one.number: one.load
            for one in self.drives
            if one.load and not one.statement.is_of_payload and not any(one.driven.piece.meets(*span) for span in laden)
        }
        members = _near_zero(list(unknown.values()), self.outcome.file.vehicle)
        return tuple(number for number, load in unknown.items() if any(load is member for member in members))


def _near_zero(loads: Sequence[FoundLoad], vehicle: Vehicle) -> tuple[FoundLoad, ...]:
    """Those of these drives of unknown load that look empty: the lowest mode of their payloads, if it is near zero.

    The least payload of many is too low by chance; but empty drives are many, and their payloads alike. What drives do
    not share of their error tells them apart, even if the zero is not known well.
    """
    if not loads:
        return ()
    payload_kg = np.array([one.load.payload_kg for one in loads])
    std_kg = np.hypot([one.own_std_kg for one in loads], SCATTER_KG)
    at_kg = np.arange(payload_kg.min() - STEP_KG, payload_kg.max() + 2.0 * STEP_KG, STEP_KG)
    density = np.sum(np.exp(-0.5 * ((at_kg[:, None] - payload_kg) / std_kg) ** 2) / std_kg, axis=1)
    modes = at_kg[1:-1][(density[1:-1] >= density[:-2]) & (density[1:-1] > density[2:])]
    for mode_kg in modes.tolist():
        members = [one for one, x, std in zip(loads, payload_kg, std_kg, strict=True) if abs(x - mode_kg) < ALIKE * std]
        if not members:
            continue
        half_kg = Z95 * float(np.hypot(median(one.payload_std_kg for one in members), SCATTER_KG))
        if mode_kg - half_kg > 0.0:
            return ()
        is_sure = abs(mode_kg) + half_kg < SURE_SHARE * vehicle.largest_payload_kg
        if len(members) >= LEAST_MEMBERS or is_sure:
            return tuple(members)
    return ()


def matched(records: Sequence[StatementRecord], driven: Sequence[Driven], vehicle: Vehicle) -> Assigned:
    """What these records say of the pieces."""
    return assign(records, [one.piece for one in driven], vehicle)


def command_of(like: CalibrationFile | None, window_s: float) -> str:
    """What decides the result, beside drives and statements, as a command."""
    words = ["springscale", "learn"]
    words += [] if like is None else ["--like", like.id]
    words += [] if window_s == BatchSettings().window_s else ["--window-s", f"{window_s:g}"]
    return shlex.join(words)


def learn(
    vehicle: Vehicle,
    driven: Sequence[Driven],
    assigned: Assigned,
    settings: BatchSettings,
    *,
    like: CalibrationFile | None = None,
    on_fit: OnFit = lambda name, done, of: None,
) -> Learnt:
    """The calibration that these pieces and statements give. The same from logs and in a service, byte for byte.

    Raises CalibrationImpossibleError if no drive can teach.
    """
    faults = {one.name: found for one in driven if (found := _faults(one, vehicle, settings))}
    sound = [i for i, one in enumerate(driven) if one.name not in faults]
    if not sound:
        raise CalibrationImpossibleError(_nothing(faults))
    best = chosen([driven[i] for i in sound], [bool(assigned.holding[i]) for i in sound])
    used = [sound[i] for i in best]
    runs = [
        InspectedRun(_run(number, driven[i], assigned.statements[i], vehicle), log=_facts(driven[i]))
        for number, i in enumerate(used, 1)
    ]
    outcome = calibrate_inspected(
        vehicle,
        Inspection(tuple(runs)),
        where=vehicle.name,
        sha256=hashlib.sha256(json.dumps(asdict(vehicle), sort_keys=True).encode()).hexdigest(),
        estimators=("cross_spectrum",),
        like=like,
        command=command_of(like, settings.window_s),
        on_fit=on_fit,
    )
    taught = outcome.cross_spectrum
    drives = []
    for number, i in enumerate(used, 1):
        name = drive_name(number)
        load = taught.load_of(name) if taught else None
        claims = tuple(one for one in taught.claims if one.drive == name) if taught else ()
        drives.append(LearntDrive(number, driven[i], assigned.statements[i], assigned.holding[i], load, claims))
    return Learnt(outcome, tuple(drives), len(sound) - len(used), faults)


def _nothing(faults: Mapping[str, Sequence[Finding]]) -> str:
    if not faults:
        return "nothing to learn from yet: a drive teaches from a minute of steady driving with both sensors on"
    told = "; ".join(f"{kind}: {sentence}" for kind, sentence in faults_told(faults))
    return f"nothing to learn from: every drive has a fault: {told}"


def faults_told(faults: Mapping[str, Sequence[Finding]]) -> Iterator[tuple[Kind, str]]:
    """Each kind of fault with a sentence that has the numbers of the last drive with it."""
    by_kind: dict[Kind, list[Finding]] = {}
    for one in chain.from_iterable(faults.values()):
        by_kind.setdefault(one.kind, []).append(one)
    for kind, found in by_kind.items():
        of_several = f" ({len(found)} drives)" if len(found) > 1 else ""
        yield kind, f"{found[-1].text}{of_several}: {kind.advice}"


def _facts(one: Driven) -> LogFacts:
    return LogFacts(sha256=one.sha256, duration_s=one.facts.duration_s, span_ns=(one.piece.begin_ns, one.piece.end_ns))


def _faults(one: Driven, vehicle: Vehicle, settings: BatchSettings) -> tuple[Finding, ...]:
    """What is wrong with the sensors or the map in this piece."""
    found = inspected(one.batches, one.facts, _facts(one), vehicle, settings)
    return tuple(finding for finding in found if finding.severity is Severity.FAULT)


def inspected(
    batches: Sequence[Batch], rows: RowFacts, log: LogFacts, vehicle: Vehicle, settings: BatchSettings
) -> tuple[Finding, ...]:
    """What is wrong with the sensors, the map or the log of an ordinary drive, whatever is known of its load."""
    whole = InspectedRun(StatedDrive("", tuple(batches)), facts=rows, log=log)
    return inspect_run(whole, vehicle, settings, LOOKED_FOR)


def _run(number: int, one: Driven, statement: Statement, vehicle: Vehicle) -> StatedDrive:
    payload_kg = nan if statement.payload_kg is None else statement.payload_kg
    share_pct = nan
    if statement.front_share_pct is not None:
        share_pct = statement.front_share_pct
    elif isfinite(payload_kg) and statement.has_place:
        share_pct = front_share_pct(vehicle, payload_kg, statement.position_m)
    return StatedDrive(drive_name(number), one.batches, statement, payload_kg, share_pct, number, one.name)
