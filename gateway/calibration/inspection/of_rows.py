"""Checks of one drive's log, of its rows and of the batches cut from them."""

from collections.abc import Callable, Iterator
from math import isfinite, pi
from typing import Final

import numpy as np

from gateway.calibration.inspection.finding import Kind, Severity
from gateway.calibration.inspection.rows import Stream
from gateway.calibration.inspection.seen import Said, Seen
from gateway.core.batch import RATE_MIN_SHARE, REASON_SHARE_MIN
from gateway.model.spectra import LEAST_SEGMENTS
from gateway.records import Signal, Why

INERTIAL: Final = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE)
JITTER_SHARE_MAX: Final = 0.25  # chosen: of a sample's interval; half the width of the central 80 %
BIAS_MAX_RADPS: Final = 3.0 * pi / 180.0  # chosen: largest bias of an uncalibrated automotive gyroscope
MASKED_SHARE_NOTED: Final = 0.02  # chosen: of the time
RUINOUS_SHARE: Final = 0.2  # chosen: of a message's frames; if more do not fit the map, the run teaches nothing true
MISSING: Final = {
    Why.SPEED_MISSING: Signal.SPEED,
    Why.ACCELERATION_MISSING: Signal.VERTICAL_ACCELERATION,
    Why.PITCH_RATE_MISSING: Signal.PITCH_RATE,
}


def cut_away(seen: Seen) -> Said:
    """A run that selects nothing of its log."""
    log = seen.drive.log
    if log.span_ns is None:
        yield f"the log lasts {log.duration_s:.0f} s, and the run begins at {log.start_s:g} s"


def gravity(kind: Kind) -> Callable[[Seen], Said]:
    """What the vertical acceleration's mean shows, if it is of this kind."""
    return lambda seen: iter([seen.gravity.text] if seen.gravity.kind is kind else [])


def unmapped(seen: Seen) -> Said:
    """Signals without a place in the map, which no log can therefore contain; every mapped one has a stream."""
    if not seen.streams:
        return
    if Signal.SPEED not in seen.streams and Signal.WHEEL_SPEED not in seen.streams:
        yield "neither speed nor wheel_speed is in the signal map"
    if absent := [signal for signal in INERTIAL if signal not in seen.streams]:
        text = f"{' and '.join(absent)} {'are' if len(absent) > 1 else 'is'} not in the signal map"
        yield f"{text}; axes and loads cannot be checked", Severity.FAULT if len(absent) > 1 else Severity.WARNING


def mismatched(seen: Seen) -> Said:
    """Frames that do not fit the signal map: a fault if a needed signal suffers."""
    for text, share, signals in seen.drive.log.mismatches:
        is_ruinous = share > RUINOUS_SHARE and signals & {*INERTIAL, Signal.SPEED}
        yield text, Severity.FAULT if is_ruinous else Severity.WARNING


def _sensors(seen: Seen, *, are_heard: bool = True) -> Iterator[tuple[Signal, Stream, Severity]]:
    """Without a roll rate a vehicle is weighed all the same."""
    for signal in (*INERTIAL, Signal.ROLL_RATE):
        stream = seen.streams.get(signal)
        if stream is not None and (stream.n >= 2) is are_heard:
            yield signal, stream, Severity.FAULT if signal in INERTIAL else Severity.WARNING


def silent(seen: Seen) -> Said:
    """Sensors without a sample, and why."""
    for signal, stream, severity in _sensors(seen, are_heard=False):
        if seen.is_refused(signal, 1.0):
            continue
        why = seen.drive.log.silent.get(signal)
        yield f"{signal} has {stream.n} samples in the whole run" + (f": {why}" if why else ""), severity


def _is_slow(stream: Stream, seen: Seen) -> bool:
    return stream.rate_hz < RATE_MIN_SHARE * seen.settings.rate_hz


def slow(seen: Seen) -> Said:
    """Sensors that send too rarely."""
    for signal, stream, severity in _sensors(seen):
        if _is_slow(stream, seen):
            least_hz = RATE_MIN_SHARE * seen.settings.rate_hz
            yield f"{signal} comes at {stream.rate_hz:.3g} Hz, at least {least_hz:g} are needed", severity


def jitter(seen: Seen) -> Said:
    """Sensors whose stamps are uneven."""
    for signal, stream, _ in _sensors(seen):
        share = stream.jitter_share
        if not _is_slow(stream, seen) and not share <= JITTER_SHARE_MAX:
            much = f"{100.0 * share:.0f} %" if isfinite(share) else "more than a whole one"
            yield f"intervals of {signal} are off by {much} of their length"


def standing(seen: Seen) -> Said:
    """A speed at rest all along, though the vehicle shakes."""
    if seen.is_standing:
        yield "the speed is always 0, but the vehicle shakes as it does when driven"


def _is_refused(seen: Seen, why: Why, share: float) -> bool:
    return why in MISSING and seen.is_refused(MISSING[why], share)


def speed_lost(why: Why) -> Callable[[Seen], Said]:
    """A fault if that alone leaves no batch, else a warning."""

    def look(seen: Seen) -> Said:
        share, is_mapped = seen.share(why), not seen.streams or {Signal.SPEED, Signal.WHEEL_SPEED} & set(seen.streams)
        if share >= REASON_SHARE_MIN and is_mapped and not seen.is_too_short and not _is_refused(seen, why, share):
            is_ruinous = seen.is_lost and share > 1.0 - seen.settings.usable_share_min
            yield f"{share:.0%} of the drive", Severity.FAULT if is_ruinous else Severity.WARNING

    return look


def outside_gate(seen: Seen) -> Said:
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


def masked(*whys: Why) -> Callable[[Seen], Said]:
    """Time lost to gaps, or to sensors that stuck or sat at the end of their range."""

    def look(seen: Seen) -> Said:
        shares = {why: share for why in whys if not _is_refused(seen, why, share := seen.share(why))}
        if sum(shares.values()) > MASKED_SHARE_NOTED and all(stream.n >= 2 for stream in seen.streams.values()):
            yield ", ".join(f"{why} {share:.1%} of the drive" for why, share in shares.items() if share > 0.0)

    return look


def roll_lost(seen: Seen) -> Said:
    """A roll rate that is mapped, and unknown for a good part of the time that can be used."""
    weights = [(batch.roll_usable_share, np.count_nonzero(batch.usable)) for batch in seen.batches]
    known = [(share, n) for share, n in weights if share is not None and n > 0]
    lost = sum((1.0 - share) * n for share, n in known) / max(sum(n for _, n in known), 1)
    if lost > MASKED_SHARE_NOTED:
        yield f"{lost:.1%} of the time that can be used"


def unsteady(seen: Seen) -> Said:
    """No even stretches, though both sensors are there."""
    if seen.measured is None and not seen.is_lost and all(signal in seen.streams for signal in INERTIAL):
        yield f"fewer than {LEAST_SEGMENTS} unbroken stretches of 5 s at even speed"


def biased(seen: Seen) -> Said:
    """A pitch rate whose mean no vehicle has."""
    if abs(bias := seen.facts.mean(Signal.PITCH_RATE)) > BIAS_MAX_RADPS:
        yield f"pitch_rate has mean {np.degrees(bias):.3g} deg/s"


def too_short(seen: Seen) -> Said:
    """No stretch that makes a batch."""
    if seen.drive.has_identification and seen.is_too_short and not seen.is_standing:
        longest_s = max((batch.duration_s for batch in seen.batches), default=0.0)
        text = f"the longest unbroken identification stretch lasts {longest_s:.0f} of {seen.facts.duration_s:.0f} s"
        yield f"{text}; a batch needs {seen.needed_s:.0f} s"


def none_left(seen: Seen) -> Said:
    """Reported only if nothing else says why."""
    has_fault = any(finding.severity is Severity.FAULT for finding in seen.found)
    if seen.drive.has_identification and seen.is_lost and not (seen.is_too_short or has_fault):
        yield f"{len(seen.batches)} batches: {seen.reasons(seen.batches)}"


def some_lost(seen: Seen) -> Said:
    """Batches that were rejected while others were not."""
    lost = [one for one in seen.batches if one.rejected and Why.TOO_SHORT not in one.rejected]  # ends are no loss
    if seen.drive.has_identification and lost and not seen.is_lost:
        yield f"{len(lost)} of {len(seen.batches)} batches: {seen.reasons(lost)}"
