"""Findings about the decoded rows of a drive before they are cut into batches: rates, gaps, means, speeds."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite, nan, pi
from types import MappingProxyType
from typing import Final

import numpy as np

from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.core.batch import GRAVITY_TOLERANCE_MPS2, RATE_MIN_SHARE, Traits
from gateway.core.settings import BatchSettings
from gateway.core.timeline import sample_rate_hz
from gateway.records import ASIDE, Motion, SensorTraits, Signal
from gateway.units import NS_PER_S, STANDARD_GRAVITY_MPS2

INERTIAL: Final = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE)
JITTER_SHARE_MAX: Final = 0.25  # chosen: of a sample's interval; half the width of the central 80 %
BIAS_MAX_RADPS: Final = 3.0 * pi / 180.0  # chosen: largest bias of an uncalibrated automotive gyroscope
UNIT_TOLERANCE: Final = 0.15  # chosen: relative, of gravity in a wrong unit
STEADY_SHARE: Final = 0.2  # chosen: scatter over mean below which the mean is gravity
SHAKING_MPS2: Final = 0.2  # chosen: a vehicle at rest with its engine running stays below
MISREAD_AS_MPS2: Final = {  # what gravity then reads, over 9.81
    "its numbers are g, but the signal map says m/s2": 1.0 / STANDARD_GRAVITY_MPS2,
    "its numbers are m/s2, but the signal map says g": STANDARD_GRAVITY_MPS2,
    "its numbers are mg, but the signal map says m/s2": 1000.0 / STANDARD_GRAVITY_MPS2,
    "its numbers are mg, but the signal map says g": 1000.0,
    "its numbers are m/s2, but the signal map says mg": STANDARD_GRAVITY_MPS2 / 1000.0,
    "its numbers are g, but the signal map says mg": 1.0 / 1000.0,
}


@dataclass(frozen=True, slots=True)
class Stream:
    """One signal's samples: rate, unevenness as a share of the interval, and its distribution in SI."""

    n: int
    rate_hz: float
    jitter_share: float
    mean: float
    std: float
    low: float
    middle: float
    high: float
    resolution: float


@dataclass(frozen=True, slots=True)
class RowFacts:
    """Facts about one drive's rows; ``streams`` has every mapped signal that an estimate uses."""

    duration_s: float = 0.0
    streams: Mapping[Signal, Stream] = field(default_factory=dict)

    def mean(self, signal: Signal) -> float:
        """NaN without a sample."""
        return self.streams[signal].mean if signal in self.streams else nan


def row_facts(motion: Motion, traits: Traits) -> RowFacts:
    """Facts of the rows in any order; low, middle and high of a stream are its 5, 50 and 95 % quantiles.

    A journey's signals are left out: they need no check here, and the vehicle's positions are private.
    """
    motion = motion.weighing
    duration_s = float(np.ptp(motion.t_ns)) / NS_PER_S if len(motion) else 0.0
    streams = {
        signal: _stream(motion, signal, traits.get(signal, SensorTraits()))
        for signal in motion.signals
        if signal not in ASIDE
    }
    return RowFacts(duration_s, streams)


def _stream(motion: Motion, signal: Signal, trait: SensorTraits) -> Stream:
    t_ns, x = motion.of(signal)
    if len(x) < 2:
        return Stream(len(x), 0.0, nan, nan, nan, nan, nan, nan, trait.resolution)
    intervals_ns = np.diff(np.sort(t_ns))
    early, usual, late = np.quantile(intervals_ns, [0.1, 0.5, 0.9])
    low, middle, high = (float(q) for q in np.quantile(x, [0.05, 0.5, 0.95]))
    return Stream(
        n=len(x),
        rate_hz=sample_rate_hz(np.unique(t_ns)),
        jitter_share=float((late - early) / 2.0 / usual) if usual > 0.0 else nan,
        mean=float(np.mean(x)),
        std=float(np.std(x)),
        low=low,
        middle=middle,
        high=high,
        resolution=trait.resolution,
    )


def unmapped_findings(facts: RowFacts) -> Iterator[Finding]:
    """Signals without a place in the map, which no log can therefore contain; every mapped one has a stream."""
    if not facts.streams:
        return
    if Signal.SPEED not in facts.streams and Signal.WHEEL_SPEED not in facts.streams:
        yield Finding.of(Kind.SIGNAL_UNMAPPED, "neither speed nor wheel_speed is in the signal map")
    absent = [signal for signal in INERTIAL if signal not in facts.streams]
    if absent:
        severity = Severity.FAULT if len(absent) == len(INERTIAL) else Severity.WARNING
        text = f"{' and '.join(absent)} {'are' if len(absent) > 1 else 'is'} not in the signal map"
        yield Finding.of(Kind.SIGNAL_UNMAPPED, f"{text}; axes and loads cannot be checked", severity)


def rate_findings(
    facts: RowFacts, settings: BatchSettings, why_silent: Mapping[Signal, str] = MappingProxyType({})
) -> Iterator[Finding]:
    """Sensors that are silent, slow or unevenly stamped; without a roll rate a vehicle is weighed all the same."""
    for signal in (*INERTIAL, Signal.ROLL_RATE):
        stream = facts.streams.get(signal)
        if stream is None:
            continue
        severity = Severity.FAULT if signal in INERTIAL else Severity.WARNING
        if stream.n < 2:
            text = f"{signal} has {stream.n} samples in the whole run"
            why = f": {why_silent[signal]}" if signal in why_silent else ""
            yield Finding.of(Kind.SENSOR_SILENT, text + why, severity)
        elif stream.rate_hz < RATE_MIN_SHARE * settings.rate_hz:
            text = (
                f"{signal} comes at {stream.rate_hz:.3g} Hz, at least {RATE_MIN_SHARE * settings.rate_hz:g} are needed"
            )
            yield Finding.of(Kind.RATE_LOW, text, severity)
        elif not stream.jitter_share <= JITTER_SHARE_MAX:
            share = f"{100.0 * stream.jitter_share:.0f} %" if isfinite(stream.jitter_share) else "more than a whole one"
            yield Finding.of(Kind.JITTER, f"intervals of {signal} are off by {share} of their length")


@dataclass(frozen=True, slots=True)
class Mended:
    """The factor that would correct the vertical acceleration; whether its axis is vertical at all."""

    factor: float = 1.0
    is_axis_sound: bool = True


def gravity_findings(facts: RowFacts) -> tuple[Mended, list[Finding]]:
    """Whether the vertical acceleration shows +9.81 m/s2, and what it shows otherwise."""
    stream = facts.streams.get(Signal.VERTICAL_ACCELERATION)
    if stream is None or stream.n < 2 or abs(stream.mean - STANDARD_GRAVITY_MPS2) <= GRAVITY_TOLERANCE_MPS2:
        return Mended(), []
    if _carries_gravity_instead(facts):
        text = f"vertical_acceleration has mean {stream.mean:.3g}, pitch_rate has {facts.mean(Signal.PITCH_RATE):.3g}"
        return Mended(is_axis_sound=False), [Finding.of(Kind.CHANNELS_SWAPPED, text)]
    reads = f"vertical_acceleration has mean {stream.mean:.3g} m/s2"
    if abs(stream.mean + STANDARD_GRAVITY_MPS2) <= GRAVITY_TOLERANCE_MPS2:
        return Mended(factor=-1.0), [Finding.of(Kind.ACCELERATION_SIGN, reads)]
    for misread, ratio in MISREAD_AS_MPS2.items():
        is_unit = abs(abs(stream.mean) / STANDARD_GRAVITY_MPS2 / ratio - 1.0) <= UNIT_TOLERANCE
        if is_unit and stream.std < STEADY_SHARE * abs(stream.mean):
            factor = np.sign(stream.mean) / ratio
            turned = "" if factor > 0.0 else ", and its axis points down"
            return Mended(factor=float(factor)), [Finding.of(Kind.ACCELERATION_UNIT, f"{reads}: {misread}{turned}")]
    return Mended(is_axis_sound=False), [Finding.of(Kind.ACCELERATION_AXIS, reads + _elsewhere(facts))]


def _carries_gravity_instead(facts: RowFacts) -> bool:
    """Gravity in the signal mapped as pitch rate, whatever unit the map says."""
    rate = facts.streams.get(Signal.PITCH_RATE)
    if rate is None or not rate.std < STEADY_SHARE * abs(rate.mean):
        return False
    over_gravity = [abs(rate.mean) / STANDARD_GRAVITY_MPS2 / to_si for to_si in (1.0, pi / 180.0)]
    return any(abs(ratio - 1.0) <= UNIT_TOLERANCE for ratio in over_gravity)


def _elsewhere(facts: RowFacts) -> str:
    along = facts.mean(Signal.LONGITUDINAL_ACCELERATION)
    if abs(abs(along) - STANDARD_GRAVITY_MPS2) <= GRAVITY_TOLERANCE_MPS2:
        return f", longitudinal_acceleration has {along:.3g}: exchange the two"
    return ""


def bias_findings(facts: RowFacts) -> Iterator[Finding]:
    """A pitch rate whose mean no vehicle has."""
    bias = facts.mean(Signal.PITCH_RATE)
    if abs(bias) > BIAS_MAX_RADPS:
        yield Finding.of(Kind.PITCH_RATE_BIAS, f"pitch_rate has mean {np.degrees(bias):.3g} deg/s")


def stands_still_but_shakes(facts: RowFacts) -> bool:
    """The speed says at rest all along; the vertical acceleration says otherwise."""
    speed, acceleration = facts.streams.get(Signal.SPEED), facts.streams.get(Signal.VERTICAL_ACCELERATION)
    if speed is None or acceleration is None or speed.n < 2:
        return False
    return speed.high < BatchSettings().standstill_speed_mps and acceleration.std > SHAKING_MPS2
