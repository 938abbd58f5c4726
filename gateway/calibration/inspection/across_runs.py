"""Findings about all runs of a campaign: whether loads suffice, and whether speeds and roads are comparable."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import isfinite
from typing import Final

import numpy as np

from gateway.calibration.inspection.facts import InspectedRun
from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.calibration.inspection.roll import roll_sign_of
from gateway.calibration.inspection.run_checks import inspect_run
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.batch_settings import BatchSettings
from gateway.core.vehicle import Vehicle
from gateway.estimates.quantity import Z95
from gateway.weighing.calibrated import is_other_rate

SPEED_DIFFERS_BY: Final = 0.2  # chosen: of the median run's speed
BEYOND_RANGE_BY: Final = 0.25  # chosen: of the range
SMOOTHER_BY: Final = 4.0  # chosen: factor of the vertical acceleration
ALIKE_SHARE: Final = 0.05  # of the empty mass: the scatter of the ratio index over five minutes
SHARES_ALIKE_PCT: Final = 1.0  # chosen: twice the default error of the empty share
TOGETHER: Final = 0.97  # chosen: correlation above which payload and share cannot be separated
HARDLY_KNOWN_M: Final = 0.1  # chosen: standard deviation; a tape gives 0.02

OfRun = Iterator[tuple[int, Finding]]
"""Findings with the number of the run that each is about."""


@dataclass(frozen=True, slots=True)
class Inspection:
    """Every run in the order of the campaign; ``findings`` are of the campaign as a whole."""

    runs: tuple[InspectedRun, ...]
    findings: tuple[Finding, ...] = ()

    @property
    def usable(self) -> tuple[InspectedRun, ...]:
        """The runs without a fault."""
        return tuple(one for one in self.runs if one.is_usable)

    def excusing(self, kind: Kind) -> "Inspection":
        """Without its findings of this ``kind`` about the campaign as a whole."""
        return replace(self, findings=tuple(one for one in self.findings if one.kind is not kind))

    @property
    def refusal(self) -> str | None:
        """Why no valid calibration is possible; None if the usable runs allow one."""
        stated = [one for one in self.runs if one.has_identification]
        left = [one for one in self.usable if one.has_identification]
        if not stated:
            return (
                "no run is meant for identification: identification_fraction or the runs' split leaves nothing to "
                "calibrate with"
            )
        if not left:
            return "no run can be used"
        left_kg, stated_kg = ({one.identification.payload_kg for one in runs} for runs in (left, stated))
        if len(left_kg) == 1 < len(stated_kg) and all(isfinite(kg) for kg in left_kg):
            return f"faults leave only runs with {left[0].identification.payload_kg:g} kg, which is no scale"
        return None

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings that a calibration file records."""
        warnings = [f"{one.kind}: {one.text}" for one in self.findings if one.severity is not Severity.NOTE]
        for run in self.runs:
            kept, left_out = (Severity.WARNING, "") if run.is_usable else (Severity.FAULT, " left out")
            what = f"run {run.run.number}{left_out}"
            warnings += [f"{what}: {one.kind}: {one.text}" for one in run.findings if one.severity is kept]
        return tuple(warnings)


def inspect_drives(
    drives: Sequence[InspectedRun], vehicle: Vehicle, settings: BatchSettings, *, has_roll_rate: bool = True
) -> Inspection:
    """What is found of every run, in the order given, and of the campaign as a whole."""
    found = {one.run.number: list(inspect_run(one, vehicle, settings)) for one in drives}
    for number, finding in (*_same_drive(drives), *_beyond_range(drives, vehicle), *_beside_the_others(drives)):
        found[number].append(finding)
    roll_sign = roll_sign_of(_usable(drives, found), vehicle)
    if roll_sign is not None and roll_sign.sign < 0:
        for run in _usable(drives, found):
            found[run.number].append(Finding.of(Kind.ROLL_RATE_SIGN, roll_sign.why))
    findings = list(load_findings(_usable(drives, found), vehicle))
    if roll_sign is not None and roll_sign.sign == 0:
        findings.append(Finding.of(Kind.ROLL_RATE_SIGN_UNTOLD, roll_sign.why))
    if not has_roll_rate:
        findings.append(Finding.of(Kind.ROLL_RATE_UNMAPPED, "springscale look shows what a log holds"))
    if (std_m := vehicle.sensor_left_std_m) > HARDLY_KNOWN_M:
        text = f"sensor_offset_left_m is {vehicle.sensor_left_m:g} ± {Z95 * std_m:.2g} m (95 %)"
        findings.append(Finding.of(Kind.SENSOR_OFFSET_UNKNOWN, text))
    inspected = (replace(one, findings=tuple(found[one.run.number])) for one in drives)
    return Inspection(tuple(inspected), tuple(findings))


def _usable(drives: Sequence[InspectedRun], found: Mapping[int, Sequence[Finding]]) -> list[StatedDrive]:
    """The identification parts of the runs in which no fault was found so far."""
    runs = [one.identification for one in drives if one.has_identification]
    return [run for run in runs if not any(one.severity is Severity.FAULT for one in found[run.number])]


def _same_drive(drives: Sequence[InspectedRun]) -> OfRun:
    """Runs that are the same piece of the same log: all but the first; all of them if loads differ."""
    for one, other in combinations(drives, 2):
        if one.log.is_of_same_drive(other.log):
            numbers, is_same_load = (one.run.number, other.run.number), one.run.load == other.run.load
            text = f"runs {numbers[0]} and {numbers[1]} are the same drive"
            for number in numbers[1:] if is_same_load else numbers:
                yield number, Finding.of(Kind.SAME_DRIVE, text if is_same_load else f"{text} with two different loads")


def _beyond_range(drives: Sequence[InspectedRun], vehicle: Vehicle) -> OfRun:
    low_kg, high_kg = vehicle.payload_range_kg
    for run in (one.run for one in drives):
        if run.payload_kg > high_kg + BEYOND_RANGE_BY * (high_kg - low_kg):
            text = f"{run.payload_kg:g} kg, payload_range_kg ends at {high_kg:g} kg"
            yield run.number, Finding.of(Kind.LOAD_BEYOND_RANGE, text)


def _beside_the_others(drives: Sequence[InspectedRun]) -> OfRun:
    """Runs at another speed, on a far smoother road, or sampled at another rate than the median run."""
    rows = [
        (
            float(np.mean([b.mean_speed_mps for b in batches])),
            float(np.mean([np.std(b.vertical_acceleration_mps2[b.usable]) for b in batches])),
            float(np.median([b.sensor_rate_hz for b in batches])),
            one.run.number,
        )
        for one in drives
        if (batches := [b for b in one.run.batches if not b.rejected])
    ]
    if len(rows) < 3:
        return
    usual_mps, usual_mps2, usual_hz, _ = np.median(np.array(rows), axis=0).tolist()
    for speed_mps, shakes_mps2, rate_hz, number in rows:
        if is_other_rate(rate_hz, usual_hz, usual_hz):
            text = f"the sensors send {rate_hz:.3g} times a second, those of the median run {usual_hz:.3g} times"
            yield number, Finding.of(Kind.RATE_DIFFERS, text)
        if abs(speed_mps / usual_mps - 1.0) > SPEED_DIFFERS_BY:
            text = f"mean of {speed_mps:.1f} m/s, the median run {usual_mps:.1f} m/s"
            yield number, Finding.of(Kind.SPEED_DIFFERS, text)
        if shakes_mps2 * SMOOTHER_BY < usual_mps2:
            text = f"vertical acceleration scatters by {shakes_mps2:.2g} m/s2, in the median run by {usual_mps2:.2g}"
            yield number, Finding.of(Kind.SMOOTH_ROAD, text)


def load_findings(runs: Sequence[StatedDrive], vehicle: Vehicle) -> Iterator[Finding]:
    """Whether these loads and positions separate payload from front share, and both from chance."""
    known = [run for run in runs if run.is_known]
    if not known:
        return
    loads = sorted({(run.payload_kg, round(run.front_share_pct, 2)) for run in known})
    payload_kg, share_pct = (np.array(column) for column in zip(*loads, strict=True))
    if np.ptp(payload_kg) == 0.0:
        if len(known) == len(runs):
            yield Finding.of(Kind.ONE_LOAD_ONLY, f"{payload_kg[0]:g} kg in every run that can be used")
        return
    if np.ptp(payload_kg) < ALIKE_SHARE * vehicle.empty_mass_kg:
        text = f"{payload_kg.min():g} to {payload_kg.max():g} kg on a vehicle of {vehicle.empty_mass_kg:g} kg"
        yield Finding.of(Kind.LOADS_ALIKE, text)
    if np.ptp(share_pct) < SHARES_ALIKE_PCT:
        yield Finding.of(Kind.SHARES_ALIKE, f"{share_pct.min():.1f} to {share_pct.max():.1f} %")
    elif len(loads) >= 3 and abs(correlation := float(np.corrcoef(payload_kg, share_pct)[0, 1])) > TOGETHER:
        yield Finding.of(Kind.LOAD_AND_SHARE_TOGETHER, f"their correlation is {correlation:.2f}")
