"""Inspection of one drive: the table of checks, and their verdict."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Final

from gateway.calibration.inspection import of_rows, of_spectra
from gateway.calibration.inspection.finding import Finding, Kind, RunVerdict, Severity
from gateway.calibration.inspection.log import SplitRun
from gateway.calibration.inspection.seen import Part, Said, Seen
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Vehicle
from gateway.records import Why


@dataclass(frozen=True, slots=True)
class Check:
    """One row of the table: what is looked at, the kind of the findings, the test, and the kinds that explain it: if
    one of them was found before, this check says nothing.
    """

    part: Part
    kind: Kind
    look: Callable[[Seen], Said]
    unless: Collection[Kind] = ()


_ENDS: Final = frozenset({Kind.LOG_UNREADABLE, Kind.CUT_AWAY})
_NO_PITCH: Final = frozenset({Kind.RATES_SWAPPED, Kind.PITCH_RATE_AXIS})
_NO_SIZE: Final = _NO_PITCH | {Kind.PITCH_RATE_UNIT}
_UNSOUND: Final = _NO_SIZE | {Kind.SPEED_UNIT, Kind.PITCH_RATE_SIGN}
CHECKS: Final = (
    Check(Part.LOG, Kind.LOG_UNREADABLE, lambda seen: filter(None, [seen.drive.log.unreadable])),
    Check(Part.LOG, Kind.CUT_AWAY, of_rows.cut_away),
    Check(Part.ROWS, Kind.CHANNELS_SWAPPED, of_rows.gravity(Kind.CHANNELS_SWAPPED)),
    Check(Part.ROWS, Kind.ACCELERATION_SIGN, of_rows.gravity(Kind.ACCELERATION_SIGN)),
    Check(Part.ROWS, Kind.ACCELERATION_UNIT, of_rows.gravity(Kind.ACCELERATION_UNIT)),
    Check(Part.ROWS, Kind.ACCELERATION_AXIS, of_rows.gravity(Kind.ACCELERATION_AXIS)),
    Check(Part.LOG, Kind.LOG_DAMAGED, lambda seen: filter(None, [seen.drive.log.damage])),
    Check(Part.ROWS, Kind.SIGNAL_UNMAPPED, of_rows.unmapped),
    Check(Part.LOG, Kind.MAP_MISMATCH, of_rows.mismatched),
    Check(Part.ROWS, Kind.SENSOR_SILENT, of_rows.silent),
    Check(Part.ROWS, Kind.RATE_LOW, of_rows.slow),
    Check(Part.ROWS, Kind.JITTER, of_rows.jitter),
    Check(Part.ROWS, Kind.SPEED_FROZEN, of_rows.standing),
    Check(Part.ROWS, Kind.SPEED_MISSING, of_rows.speed_lost(Why.SPEED_MISSING)),
    Check(Part.ROWS, Kind.SPEED_FROZEN, of_rows.speed_lost(Why.SPEED_FROZEN)),
    Check(Part.ROWS, Kind.SPEED_OUTSIDE_GATE, of_rows.outside_gate),
    Check(Part.ROWS, Kind.GAPS, of_rows.masked(Why.GAP, Why.ACCELERATION_MISSING, Why.PITCH_RATE_MISSING)),
    Check(Part.ROWS, Kind.SENSOR_STUCK, of_rows.masked(Why.ACCELERATION_STUCK, Why.PITCH_RATE_STUCK)),
    Check(Part.ROWS, Kind.SENSOR_SATURATED, of_rows.masked(Why.ACCELERATION_SATURATED, Why.PITCH_RATE_SATURATED)),
    Check(Part.ROWS, Kind.ROLL_RATE_LOST, of_rows.roll_lost, (Kind.SENSOR_SILENT, Kind.RATE_LOW)),
    Check(Part.ROWS, Kind.UNSTEADY, of_rows.unsteady),
    Check(Part.ROLL, Kind.RATES_SWAPPED, of_spectra.rates_swapped),
    Check(Part.SPECTRA, Kind.PITCH_RATE_AXIS, lambda seen: of_spectra.apart(seen.spectra, seen.as_read), _NO_PITCH),
    Check(Part.SPECTRA, Kind.SPEED_UNIT, of_spectra.speed_unit, _NO_PITCH),
    Check(Part.SPECTRA, Kind.PITCH_RATE_UNIT, lambda seen: of_spectra.wrong_size(seen.corrected), _NO_PITCH),
    Check(Part.SPECTRA, Kind.PITCH_RATE_SIGN, of_spectra.pitch_sign, _NO_PITCH),
    Check(Part.ROLL, Kind.ROLL_RATE_AXIS, of_spectra.roll_axis, _NO_SIZE),
    Check(Part.ROLL, Kind.ROLL_RATE_UNIT, of_spectra.roll_unit, _NO_SIZE | {Kind.ROLL_RATE_AXIS}),
    Check(Part.SPECTRA, Kind.SENSOR_POSITION, of_spectra.position, _UNSOUND),
    Check(Part.SPECTRA, Kind.SMOOTH_ROAD, of_spectra.smooth),
    Check(Part.SPECTRA, Kind.COARSE_RESOLUTION, of_spectra.coarse),
    Check(Part.ROWS, Kind.PITCH_RATE_BIAS, of_rows.biased, (Kind.CHANNELS_SWAPPED, Kind.PITCH_RATE_UNIT)),
    Check(Part.ROWS, Kind.TOO_SHORT, of_rows.too_short),
    Check(Part.ROWS, Kind.NO_USABLE_BATCH, of_rows.none_left),
    Check(Part.ROWS, Kind.BATCHES_LOST, of_rows.some_lost),
)
"""In this order: a later check knows what the earlier ones found."""


def inspect_run(
    drive: SplitRun, vehicle: Vehicle, settings: BatchSettings, only: Collection[Kind] = frozenset(Kind)
) -> RunVerdict:
    """Every finding of one run, of these kinds, faults first."""
    seen = Seen(drive, vehicle, settings)
    for check in CHECKS:
        kinds = {finding.kind for finding in seen.found}
        if check.kind not in only or kinds & {*check.unless, *_ENDS} or not seen.has(check.part):
            continue
        for said in check.look(seen):
            text, severity = (said, None) if isinstance(said, str) else said
            seen.found.append(Finding.of(check.kind, text, severity))
    order = list(Severity)
    run = drive.identification
    return RunVerdict(run.number, run.name, tuple(sorted(seen.found, key=lambda one: order.index(one.severity))))
