"""Inspection of one known-load drive: its rows, its batches and its cross-spectra, as a verdict."""

from collections.abc import Iterable, Iterator, Sequence
from enum import StrEnum
from math import nan, sqrt
from typing import Final

import numpy as np

from gateway.calibration.inspection.axes import (
    BELIEVED_AGREEMENT,
    SPEED_MISREAD,
    Phases,
    apart_findings,
    likeliest_speed,
    mended,
    phase_findings,
    phases,
    position_findings,
    reading_of,
)
from gateway.calibration.inspection.finding import Finding, Kind, RunVerdict, Severity
from gateway.calibration.inspection.log import SplitRun, log_findings
from gateway.calibration.inspection.roll import (
    ROLL,
    RollMatrix,
    exchanged,
    lost_findings,
    roll_findings,
    roll_spectra_of,
)
from gateway.calibration.inspection.rows import (
    INERTIAL,
    Mended,
    RowFacts,
    bias_findings,
    gravity_findings,
    rate_findings,
    stands_still_but_shakes,
    unmapped_findings,
)
from gateway.core.batch import REASON_SHARE_MIN
from gateway.core.cross_spectrum.measured import LEAST_SEGMENTS, CrossSpectra, cross_spectra_of
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Vehicle
from gateway.records import Batch, Signal, Why

MASKED_SHARE_NOTED: Final = 0.02  # chosen: of the time
SMOOTH_MPS2: Final = 0.08  # chosen: the quietest ordinary road shakes a vehicle more, in the estimators' band
STEPS_SHARE_MAX: Final = 0.1  # chosen: of a signal's power in that band


def inspect_run(drive: SplitRun, vehicle: Vehicle, settings: BatchSettings) -> RunVerdict:
    """Every finding of one run, faults first."""
    one, facts = drive.identification, drive.facts
    of_log = tuple(log_findings(drive.log))
    if _has_fault(of_log):
        return RunVerdict(one.number, one.name, of_log)
    acceleration, findings = gravity_findings(facts)
    findings.extend((*of_log, *unmapped_findings(facts), *rate_findings(facts, settings, drive.log.silent)))
    findings.extend(_speed_findings(drive, settings))
    findings.extend(_masked_findings(drive))
    if not _kinds(findings) & {Kind.SENSOR_SILENT, Kind.RATE_LOW}:
        findings.extend(lost_findings(drive.batches))
    spectra = cross_spectra_of(drive.batches, reading_of(vehicle))
    if spectra is None and all(signal in facts.streams for signal in INERTIAL):
        findings.extend(_unsteady_findings(drive))
    elif spectra is not None and acceleration.is_axis_sound:
        roll = roll_spectra_of(drive.batches)
        findings.extend(_motion_findings(spectra, roll, drive, vehicle, acceleration))
        findings.extend(_excitation_findings(spectra, roll, facts, acceleration))
    if not {Kind.CHANNELS_SWAPPED, Kind.PITCH_RATE_UNIT} & _kinds(findings):
        findings.extend(bias_findings(facts))
    findings.extend(_batch_findings(drive, settings, has_fault=_has_fault(findings)))
    order = list(Severity)
    return RunVerdict(one.number, one.name, tuple(sorted(findings, key=lambda f: order.index(f.severity))))


def _has_fault(findings: Sequence[Finding]) -> bool:
    return any(finding.severity is Severity.FAULT for finding in findings)


def _kinds(findings: Iterable[Finding]) -> set[StrEnum]:
    return {finding.kind for finding in findings}


def _motion_findings(
    spectra: CrossSpectra, roll: RollMatrix | None, drive: SplitRun, vehicle: Vehicle, acceleration: Mended
) -> Iterator[Finding]:
    """Axes, signs and units by the cross-spectra; then, if these are right, the roll rate and the sensor's place."""
    spectra = mended(spectra, 1.0 / acceleration.factor)
    axes, agreement = _axes_findings(drive.batches, spectra, drive, vehicle, acceleration)
    kinds = _kinds(axes)
    if kinds & _PITCH_IS_NONE and (swapped := _swapped_finding(drive, vehicle, acceleration, agreement)):
        yield swapped
        return
    yield from axes
    if roll is not None and not kinds & _PITCH_IS_NONE:
        yield from roll_findings(roll)
    if not axes:
        yield from position_findings(spectra, drive.run, vehicle)


_PITCH_IS_NONE: Final = frozenset({Kind.PITCH_RATE_AXIS, Kind.PITCH_RATE_UNIT})


def _axes_findings(
    batches: Sequence[Batch], spectra: CrossSpectra, drive: SplitRun, vehicle: Vehicle, acceleration: Mended
) -> tuple[list[Finding], float]:
    """Findings about the pitch rate and the speed's unit, and the agreement of the phases with a vehicle's."""
    as_read = phases(spectra, drive.run, vehicle)
    if apart := list(apart_findings(spectra, as_read)):
        return apart, as_read.best
    misread = {}
    if as_read.best < BELIEVED_AGREEMENT:
        misread = _if_speed_misread(batches, drive, vehicle, acceleration)
    speed_misread, seen = likeliest_speed(as_read, misread)
    return list(phase_findings(seen, speed_misread)), seen.best


def _swapped_finding(drive: SplitRun, vehicle: Vehicle, acceleration: Mended, agreement: float) -> Finding | None:
    """Reported if the roll rate is a sound pitch rate, and the pitch rate then a sound roll rate."""
    batches = exchanged(drive.batches)
    spectra, roll = cross_spectra_of(batches, reading_of(vehicle)), roll_spectra_of(batches)
    if spectra is None or roll is None or any(roll_findings(roll)):
        return None
    seen = mended(spectra, 1.0 / acceleration.factor)
    axes, exchanged_agreement = _axes_findings(batches, seen, drive, vehicle, acceleration)
    if _PITCH_IS_NONE & _kinds(axes):
        return None
    text = f"the phases agree with the vehicle's by {exchanged_agreement:.2f} when exchanged, else by {agreement:.2f}"
    return Finding.of(Kind.RATES_SWAPPED, text)


def _if_speed_misread(
    batches: Sequence[Batch], drive: SplitRun, vehicle: Vehicle, acceleration: Mended
) -> dict[str, Phases]:
    """The phases for each mistake of the speed's unit."""
    found_for = {}
    for what, factor in SPEED_MISREAD.items():
        spectra = cross_spectra_of(batches, reading_of(vehicle, factor))
        if spectra is not None:
            found_for[what] = phases(mended(spectra, 1.0 / acceleration.factor), drive.run, vehicle)
    return found_for


def _excitation_findings(
    spectra: CrossSpectra, roll: RollMatrix | None, facts: RowFacts, acceleration: Mended
) -> Iterator[Finding]:
    rms_mps2 = spectra.acceleration_rms_mps2 * abs(acceleration.factor)
    if rms_mps2 < SMOOTH_MPS2:
        yield Finding.of(Kind.SMOOTH_ROAD, f"vertical acceleration is {rms_mps2:.2g} m/s2 (root mean square)")
    low_hz, high_hz = spectra.freq_hz[1], spectra.freq_hz[-2]
    for signal, rms in (
        (Signal.VERTICAL_ACCELERATION, spectra.acceleration_rms_mps2),
        (Signal.PITCH_RATE, spectra.pitch_rate_rms_radps),
        (Signal.ROLL_RATE, nan if roll is None else roll.rms(ROLL)),
    ):
        stream = facts.streams.get(signal)
        if stream is None or not np.isfinite(stream.resolution) or not stream.rate_hz > 0.0:
            continue
        steps_rms = stream.resolution * sqrt((high_hz - low_hz) / (6.0 * stream.rate_hz))  # q^2 / 12 over half the rate
        share = (steps_rms / max(rms, np.finfo(float).tiny)) ** 2
        if share > STEPS_SHARE_MAX:
            text = f"{min(share, 1.0):.0%} of the power of {signal} comes from its steps of {stream.resolution:.3g}"
            yield Finding.of(Kind.COARSE_RESOLUTION, text)


def _speed_findings(drive: SplitRun, settings: BatchSettings) -> Iterator[Finding]:
    """Speed missing, frozen or outside the gate: a fault if that alone leaves no batch, else a warning."""
    if _is_standing(drive, settings):
        yield Finding.of(Kind.SPEED_FROZEN, "the speed is always 0, but the vehicle shakes as it does when driven")
    if _is_too_short(drive, settings):
        return
    is_lost = all(batch.rejected for batch in drive.identification.batches)
    ruinous = 1.0 - settings.usable_share_min
    for kind, why in ((Kind.SPEED_MISSING, Why.SPEED_MISSING), (Kind.SPEED_FROZEN, Why.SPEED_FROZEN)):
        share = _share(drive.batches, why)
        if share >= REASON_SHARE_MIN and _is_mapped(drive.facts):
            severity = Severity.FAULT if is_lost and share > ruinous else Severity.WARNING
            yield Finding.of(kind, f"{share:.0%} of the drive", severity)
    outside = _share(drive.batches, Why.TOO_SLOW) + _share(drive.batches, Why.TOO_FAST)
    if is_lost and outside > ruinous:  # towns and stops cost time, no more
        yield Finding.of(Kind.SPEED_OUTSIDE_GATE, f"{outside:.0%} of the drive{_speeds(drive, settings)}")


def _is_mapped(facts: RowFacts) -> bool:
    return not facts.streams or Signal.SPEED in facts.streams or Signal.WHEEL_SPEED in facts.streams


def _needed_s(settings: BatchSettings) -> float:
    return settings.last_batch_share_min * settings.window_s


def _is_standing(drive: SplitRun, settings: BatchSettings) -> bool:
    """True if a whole batch could have been driven, and apparently was, but the speed stays at 0."""
    return drive.facts.duration_s >= _needed_s(settings) and stands_still_but_shakes(drive.facts)


def _is_too_short(drive: SplitRun, settings: BatchSettings) -> bool:
    """True if not even the longest stretch of the drive, or of its identification part, makes one batch."""
    return all(batch.duration_s < _needed_s(settings) for batch in drive.batches)


def _speeds(drive: SplitRun, settings: BatchSettings) -> str:
    """The speeds that occurred, and whether another unit would bring them inside the gate."""
    speed = drive.facts.streams.get(Signal.SPEED)
    if speed is None:
        return ""
    text = f": {speed.low:.3g} to {speed.high:.3g} m/s, permitted are {settings.speed_min_mps:g} to "
    text += f"{settings.speed_max_mps:g}"
    for factor, mistake in ((3.6, "m/s read as km/h"), (1.0 / 3.6, "km/h read as m/s")):
        if settings.speed_min_mps <= factor * speed.low and factor * speed.high <= settings.speed_max_mps:
            text += f" ({factor * speed.low:.3g} to {factor * speed.high:.3g} if it is {mistake})"
    return text


def _masked_findings(drive: SplitRun) -> Iterator[Finding]:
    """Time lost to gaps, and to sensors that stuck or sat at the end of their range."""
    if any(stream.n < 2 for stream in drive.facts.streams.values()):
        return
    for kind, whys in (
        (Kind.GAPS, (Why.GAP, Why.ACCELERATION_MISSING, Why.PITCH_RATE_MISSING)),
        (Kind.SENSOR_STUCK, (Why.ACCELERATION_STUCK, Why.PITCH_RATE_STUCK)),
        (Kind.SENSOR_SATURATED, (Why.ACCELERATION_SATURATED, Why.PITCH_RATE_SATURATED)),
    ):
        shares = {why: _share(drive.batches, why) for why in whys}
        if sum(shares.values()) > MASKED_SHARE_NOTED:
            text = ", ".join(f"{why} {share:.1%} of the drive" for why, share in shares.items() if share > 0.0)
            yield Finding.of(kind, text)


def _unsteady_findings(drive: SplitRun) -> Iterator[Finding]:
    if any(not batch.rejected for batch in drive.identification.batches):
        yield Finding.of(Kind.UNSTEADY, f"fewer than {LEAST_SEGMENTS} unbroken stretches of 5 s at even speed")


def _batch_findings(drive: SplitRun, settings: BatchSettings, *, has_fault: bool) -> Iterator[Finding]:
    """Whether anything is left for identification; reported in general only if nothing else says why not."""
    batches = drive.identification.batches
    if not drive.has_identification:
        return
    if _is_too_short(drive, settings):
        if _is_standing(drive, settings):
            return
        longest_s = max((batch.duration_s for batch in batches), default=0.0)
        longest = f"{longest_s:.0f} of {drive.facts.duration_s:.0f} s"
        text = f"the longest unbroken identification stretch lasts {longest}; a batch needs {_needed_s(settings):.0f} s"
        yield Finding.of(Kind.TOO_SHORT, text)
    elif all(batch.rejected for batch in batches):
        if not has_fault:
            yield Finding.of(Kind.NO_USABLE_BATCH, f"{len(batches)} batches: {_reasons(batches)}")
    elif lost := [one for one in batches if one.rejected and Why.TOO_SHORT not in one.rejected]:  # ends are no loss
        yield Finding.of(Kind.BATCHES_LOST, f"{len(lost)} of {len(batches)} batches: {_reasons(lost)}")


def _reasons(batches: Sequence[Batch]) -> str:
    names = [str(why) for batch in batches for why in batch.rejected]
    return ", ".join(f"{name} ({names.count(name)})" for name in dict.fromkeys(names))


def _share(batches: Sequence[Batch], why: Why) -> float:
    """Which part of the drive's time a cause masked."""
    total_s = sum(batch.duration_s for batch in batches)
    return sum(batch.shares.get(why, 0.0) * batch.duration_s for batch in batches) / total_s if total_s else 0.0
