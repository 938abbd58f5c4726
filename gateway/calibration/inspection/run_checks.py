"""Inspection of one drive: of its log, its rows, the batches cut of them, and its cross-spectra.

    findings = inspect_run(drive, vehicle, settings)

Axes, units and signs of the sensors, the speed's unit and the sensor's place are compared with a usual vehicle's, which
needs the cross-spectra, and a vertical acceleration that shows gravity.
"""

from collections.abc import Callable, Collection, Iterator
from functools import cached_property
from math import isfinite, pi, sqrt
from typing import Final

import numpy as np

from gateway.calibration.as_stated import stated_load, stated_run
from gateway.calibration.inspection.axes import Phases, fitted_position_m, phases, reading_of
from gateway.calibration.inspection.facts import InspectedRun, Stream
from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.calibration.inspection.roll import EXCHANGED, over_pitch, pitch_coherence
from gateway.core.batch import GRAVITY_TOLERANCE_MPS2, RATE_MIN_SHARE, REASON_SHARE_MIN
from gateway.core.batch_settings import BatchSettings
from gateway.core.vehicle import Vehicle
from gateway.estimates.quantity import Z95
from gateway.model.checks import COHERENCE_BAND_HZ
from gateway.model.spectra import LEAST_SEGMENTS, CrossSpectra, cross_spectra_of
from gateway.records import Batch, Signal, Why
from gateway.units import STANDARD_GRAVITY_MPS2

INERTIAL: Final = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE)

# Of gravity in the vertical acceleration.
UNIT_TOLERANCE: Final = 0.15  # chosen: relative, of gravity in a wrong unit
STEADY_SHARE: Final = 0.2  # chosen: scatter over mean below which the mean is gravity
MISREAD_AS_MPS2: Final = {  # what gravity then reads, over 9.81
    "its numbers are g, read as m/s2": 1.0 / STANDARD_GRAVITY_MPS2,
    "its numbers are m/s2, read as g": STANDARD_GRAVITY_MPS2,
    "its numbers are mg, read as m/s2": 1000.0 / STANDARD_GRAVITY_MPS2,
    "its numbers are mg, read as g": 1000.0,
    "its numbers are m/s2, read as mg": STANDARD_GRAVITY_MPS2 / 1000.0,
    "its numbers are g, read as mg": 1.0 / 1000.0,
}

# Of the rows and the batches.
SHAKING_MPS2: Final = 0.2  # chosen: a vehicle at rest with its engine running stays below
JITTER_SHARE_MAX: Final = 0.25  # chosen: of a sample's interval; half the width of the central 80 %
BIAS_MAX_RADPS: Final = 3.0 * pi / 180.0  # chosen: largest bias of an uncalibrated automotive gyroscope
MASKED_SHARE_NOTED: Final = 0.02  # chosen: of the time
RUINOUS_SHARE: Final = 0.2  # chosen: of a message's frames; if more do not fit the map, the run teaches nothing true
SUFFERS: Final = {
    Why.SPEED_MISSING: Signal.SPEED,
    Why.ACCELERATION_MISSING: Signal.VERTICAL_ACCELERATION,
    Why.PITCH_RATE_MISSING: Signal.PITCH_RATE,
}
MASKED: Final = (
    (Kind.GAPS, (Why.GAP, Why.ACCELERATION_MISSING, Why.PITCH_RATE_MISSING)),
    (Kind.SENSOR_STUCK, (Why.ACCELERATION_STUCK, Why.PITCH_RATE_STUCK)),
    (Kind.SENSOR_SATURATED, (Why.ACCELERATION_SATURATED, Why.PITCH_RATE_SATURATED)),
)

# Of the cross-spectra.
BELIEVED_AGREEMENT: Final = 0.92  # chosen: with this agreement the speed's unit is not tested
UNIT_GAIN: Final = 0.04  # chosen: gain of agreement that proves a wrong unit of speed
SPEED_MISREAD: Final = {  # how many times too high the speed then reads; a mile has 1.609344 km
    "its numbers are km/h, read as m/s": 3.6,
    "its numbers are m/s, read as km/h": 1.0 / 3.6,
    "its numbers are km/h, read as mph": 1.609344,
    "its numbers are mph, read as km/h": 1.0 / 1.609344,
}
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
_DEGREES: Final = 180.0 / pi  # per radian


def inspect_run(
    drive: InspectedRun, vehicle: Vehicle, settings: BatchSettings, only: Collection[Kind] = frozenset(Kind)
) -> tuple[Finding, ...]:
    """Every finding of one run, of these kinds, faults first. Without rows there are none but why."""
    seen = _Seen(drive, vehicle, settings)
    for check in (_unread,) if drive.log.unreadable or drive.log.span_ns is None else CHECKS:
        seen.found += list(check(seen))
    order = list(Severity)
    found = sorted(seen.found, key=lambda one: order.index(one.severity))
    return tuple(one for one in found if one.kind in only)


class _Seen:
    """A drive as its checks see it: what several of them need, computed once, and what those before have found."""

    def __init__(self, drive: InspectedRun, vehicle: Vehicle, settings: BatchSettings) -> None:
        self.drive, self.vehicle, self.settings = drive, vehicle, settings
        self.facts, self.streams, self.batches = drive.facts, drive.facts.streams, drive.run.batches
        self.needed_s = settings.last_batch_share_min * settings.window_s
        self.is_too_short = all(batch.duration_s < self.needed_s for batch in self.batches)
        self.is_lost = all(batch.rejected for batch in self.batches)
        self.mends_gravity = 1.0  # what the vertical acceleration is to be multiplied by; 0 if no factor mends it
        self.found: list[Finding] = []

    def has(self, *kinds: Kind) -> bool:
        """Whether one of these was found."""
        return any(one.kind in kinds for one in self.found)

    @cached_property
    def measured(self) -> CrossSpectra | None:
        """The cross-spectra as read, with the roll rate if there is one; None without enough steady driving."""
        return cross_spectra_of(self.batches, reading_of(self.vehicle))

    def phases(self, spectra: CrossSpectra) -> Phases:
        """How well these agree with a vehicle's, with the stated load or none."""
        return phases(spectra, stated_load(self.drive.run, self.vehicle), self.vehicle)

    def share(self, why: Why) -> float:
        """Which part of the drive's time this cause masked; 0 if frames that do not fit the signal map explain it."""
        total_s = sum(batch.duration_s for batch in self.batches)
        masked_s = sum(batch.shares.get(why, 0.0) * batch.duration_s for batch in self.batches)
        share = masked_s / total_s if total_s else 0.0
        return 0.0 if why in SUFFERS and self.is_refused(SUFFERS[why], share) else share

    def is_refused(self, signal: Signal, missing_share: float) -> bool:
        """Whether frames that do not fit the signal map explain that so much of the signal is missing."""
        shares = (share for _, share, signals in self.drive.log.mismatches if signal in signals)
        return 2.0 * max(shares, default=0.0) > missing_share

    @property
    def is_standing(self) -> bool:
        """True if a whole batch could have been driven, and apparently was, but the speed stays at 0."""
        speed, acceleration = self.streams.get(Signal.SPEED), self.streams.get(Signal.VERTICAL_ACCELERATION)
        if speed is None or acceleration is None or speed.n < 2 or self.facts.duration_s < self.needed_s:
            return False
        return speed.high < self.settings.standstill_speed_mps and acceleration.std > SHAKING_MPS2

    def reasons(self, batches: Collection[Batch]) -> str:
        """How many batches these are, and why they were rejected."""
        names = [str(why) for batch in batches for why in batch.rejected]
        told = ", ".join(f"{name} ({names.count(name)})" for name in dict.fromkeys(names))
        return f"{len(batches)}{'' if self.is_lost else f' of {len(self.batches)}'} batches: {told}"


# -- the log, the rows and the batches --


def _unread(seen: _Seen) -> Iterator[Finding]:
    """A log that cannot be read, or has nothing of the run."""
    log = seen.drive.log
    text = f"the log lasts {log.duration_s:.0f} s, and the run begins at {log.start_s:g} s"
    yield Finding.of(Kind.LOG_UNREADABLE, log.unreadable) if log.unreadable else Finding.of(Kind.CUT_AWAY, text)


def _of_gravity(seen: _Seen) -> Iterator[Finding]:
    """A vertical acceleration whose mean is not +9.81 m/s2."""
    stream, rate = (seen.streams.get(signal) for signal in INERTIAL)
    if stream is None or stream.n < 2 or _is_gravity(stream.mean):
        return
    reads = f"vertical_acceleration has mean {stream.mean:.3g} m/s2"
    misread = next((one for one, ratio in MISREAD_AS_MPS2.items() if _is_misread(stream, ratio)), None)
    seen.mends_gravity = 0.0
    if rate is not None and any(_is_misread(rate, to_si) for to_si in (1.0, 1.0 / _DEGREES)):  # whatever the map says
        text = f"vertical_acceleration has mean {stream.mean:.3g}, pitch_rate has {rate.mean:.3g}"
        yield Finding.of(Kind.CHANNELS_SWAPPED, text)
    elif _is_gravity(-stream.mean):
        seen.mends_gravity = -1.0
        yield Finding.of(Kind.ACCELERATION_SIGN, reads)
    elif misread:
        seen.mends_gravity = float(np.sign(stream.mean)) / MISREAD_AS_MPS2[misread]
        turned = "" if stream.mean > 0.0 else ", and its axis points down"
        yield Finding.of(Kind.ACCELERATION_UNIT, f"{reads}: {misread}{turned}")
    else:
        along = seen.facts.mean(Signal.LONGITUDINAL_ACCELERATION)
        elsewhere = f", longitudinal_acceleration has {along:.3g}: exchange the two" if _is_gravity(abs(along)) else ""
        yield Finding.of(Kind.ACCELERATION_AXIS, reads + elsewhere)


def _is_gravity(mean_mps2: float) -> bool:
    return abs(mean_mps2 - STANDARD_GRAVITY_MPS2) <= GRAVITY_TOLERANCE_MPS2


def _is_misread(stream: Stream, ratio: float) -> bool:
    """Whether its mean is gravity times ``ratio``, of either sign."""
    of_gravity = abs(stream.mean) / STANDARD_GRAVITY_MPS2 / ratio
    return abs(of_gravity - 1.0) <= UNIT_TOLERANCE and stream.std < STEADY_SHARE * abs(stream.mean)


def _of_map(seen: _Seen) -> Iterator[Finding]:
    """Damage of the log, its clock, signals without a place in the map, and frames that do not fit it."""
    if seen.drive.log.damage:
        yield Finding.of(Kind.LOG_DAMAGED, seen.drive.log.damage)
    yield from (Finding.of(Kind.LOG_CLOCK, text) for text in seen.drive.log.clock)
    if seen.streams and Signal.SPEED not in seen.streams and Signal.WHEEL_SPEED not in seen.streams:
        yield Finding.of(Kind.SIGNAL_UNMAPPED, "neither speed nor wheel_speed is in the signal map")
    absent = [signal for signal in INERTIAL if signal not in seen.streams]
    if seen.streams and absent:
        text = f"{' and '.join(absent)} {'are' if len(absent) > 1 else 'is'} not in the signal map"
        severity = Severity.FAULT if len(absent) > 1 else Severity.WARNING
        yield Finding.of(Kind.SIGNAL_UNMAPPED, f"{text}; axes and loads cannot be checked", severity)
    for text, share, signals in seen.drive.log.mismatches:
        is_ruinous = share > RUINOUS_SHARE and signals & {*INERTIAL, Signal.SPEED}
        yield Finding.of(Kind.MAP_MISMATCH, text, Severity.FAULT if is_ruinous else Severity.WARNING)


def _of_stamps(seen: _Seen) -> Iterator[Finding]:
    """Sensors that are silent, send too rarely, or are stamped unevenly. A vehicle is weighed without a roll rate."""
    least_hz = RATE_MIN_SHARE * seen.settings.rate_hz
    for signal in (one for one in (*INERTIAL, Signal.ROLL_RATE) if one in seen.streams):
        stream, severity = seen.streams[signal], Severity.FAULT if signal in INERTIAL else Severity.WARNING
        if stream.n < 2:
            why = seen.drive.log.silent.get(signal)
            text = f"{signal} has {stream.n} samples in the whole run" + (f": {why}" if why else "")
            if not seen.is_refused(signal, 1.0):
                yield Finding.of(Kind.SENSOR_SILENT, text, severity)
        elif stream.rate_hz < least_hz:
            text = f"{signal} comes at {stream.rate_hz:.3g} Hz, at least {least_hz:g} are needed"
            yield Finding.of(Kind.RATE_LOW, text, severity)
        elif not (share := stream.jitter_share) <= JITTER_SHARE_MAX:
            much = f"{100.0 * share:.0f} %" if isfinite(share) else "more than a whole one"
            yield Finding.of(Kind.JITTER, f"intervals of {signal} are off by {much} of their length")


def _of_speed(seen: _Seen) -> Iterator[Finding]:
    """A speed that stands still though the vehicle shakes, is lost, or lies outside the gate."""
    if seen.is_standing:
        text = "the speed is always 0, but the vehicle shakes as it does when driven"
        yield Finding.of(Kind.SPEED_FROZEN, text)
    most = 1.0 - seen.settings.usable_share_min
    is_mapped = not seen.streams or {Signal.SPEED, Signal.WHEEL_SPEED} & set(seen.streams)
    for why, kind in ((Why.SPEED_MISSING, Kind.SPEED_MISSING), (Why.SPEED_FROZEN, Kind.SPEED_FROZEN)):
        if (share := seen.share(why)) >= REASON_SHARE_MIN and is_mapped and not seen.is_too_short:
            is_ruinous = seen.is_lost and share > most
            yield Finding.of(kind, f"{share:.0%} of the drive", Severity.FAULT if is_ruinous else Severity.WARNING)
    outside = seen.share(Why.TOO_SLOW) + seen.share(Why.TOO_FAST)
    if seen.is_lost and not seen.is_too_short and outside > most:  # towns and stops alone cost no more than time
        text, speed = f"{outside:.0%} of the drive", seen.streams.get(Signal.SPEED)
        if speed is not None:
            low, high = seen.settings.speed_min_mps, seen.settings.speed_max_mps
            text += f": {speed.low:.3g} to {speed.high:.3g} m/s, permitted are {low:g} to {high:g}"
            for factor, mistake in ((3.6, "m/s read as km/h"), (1.0 / 3.6, "km/h read as m/s")):
                if low <= factor * speed.low and factor * speed.high <= high:
                    text += f" ({factor * speed.low:.3g} to {factor * speed.high:.3g} if it is {mistake})"
        yield Finding.of(Kind.SPEED_OUTSIDE_GATE, text)


def _of_masks(seen: _Seen) -> Iterator[Finding]:
    """Time lost to gaps, or to sensors that stuck or sat at the end of their range."""
    for kind, whys in MASKED if all(stream.n >= 2 for stream in seen.streams.values()) else ():
        shares = {why: seen.share(why) for why in whys}
        if sum(shares.values()) > MASKED_SHARE_NOTED:
            told = (f"{why} {share:.1%} of the drive" for why, share in shares.items() if share > 0.0)
            yield Finding.of(kind, ", ".join(told))


def _roll_lost(seen: _Seen) -> Iterator[Finding]:
    """A roll rate that is mapped, and unknown for a good part of the time that can be used."""
    usable = [(batch.roll_usable_share, np.count_nonzero(batch.usable)) for batch in seen.batches]
    known = [(share, n) for share, n in usable if share is not None and n > 0]
    lost = sum((1.0 - share) * n for share, n in known) / max(sum(n for _, n in known), 1)
    if lost > MASKED_SHARE_NOTED and not seen.has(Kind.SENSOR_SILENT, Kind.RATE_LOW):
        yield Finding.of(Kind.ROLL_RATE_LOST, f"{lost:.1%} of the time that can be used")


def _bias(seen: _Seen) -> Iterator[Finding]:
    """A gyroscope that turns while the vehicle does not."""
    bias = seen.facts.mean(Signal.PITCH_RATE)
    if abs(bias) > BIAS_MAX_RADPS and not seen.has(Kind.CHANNELS_SWAPPED, Kind.PITCH_RATE_UNIT):
        yield Finding.of(Kind.PITCH_RATE_BIAS, f"pitch_rate has mean {np.degrees(bias):.3g} deg/s")


def _of_batches(seen: _Seen) -> Iterator[Finding]:
    """No stretch that makes a batch; no batch that can be used, if nothing else says why; or fewer than there are."""
    if not seen.drive.has_identification:
        return
    lost = [one for one in seen.batches if one.rejected and Why.TOO_SHORT not in one.rejected]  # ends are no loss
    if seen.is_too_short:
        if not seen.is_standing:
            longest_s = max((batch.duration_s for batch in seen.batches), default=0.0)
            text = f"the longest unbroken identification stretch lasts {longest_s:.0f} of {seen.facts.duration_s:.0f} s"
            yield Finding.of(Kind.TOO_SHORT, f"{text}; a batch needs {seen.needed_s:.0f} s")
    elif seen.is_lost and not any(one.severity is Severity.FAULT for one in seen.found):
        yield Finding.of(Kind.NO_USABLE_BATCH, seen.reasons(seen.batches))
    if lost and not seen.is_lost:
        yield Finding.of(Kind.BATCHES_LOST, seen.reasons(lost))


# -- the cross-spectra --


def _of_spectra(seen: _Seen) -> Iterator[Finding]:
    """Axes first; units and signs mean something of the right axes alone, and the sensor's place if these are right."""
    if seen.measured is None:
        if not seen.is_lost and all(signal in seen.streams for signal in INERTIAL):
            text = f"fewer than {LEAST_SEGMENTS} unbroken stretches of 5 s at even speed"
            yield Finding.of(Kind.UNSTEADY, text)
        return
    if seen.mends_gravity == 0.0:
        return
    spectra = seen.measured.with_acceleration_times(seen.mends_gravity)
    as_read = seen.phases(spectra)
    misread, corrected = _misread(seen, as_read) or ("", as_read)
    size = _wrong_size(corrected)
    if swapped := _rates_swapped(seen, spectra, as_read, corrected):
        yield Finding.of(Kind.RATES_SWAPPED, swapped)
    elif apart := _apart(spectra, as_read):
        yield Finding.of(Kind.PITCH_RATE_AXIS, apart)
    else:
        if misread:
            text = f"the phases agree with the vehicle's by {corrected.best:.2f} if {misread}"
            yield Finding.of(Kind.SPEED_UNIT, f"{text}, and by far less otherwise")
        if size:
            yield Finding.of(Kind.PITCH_RATE_UNIT, size)
        if corrected.is_turned:
            text = f"the phases agree with the vehicle's by {corrected.turned.best:.2f} with the opposite sign"
            yield Finding.of(Kind.PITCH_RATE_SIGN, f"{text}, by {corrected.upright.best:.2f} with this one")
        if spectra.has_roll and not size:
            yield from _of_roll(spectra)
        if not (misread or size or corrected.is_turned):
            yield from _position(seen, spectra)
    if (rms_mps2 := spectra.acceleration_rms_mps2 * abs(seen.mends_gravity)) < SMOOTH_MPS2:
        yield Finding.of(Kind.SMOOTH_ROAD, f"vertical acceleration is {rms_mps2:.2g} m/s2 (root mean square)")
    yield from _coarse(seen, spectra)


def _misread(seen: _Seen, as_read: Phases) -> tuple[str, Phases] | None:
    """The mistake of the speed's unit that explains the phases far better than none, and its phases."""
    tried = {}
    for what, factor in SPEED_MISREAD.items() if as_read.best < BELIEVED_AGREEMENT else ():
        spectra = cross_spectra_of(seen.batches, reading_of(seen.vehicle, factor))
        if spectra is not None:
            tried[what] = seen.phases(spectra.with_acceleration_times(seen.mends_gravity))
    best = max(tried.items(), key=lambda one: one[1].best, default=None)
    return best if best is not None and best[1].best > as_read.best + UNIT_GAIN else None


def _apart(spectra: CrossSpectra, read: Phases) -> str | None:
    """Why the two sensors do not move together as one body does; None if they do.

    Amidships heave and pitch are nearly independent if the speed varies, so a low coherence alone proves nothing: there
    the phases and the size must at least match a vehicle's.
    """
    freq_hz, likely = spectra.freq_hz[1:-1], read.likely
    moves = (freq_hz >= COHERENCE_BAND_HZ[0]) & (freq_hz <= COHERENCE_BAND_HZ[1])
    coherence = float(np.mean(spectra.coherence[moves]))
    is_vehicle = likely.best >= LEAST_AGREEMENT and USUAL_SCALE[0] <= likely.scale <= USUAL_SCALE[1]
    if coherence >= LEAST_COHERENCE or is_vehicle:
        return None
    text = f"coherence of pitch_rate and vertical_acceleration is {coherence:.2f}, and their phases agree with a "
    return f"{text}vehicle's by {likely.best:.2f}"


def _wrong_size(read: Phases) -> str | None:
    """A pitch rate far too large or too small for the vertical acceleration; None if it is neither."""
    scale = read.likely.scale
    if SCALE_RANGE[0] <= scale <= SCALE_RANGE[1]:
        return None
    return (
        f"pitch_rate is {scale:.3g} times that of a vehicle with this vertical acceleration{_slip(scale, UNIT_RANGE)}"
    )


def _slip(ratio: float, within: tuple[float, float]) -> str:
    """The mistake of a rate's unit that leaves a ratio to the expected ``within`` this range; empty if none does."""
    if within[0] <= ratio / _DEGREES <= within[1]:
        return ": deg/s read as rad/s"
    return ": rad/s read as deg/s" if within[0] <= ratio * _DEGREES <= within[1] else ""


def _rates_swapped(seen: _Seen, spectra: CrossSpectra, as_read: Phases, corrected: Phases) -> str | None:
    """Pitch rate is none, but the roll rate is a sound pitch rate, and the pitch rate then a sound roll rate."""
    if not spectra.has_roll or not (_apart(spectra, as_read) or _wrong_size(corrected)):
        return None
    other = spectra.showing(spectra.parts[EXCHANGED])
    read = seen.phases(other)
    is_roll = pitch_coherence(other) <= ALIKE and ROLL_RANGE[0] <= over_pitch(other) <= ROLL_RANGE[1]
    if not is_roll or _apart(other, read) or _wrong_size(read):
        return None
    return f"the phases agree with the vehicle's by {read.best:.2f} when exchanged, else by {corrected.best:.2f}"


def _of_roll(spectra: CrossSpectra) -> Iterator[Finding]:
    """A roll rate that repeats the pitch rate, moves as no body rolls, or is far too large or too small."""
    coherence, ratio = pitch_coherence(spectra), over_pitch(spectra)
    text, slip = f"roll_rate moves {ratio:.3g} times as much as pitch_rate", _slip(ratio, ROLL_UNIT_RANGE)
    if coherence > ALIKE:
        yield Finding.of(Kind.ROLL_RATE_AXIS, f"its coherence with pitch_rate is {coherence:.2f}")
    elif ratio < ROLL_RANGE[0] and not slip:
        yield Finding.of(Kind.ROLL_RATE_AXIS, f"{text}: a body that rolls moves more")
    elif not ROLL_RANGE[0] <= ratio <= ROLL_RANGE[1]:
        yield Finding.of(Kind.ROLL_RATE_UNIT, text + slip)


def _position(seen: _Seen, spectra: CrossSpectra) -> Iterator[Finding]:
    """The sensor's position by this run alone, compared with the campaign's; signs and units being right."""
    vehicle = seen.vehicle
    if spectra.n_total < PLACING_SEGMENTS:
        return
    position_m, std_m = fitted_position_m(stated_run(seen.drive.run, spectra, vehicle), vehicle)
    off_m = abs(position_m - vehicle.sensor_position_m)
    doubt_m = 3.0 * float(np.hypot(std_m, vehicle.sensor_position_std_m))
    if off_m > max(POSITION_OFF_M, doubt_m):
        by_spectra = f"{position_m:.2f} ± {Z95 * std_m:.2f} m (95 %)"
        text = f"sensor_position_m is {vehicle.sensor_position_m:g}, the spectra say {by_spectra}"
        severity = Severity.FAULT if off_m > max(POSITION_WRONG_M, doubt_m) else Severity.WARNING
        yield Finding.of(Kind.SENSOR_POSITION, text, severity)


def _coarse(seen: _Seen, spectra: CrossSpectra) -> Iterator[Finding]:
    """Signals whose resolution is a large part of them."""
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
                text = f"{min(share, 1.0):.0%} of the power of {signal} comes from its steps of {stream.resolution:.3g}"
                yield Finding.of(Kind.COARSE_RESOLUTION, text)


CHECKS: Final[tuple[Callable[[_Seen], Iterator[Finding]], ...]] = (
    _of_gravity,
    _of_map,
    _of_stamps,
    _of_speed,
    _of_masks,
    _roll_lost,
    _of_spectra,
    _bias,
    _of_batches,
)
"""Every check of a run that was read, in this order: some ask what those before have found."""
