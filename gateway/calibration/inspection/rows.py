"""Facts of the decoded rows of a drive before they are cut into batches: rates, gaps, means, and what gravity shows."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan, pi
from typing import Final, NamedTuple

import numpy as np

from gateway.calibration.inspection.finding import Kind
from gateway.core.batch import GRAVITY_TOLERANCE_MPS2, Traits
from gateway.core.timeline import sample_rate_hz
from gateway.records import ASIDE, Motion, SensorTraits, Signal
from gateway.units import NS_PER_S, STANDARD_GRAVITY_MPS2

UNIT_TOLERANCE: Final = 0.15  # chosen: relative, of gravity in a wrong unit
STEADY_SHARE: Final = 0.2  # chosen: scatter over mean below which the mean is gravity
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
    signals = [signal for signal in motion.signals if signal not in ASIDE]
    return RowFacts(duration_s, {one: _stream(motion, one, traits.get(one, SensorTraits())) for one in signals})


def _stream(motion: Motion, signal: Signal, trait: SensorTraits) -> Stream:
    t_ns, x = motion.of(signal)
    if len(x) < 2:
        return Stream(len(x), 0.0, nan, nan, nan, nan, nan, nan, trait.resolution)
    early, usual, late = np.quantile(np.diff(np.sort(t_ns)), [0.1, 0.5, 0.9])
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


class Gravity(NamedTuple):
    """Whether the vertical acceleration shows +9.81 m/s2: what is wrong if it does not, and the factor that mends it;
    0 if no factor does.
    """

    kind: Kind | None = None
    text: str = ""
    factor: float = 1.0


def gravity_in(facts: RowFacts) -> Gravity:
    """What the mean of the vertical acceleration shows."""
    stream = facts.streams.get(Signal.VERTICAL_ACCELERATION)
    if stream is None or stream.n < 2 or _is_gravity(stream.mean):
        return Gravity()
    rate = facts.streams.get(Signal.PITCH_RATE)
    if rate is not None and any(_is_misread(rate, to_si) for to_si in (1.0, pi / 180.0)):  # whatever unit the map says
        text = f"vertical_acceleration has mean {stream.mean:.3g}, pitch_rate has {rate.mean:.3g}"
        return Gravity(Kind.CHANNELS_SWAPPED, text, 0.0)
    reads = f"vertical_acceleration has mean {stream.mean:.3g} m/s2"
    if _is_gravity(-stream.mean):
        return Gravity(Kind.ACCELERATION_SIGN, reads, -1.0)
    for misread, ratio in MISREAD_AS_MPS2.items():
        if _is_misread(stream, ratio):
            turned = "" if stream.mean > 0.0 else ", and its axis points down"
            return Gravity(Kind.ACCELERATION_UNIT, f"{reads}: {misread}{turned}", float(np.sign(stream.mean)) / ratio)
    along = facts.mean(Signal.LONGITUDINAL_ACCELERATION)
    elsewhere = f", longitudinal_acceleration has {along:.3g}: exchange the two" if _is_gravity(abs(along)) else ""
    return Gravity(Kind.ACCELERATION_AXIS, reads + elsewhere, 0.0)


def _is_gravity(mean_mps2: float) -> bool:
    return abs(mean_mps2 - STANDARD_GRAVITY_MPS2) <= GRAVITY_TOLERANCE_MPS2


def _is_misread(stream: Stream, ratio: float) -> bool:
    """Whether its mean is gravity times ``ratio``, of either sign."""
    of_gravity = abs(stream.mean) / STANDARD_GRAVITY_MPS2 / ratio
    return abs(of_gravity - 1.0) <= UNIT_TOLERANCE and stream.std < STEADY_SHARE * abs(stream.mean)
