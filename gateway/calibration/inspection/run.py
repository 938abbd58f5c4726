"""Inspection of one drive: a table of checks of its log, rows, batches and cross-spectra, and their verdict."""

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from math import isfinite, pi, sqrt
from typing import Final

import numpy as np

from gateway.calibration.as_stated import stated_load, stated_run
from gateway.calibration.inspection.axes import Phases, fitted_position_m, mean_coherence, phases, reading_of
from gateway.calibration.inspection.finding import Finding, Kind, RunVerdict, Severity
from gateway.calibration.inspection.log import SplitRun
from gateway.calibration.inspection.roll import exchanged, over_pitch, pitch_coherence
from gateway.calibration.inspection.rows import Gravity, Stream, gravity_in
from gateway.core.batch import RATE_MIN_SHARE, REASON_SHARE_MIN
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Vehicle
from gateway.model.spectra import LEAST_SEGMENTS, CrossSpectra, cross_spectra_of
from gateway.quantity import Z95
from gateway.records import Batch, Signal, Why

INERTIAL: Final = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE)
JITTER_SHARE_MAX: Final = 0.25  # chosen: of a sample's interval; half the width of the central 80 %
BIAS_MAX_RADPS: Final = 3.0 * pi / 180.0  # chosen: largest bias of an uncalibrated automotive gyroscope
SHAKING_MPS2: Final = 0.2  # chosen: a vehicle at rest with its engine running stays below
MASKED_SHARE_NOTED: Final = 0.02  # chosen: of the time
SMOOTH_MPS2: Final = 0.08  # chosen: the quietest ordinary road shakes a vehicle more, in the estimators' band
STEPS_SHARE_MAX: Final = 0.1  # chosen: of a signal's power in that band
LEAST_COHERENCE: Final = 0.4  # chosen: behind the axles right axes have 0.45 and more, roll or yaw for pitch below 0.35
LEAST_AGREEMENT: Final = 0.62  # chosen: right axes amidships have 0.65 and more at any speed variation
USUAL_SCALE: Final = (0.5, 1.6)  # chosen: right axes are within 0.6 to 1.15, roll above 2.3
SCALE_RANGE: Final = (0.4, 2.5)  # chosen: no road vehicle's pitch rate is further from the usual vehicle's
UNIT_RANGE: Final = (0.5, 2.0)  # chosen: of a ratio that a wrong unit explains
ROLL_RANGE: Final = (0.9, 8.0)
"""Of roll over pitch rate above the body's resonances: measured 1.2 to 3.6 where the axes are right, 0.11 to 0.67 with
yaw in place of roll.
"""
ROLL_UNIT_RANGE: Final = (0.9, 5.0)  # chosen: of that ratio after degrees and radians are corrected
ALIKE: Final = 0.7  # coherence of roll and pitch rate: measured at most 0.13 with right axes; 1 for one signal twice
POSITION_OFF_M: Final = 0.3  # chosen: deviation that is reported
POSITION_WRONG_M: Final = 1.0  # chosen: deviation that excludes the run
PLACING_SEGMENTS: Final = 20  # chosen: for a place; a sign needs fewer
BELIEVED_AGREEMENT: Final = 0.92  # chosen: with this agreement the speed's unit is not tested
UNIT_GAIN: Final = 0.04  # chosen: gain of agreement that proves a wrong unit of speed
SPEED_MISREAD: Final = {  # how many times too high the speed then reads; a mile has 1.609344 km
    "its numbers are km/h, but the signal map says m/s": 3.6,
    "its numbers are m/s, but the signal map says km/h": 1.0 / 3.6,
    "its numbers are km/h, but the signal map says mph": 1.609344,
    "its numbers are mph, but the signal map says km/h": 1.0 / 1.609344,
}
_DEGREES: Final = 180.0 / pi  # per radian
_WARNING: Final = Severity.WARNING


class Seen:
    """A drive as its checks see it; what several of them need is computed once."""

    def __init__(self, drive: SplitRun, vehicle: Vehicle, settings: BatchSettings) -> None:
        self.drive, self.vehicle, self.settings = drive, vehicle, settings
        self.facts, self.streams, self.batches = drive.facts, drive.facts.streams, drive.batches
        self.found: list[Finding] = []

    @cached_property
    def gravity(self) -> Gravity:
        """What the vertical acceleration's mean shows."""
        return gravity_in(self.facts)

    @cached_property
    def measured(self) -> CrossSpectra | None:
        """The cross-spectra as read, with the roll rate if there is one; None without enough steady driving."""
        return cross_spectra_of(self.batches, reading_of(self.vehicle))

    def has(self, part: "Part") -> bool:
        """Whether there is such a part to look at."""
        if part in (Part.LOG, Part.ROWS):
            return True
        is_seen = self.measured is not None and self.gravity.factor != 0.0
        return is_seen and (part is Part.SPECTRA or self.spectra.has_roll)

    @cached_property
    def spectra(self) -> CrossSpectra:
        """The same with the vertical acceleration mended. Raises ValueError without any."""
        if self.measured is None:
            raise ValueError("this drive has no cross-spectra")
        return self.measured.with_acceleration_times(self.gravity.factor)

    def phases(self, spectra: CrossSpectra) -> Phases:
        """How well these agree with a vehicle's, with the stated load or none."""
        return phases(spectra, stated_load(self.drive.run, self.vehicle), self.vehicle)

    @cached_property
    def as_read(self) -> Phases:
        """Of the spectra, with the speed as it reads."""
        return self.phases(self.spectra)

    @cached_property
    def misread(self) -> tuple[str, Phases] | None:
        """The mistake of the speed's unit that explains the phases far better than none, and its phases."""
        tried = {}
        for what, factor in SPEED_MISREAD.items() if self.as_read.best < BELIEVED_AGREEMENT else ():
            spectra = cross_spectra_of(self.batches, reading_of(self.vehicle, factor))
            if spectra is not None:
                tried[what] = self.phases(spectra.with_acceleration_times(self.gravity.factor))
        best = max(tried.items(), key=lambda one: one[1].best, default=None)
        return best if best is not None and best[1].best > self.as_read.best + UNIT_GAIN else None

    @property
    def corrected(self) -> Phases:
        """Of the spectra, with the likeliest speed."""
        return self.misread[1] if self.misread else self.as_read

    def share(self, *whys: Why) -> float:
        """Which part of the drive's time these causes masked."""
        total_s = sum(batch.duration_s for batch in self.batches)
        masked_s = sum(batch.shares.get(why, 0.0) * batch.duration_s for batch in self.batches for why in whys)
        return masked_s / total_s if total_s else 0.0

    @property
    def needed_s(self) -> float:
        """The shortest batch."""
        return self.settings.last_batch_share_min * self.settings.window_s

    @property
    def is_too_short(self) -> bool:
        """True if not even the longest stretch of the drive, or of its identification part, makes one batch."""
        return all(batch.duration_s < self.needed_s for batch in self.batches)

    @property
    def is_standing(self) -> bool:
        """True if a whole batch could have been driven, and apparently was, but the speed stays at 0."""
        speed, acceleration = self.streams.get(Signal.SPEED), self.streams.get(Signal.VERTICAL_ACCELERATION)
        if speed is None or acceleration is None or speed.n < 2 or self.facts.duration_s < self.needed_s:
            return False
        return speed.high < self.settings.standstill_speed_mps and acceleration.std > SHAKING_MPS2

    @property
    def is_lost(self) -> bool:
        """True if every batch was rejected."""
        return all(batch.rejected for batch in self.batches)

    def reasons(self, batches: Iterable[Batch]) -> str:
        """Why these batches were rejected, with numbers."""
        names = [str(why) for batch in batches for why in batch.rejected]
        return ", ".join(f"{name} ({names.count(name)})" for name in dict.fromkeys(names))


Said = Iterator[str | tuple[str, Severity]]
"""The text of each finding; with its severity if that is not the gravest of its kind."""


def _cut_away(seen: Seen) -> Said:
    log = seen.drive.log
    if log.span_ns is None:
        yield f"the log lasts {log.duration_s:.0f} s, and the run begins at {log.start_s:g} s"


def _gravity(kind: Kind) -> Callable[[Seen], Said]:
    return lambda seen: iter([seen.gravity.text] if seen.gravity.kind is kind else [])


def _unmapped(seen: Seen) -> Said:
    """Signals without a place in the map, which no log can therefore contain; every mapped one has a stream."""
    if not seen.streams:
        return
    if Signal.SPEED not in seen.streams and Signal.WHEEL_SPEED not in seen.streams:
        yield "neither speed nor wheel_speed is in the signal map"
    if absent := [signal for signal in INERTIAL if signal not in seen.streams]:
        text = f"{' and '.join(absent)} {'are' if len(absent) > 1 else 'is'} not in the signal map"
        yield f"{text}; axes and loads cannot be checked", Severity.FAULT if len(absent) > 1 else _WARNING


def _sensors(seen: Seen, *, are_heard: bool = True) -> Iterator[tuple[Signal, Stream, Severity]]:
    """Without a roll rate a vehicle is weighed all the same."""
    for signal in (*INERTIAL, Signal.ROLL_RATE):
        stream = seen.streams.get(signal)
        if stream is not None and (stream.n >= 2) is are_heard:
            yield signal, stream, Severity.FAULT if signal in INERTIAL else _WARNING


def _silent(seen: Seen) -> Said:
    for signal, stream, severity in _sensors(seen, are_heard=False):
        why = seen.drive.log.silent.get(signal)
        yield f"{signal} has {stream.n} samples in the whole run" + (f": {why}" if why else ""), severity


def _is_slow(stream: Stream, seen: Seen) -> bool:
    return stream.rate_hz < RATE_MIN_SHARE * seen.settings.rate_hz


def _slow(seen: Seen) -> Said:
    for signal, stream, severity in _sensors(seen):
        if _is_slow(stream, seen):
            least_hz = RATE_MIN_SHARE * seen.settings.rate_hz
            yield f"{signal} comes at {stream.rate_hz:.3g} Hz, at least {least_hz:g} are needed", severity


def _jitter(seen: Seen) -> Said:
    for signal, stream, _ in _sensors(seen):
        share = stream.jitter_share
        if not _is_slow(stream, seen) and not share <= JITTER_SHARE_MAX:
            much = f"{100.0 * share:.0f} %" if isfinite(share) else "more than a whole one"
            yield f"intervals of {signal} are off by {much} of their length"


def _standing(seen: Seen) -> Said:
    if seen.is_standing:
        yield "the speed is always 0, but the vehicle shakes as it does when driven"


def _speed_lost(why: Why) -> Callable[[Seen], Said]:
    """A fault if that alone leaves no batch, else a warning."""

    def look(seen: Seen) -> Said:
        share, is_mapped = seen.share(why), not seen.streams or {Signal.SPEED, Signal.WHEEL_SPEED} & set(seen.streams)
        if share >= REASON_SHARE_MIN and is_mapped and not seen.is_too_short:
            is_ruinous = seen.is_lost and share > 1.0 - seen.settings.usable_share_min
            yield f"{share:.0%} of the drive", Severity.FAULT if is_ruinous else _WARNING

    return look


def _outside_gate(seen: Seen) -> Said:
    """Towns and stops cost time, no more. The text says whether another unit would bring the speeds inside."""
    outside = seen.share(Why.TOO_SLOW, Why.TOO_FAST)
    if seen.is_too_short or not seen.is_lost or outside <= 1.0 - seen.settings.usable_share_min:
        return
    text, speed = f"{outside:.0%} of the drive", seen.streams.get(Signal.SPEED)
    if speed is not None:
        least, most = seen.settings.speed_min_mps, seen.settings.speed_max_mps
        text += f": {speed.low:.3g} to {speed.high:.3g} m/s, permitted are {least:g} to {most:g}"
        for factor, mistake in ((3.6, "m/s read as km/h"), (1.0 / 3.6, "km/h read as m/s")):
            if least <= factor * speed.low and factor * speed.high <= most:
                text += f" ({factor * speed.low:.3g} to {factor * speed.high:.3g} if it is {mistake})"
    yield text


def _masked(*whys: Why) -> Callable[[Seen], Said]:
    """Time lost to gaps, or to sensors that stuck or sat at the end of their range."""

    def look(seen: Seen) -> Said:
        shares = {why: seen.share(why) for why in whys}
        if sum(shares.values()) > MASKED_SHARE_NOTED and all(stream.n >= 2 for stream in seen.streams.values()):
            yield ", ".join(f"{why} {share:.1%} of the drive" for why, share in shares.items() if share > 0.0)

    return look


def _roll_lost(seen: Seen) -> Said:
    """A roll rate that is mapped, and unknown for a good part of the time that can be used."""
    weights = [(batch.roll_usable_share, np.count_nonzero(batch.usable)) for batch in seen.batches]
    known = [(share, n) for share, n in weights if share is not None and n > 0]
    lost = sum((1.0 - share) * n for share, n in known) / max(sum(n for _, n in known), 1)
    if lost > MASKED_SHARE_NOTED:
        yield f"{lost:.1%} of the time that can be used"


def _unsteady(seen: Seen) -> Said:
    if seen.measured is None and not seen.is_lost and all(signal in seen.streams for signal in INERTIAL):
        yield f"fewer than {LEAST_SEGMENTS} unbroken stretches of 5 s at even speed"


def _apart(spectra: CrossSpectra, read: Phases) -> Said:
    """Do the two sensors move together as one body does?

    Amidships heave and pitch are nearly independent if the speed varies, so a low coherence alone proves nothing: there
    the phases and the size must at least match a vehicle's.
    """
    coherence, likely = mean_coherence(spectra), read.likely
    is_vehicle = likely.best >= LEAST_AGREEMENT and USUAL_SCALE[0] <= likely.scale <= USUAL_SCALE[1]
    if coherence < LEAST_COHERENCE and not is_vehicle:
        text = f"coherence of pitch_rate and vertical_acceleration is {coherence:.2f}, and their phases agree with a "
        yield f"{text}vehicle's by {likely.best:.2f}"


def _wrong_size(read: Phases) -> Said:
    scale = read.likely.scale
    if not SCALE_RANGE[0] <= scale <= SCALE_RANGE[1]:
        text = f"pitch_rate is {scale:.3g} times that of a vehicle with this vertical acceleration"
        yield text + _slip(scale, UNIT_RANGE)


def _is_pitch(spectra: CrossSpectra, read: Phases, corrected: Phases) -> bool:
    return not any((*_apart(spectra, read), *_wrong_size(corrected)))


def _slip(ratio: float, within: tuple[float, float]) -> str:
    """The mistake of a rate's unit that leaves a ratio to the expected ``within`` this range; empty if none does."""
    if within[0] <= ratio / _DEGREES <= within[1]:
        return ": deg/s read as rad/s"
    return ": rad/s read as deg/s" if within[0] <= ratio * _DEGREES <= within[1] else ""


def _is_roll(spectra: CrossSpectra) -> bool:
    return pitch_coherence(spectra) <= ALIKE and ROLL_RANGE[0] <= over_pitch(spectra) <= ROLL_RANGE[1]


def _rates_swapped(seen: Seen) -> Said:
    """Pitch rate is none, but the roll rate is a sound pitch rate, and the pitch rate then a sound roll rate."""
    if _is_pitch(seen.spectra, seen.as_read, seen.corrected):
        return
    other = exchanged(seen.spectra)
    read = seen.phases(other)
    if _is_roll(other) and _is_pitch(other, read, read):
        text = f"the phases agree with the vehicle's by {read.best:.2f} when exchanged, "
        yield f"{text}else by {seen.corrected.best:.2f}"


def _speed_unit(seen: Seen) -> Said:
    if seen.misread is not None:
        what, read = seen.misread
        yield f"the phases agree with the vehicle's by {read.best:.2f} if {what}, and by far less otherwise"


def _pitch_sign(seen: Seen) -> Said:
    read = seen.corrected
    if read.is_turned:
        text = f"the phases agree with the vehicle's by {read.turned.best:.2f} with the opposite sign, "
        yield f"{text}by {read.upright.best:.2f} with this one"


def _roll_axis(seen: Seen) -> Said:
    if (coherence := pitch_coherence(seen.spectra)) > ALIKE:
        yield f"its coherence with pitch_rate is {coherence:.2f}"
    elif (ratio := over_pitch(seen.spectra)) < ROLL_RANGE[0] and not _slip(ratio, ROLL_UNIT_RANGE):
        yield f"roll_rate moves {ratio:.3g} times as much as pitch_rate: a body that rolls moves more"


def _roll_unit(seen: Seen) -> Said:
    ratio = over_pitch(seen.spectra)
    if not ROLL_RANGE[0] <= ratio <= ROLL_RANGE[1]:
        yield f"roll_rate moves {ratio:.3g} times as much as pitch_rate" + _slip(ratio, ROLL_UNIT_RANGE)


def _position(seen: Seen) -> Said:
    """The sensor's position by this run alone, compared with the campaign's; signs and units being right."""
    vehicle = seen.vehicle
    if seen.spectra.n_total < PLACING_SEGMENTS:
        return
    position_m, std_m = fitted_position_m(stated_run(seen.drive.run, seen.spectra, vehicle), vehicle)
    off_m = abs(position_m - vehicle.sensor_position_m)
    doubt_m = 3.0 * float(np.hypot(std_m, vehicle.sensor_position_std_m))
    if off_m > max(POSITION_OFF_M, doubt_m):
        by_spectra = f"{position_m:.2f} ± {Z95 * std_m:.2f} m (95 %)"
        text = f"sensor_position_m is {vehicle.sensor_position_m:g}, the spectra say {by_spectra}"
        yield text, Severity.FAULT if off_m > max(POSITION_WRONG_M, doubt_m) else _WARNING


def _smooth(seen: Seen) -> Said:
    if (rms_mps2 := seen.spectra.acceleration_rms_mps2 * abs(seen.gravity.factor)) < SMOOTH_MPS2:
        yield f"vertical acceleration is {rms_mps2:.2g} m/s2 (root mean square)"


def _coarse(seen: Seen) -> Said:
    spectra = seen.spectra
    low_hz, high_hz = spectra.freq_hz[1], spectra.freq_hz[-2]
    pitch_rms = spectra.pitch_rate_rms_radps
    rms = {Signal.VERTICAL_ACCELERATION: spectra.acceleration_rms_mps2, Signal.PITCH_RATE: pitch_rms}
    if spectra.has_roll:
        rms[Signal.ROLL_RATE] = pitch_rms * over_pitch(spectra, (low_hz, high_hz))
    for signal, moved in rms.items():
        stream = seen.streams.get(signal)
        if stream is not None and isfinite(stream.resolution) and stream.rate_hz > 0.0:
            steps = stream.resolution * sqrt((high_hz - low_hz) / (6.0 * stream.rate_hz))  # q^2 / 12 over half the rate
            if (share := (steps / max(moved, np.finfo(float).tiny)) ** 2) > STEPS_SHARE_MAX:
                yield f"{min(share, 1.0):.0%} of the power of {signal} comes from its steps of {stream.resolution:.3g}"


def _biased(seen: Seen) -> Said:
    if abs(bias := seen.facts.mean(Signal.PITCH_RATE)) > BIAS_MAX_RADPS:
        yield f"pitch_rate has mean {np.degrees(bias):.3g} deg/s"


def _too_short(seen: Seen) -> Said:
    if seen.drive.has_identification and seen.is_too_short and not seen.is_standing:
        longest_s = max((batch.duration_s for batch in seen.batches), default=0.0)
        text = f"the longest unbroken identification stretch lasts {longest_s:.0f} of {seen.facts.duration_s:.0f} s"
        yield f"{text}; a batch needs {seen.needed_s:.0f} s"


def _none_left(seen: Seen) -> Said:
    """Reported only if nothing else says why."""
    has_fault = any(finding.severity is Severity.FAULT for finding in seen.found)
    if seen.drive.has_identification and seen.is_lost and not (seen.is_too_short or has_fault):
        yield f"{len(seen.batches)} batches: {seen.reasons(seen.batches)}"


def _some_lost(seen: Seen) -> Said:
    lost = [one for one in seen.batches if one.rejected and Why.TOO_SHORT not in one.rejected]  # ends are no loss
    if seen.drive.has_identification and lost and not seen.is_lost:
        yield f"{len(lost)} of {len(seen.batches)} batches: {seen.reasons(lost)}"


class Part(StrEnum):
    """What a check looks at."""

    LOG = "the log"
    ROWS = "the rows, or the batches cut of them"
    SPECTRA = "the cross-spectra, if there are any and the vertical acceleration shows gravity"
    ROLL = "the cross-spectra with the roll rate"


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
    Check(Part.LOG, Kind.LOG_UNREADABLE, lambda seen: (one for one in (seen.drive.log.unreadable,) if one)),
    Check(Part.LOG, Kind.CUT_AWAY, _cut_away, _ENDS),
    Check(Part.ROWS, Kind.CHANNELS_SWAPPED, _gravity(Kind.CHANNELS_SWAPPED)),
    Check(Part.ROWS, Kind.ACCELERATION_SIGN, _gravity(Kind.ACCELERATION_SIGN)),
    Check(Part.ROWS, Kind.ACCELERATION_UNIT, _gravity(Kind.ACCELERATION_UNIT)),
    Check(Part.ROWS, Kind.ACCELERATION_AXIS, _gravity(Kind.ACCELERATION_AXIS)),
    Check(Part.LOG, Kind.LOG_DAMAGED, lambda seen: (one for one in (seen.drive.log.damage,) if one), _ENDS),
    Check(Part.ROWS, Kind.SIGNAL_UNMAPPED, _unmapped),
    Check(Part.ROWS, Kind.SENSOR_SILENT, _silent),
    Check(Part.ROWS, Kind.RATE_LOW, _slow),
    Check(Part.ROWS, Kind.JITTER, _jitter),
    Check(Part.ROWS, Kind.SPEED_FROZEN, _standing),
    Check(Part.ROWS, Kind.SPEED_MISSING, _speed_lost(Why.SPEED_MISSING)),
    Check(Part.ROWS, Kind.SPEED_FROZEN, _speed_lost(Why.SPEED_FROZEN)),
    Check(Part.ROWS, Kind.SPEED_OUTSIDE_GATE, _outside_gate),
    Check(Part.ROWS, Kind.GAPS, _masked(Why.GAP, Why.ACCELERATION_MISSING, Why.PITCH_RATE_MISSING)),
    Check(Part.ROWS, Kind.SENSOR_STUCK, _masked(Why.ACCELERATION_STUCK, Why.PITCH_RATE_STUCK)),
    Check(Part.ROWS, Kind.SENSOR_SATURATED, _masked(Why.ACCELERATION_SATURATED, Why.PITCH_RATE_SATURATED)),
    Check(Part.ROWS, Kind.ROLL_RATE_LOST, _roll_lost, (Kind.SENSOR_SILENT, Kind.RATE_LOW)),
    Check(Part.ROWS, Kind.UNSTEADY, _unsteady),
    Check(Part.ROLL, Kind.RATES_SWAPPED, _rates_swapped),
    Check(Part.SPECTRA, Kind.PITCH_RATE_AXIS, lambda seen: _apart(seen.spectra, seen.as_read), _NO_PITCH),
    Check(Part.SPECTRA, Kind.SPEED_UNIT, _speed_unit, _NO_PITCH),
    Check(Part.SPECTRA, Kind.PITCH_RATE_UNIT, lambda seen: _wrong_size(seen.corrected), _NO_PITCH),
    Check(Part.SPECTRA, Kind.PITCH_RATE_SIGN, _pitch_sign, _NO_PITCH),
    Check(Part.ROLL, Kind.ROLL_RATE_AXIS, _roll_axis, _NO_SIZE),
    Check(Part.ROLL, Kind.ROLL_RATE_UNIT, _roll_unit, _NO_SIZE | {Kind.ROLL_RATE_AXIS}),
    Check(Part.SPECTRA, Kind.SENSOR_POSITION, _position, _UNSOUND),
    Check(Part.SPECTRA, Kind.SMOOTH_ROAD, _smooth),
    Check(Part.SPECTRA, Kind.COARSE_RESOLUTION, _coarse),
    Check(Part.ROWS, Kind.PITCH_RATE_BIAS, _biased, (Kind.CHANNELS_SWAPPED, Kind.PITCH_RATE_UNIT)),
    Check(Part.ROWS, Kind.TOO_SHORT, _too_short),
    Check(Part.ROWS, Kind.NO_USABLE_BATCH, _none_left),
    Check(Part.ROWS, Kind.BATCHES_LOST, _some_lost),
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
