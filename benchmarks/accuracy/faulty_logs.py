"""Ordinary sensor faults: each rewrites the frames of a recorded drive's log.

A fault works on mapped signals, in SI and vehicle axes (ISO 8855), and encodes them back into the device's bits, so
that it passes through the log's reader and everything after it.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy import signal as filters

from gateway.bus.signals import SignalMap
from gateway.bus.signals.mapping import MappedSignal
from gateway.records import F64, I64, Frames, Signal
from gateway.units import NS_PER_S, STANDARD_GRAVITY_MPS2

ACCELERATION, PITCH_RATE, ROLL_RATE, SPEED = (
    Signal.VERTICAL_ACCELERATION,
    Signal.PITCH_RATE,
    Signal.ROLL_RATE,
    Signal.SPEED,
)
NAMES: Final = {ACCELERATION: "acceleration", PITCH_RATE: "pitch rate", ROLL_RATE: "roll rate", SPEED: "speed"}
LEVER_CUT_HZ: Final = 20.0  # chosen: the derivative of a gyro's noise is not angular acceleration
BRACKET_DAMPING: Final = 0.1  # chosen: of critical
PERIOD_S: Final = 60.0  # chosen: period of intermittent faults


@dataclass(frozen=True, slots=True)
class Log:
    """The frames (n,) of a drive in order of time, and their signal map."""

    frames: Frames
    signal_map: SignalMap

    def mapped(self, signal: Signal) -> tuple[MappedSignal, I64]:
        """The mapping of a signal, and the rows (k,) of its frames. Raises KeyError if the map has none."""
        for message in self.signal_map.messages:
            for mapped in message.signals:
                if mapped.signal is signal:
                    return mapped, np.flatnonzero(message.id_filter.matches(self.frames.can_id))
        raise KeyError(signal)

    def samples(self, signal: Signal) -> tuple[F64, F64]:
        """Seconds since the first frame (k,) and SI (k,)."""
        mapped, rows = self.mapped(signal)
        t_s = (self.frames.t_ns[rows] - self.frames.t_ns[0]) / NS_PER_S
        return t_s, mapped.field.physical(mapped.field.bits(self.frames.payload[rows])) * mapped.to_si

    def showing(self, signal: Signal, samples: F64) -> "Log":
        """The same drive with these samples (k,), clipped to the range of the bits."""
        mapped, _ = self.mapped(signal)
        return self.sending(signal, mapped.field.bits_of(samples / mapped.to_si))

    def sending(self, signal: Signal, bits: np.ndarray) -> "Log":
        """The same drive with these raw bits (k,)."""
        mapped, rows = self.mapped(signal)
        payload = self.frames.payload.copy()
        touched = payload[rows]
        mapped.field.put(touched, bits)
        payload[rows] = touched
        return replace(self, frames=replace(self.frames, payload=payload))

    def rows(self, chosen: I64, t_ns: I64 | None = None) -> "Log":
        """These frames, possibly repeated, at other times (k,) if given; in order of time."""
        one = self.frames
        t_ns = one.t_ns[chosen] if t_ns is None else t_ns
        chosen, t_ns = chosen[order := np.argsort(t_ns, kind="stable")], t_ns[order]
        return replace(self, frames=Frames(t_ns, one.can_id[chosen], one.length[chosen], one.payload[chosen]))


Rewrite = Callable[[Log, np.random.Generator], Log]
Change = Callable[[F64, F64, np.random.Generator], F64]  # of times and samples


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault: its name, its strength, the signals it needs, and its rewriting of a log."""

    name: str
    strength: str
    signals: tuple[Signal, ...]
    rewrite: Rewrite

    @property
    def id(self) -> str:
        """The fault in a file name."""
        return "".join(c if c.isalnum() else "-" for c in f"{self.name} {self.strength}")


def faults_of(signal_map: SignalMap) -> list[Fault]:
    """The faults whose signals the map has; the first is none."""
    return [fault for fault in FAULTS if {*fault.signals} <= {*signal_map.signals}]


def _each(
    name: str, change: Callable[[float], Change], unit: str, *rows: tuple[Signal, Iterable[float]]
) -> list[Fault]:
    """The same fault of several signals in several strengths."""
    return [
        Fault(f"{NAMES[signal]} {name}", f"{strength:g}{unit}", (signal,), _of_samples(change(strength), signal))
        for signal, strengths in rows
        for strength in strengths
    ]


def _of_samples(change: Change, *signals: Signal) -> Rewrite:
    def rewrite(log: Log, rng: np.random.Generator) -> Log:
        for signal in signals:
            log = log.showing(signal, change(*log.samples(signal), rng))
        return log

    return rewrite


def _times(by: float) -> Change:
    return lambda t_s, x, rng: by * x


def _biased(by: float) -> Change:
    return lambda t_s, x, rng: x + by


def _clipped(at: float) -> Change:
    """Clipped at this distance on either side of the mean."""
    return lambda t_s, x, rng: np.clip(x, x.mean() - at, x.mean() + at)


def _noisy(std: float) -> Change:
    return lambda t_s, x, rng: x + std * rng.standard_normal(len(x))


def _coarse(step: float) -> Change:
    return lambda t_s, x, rng: step * np.round(x / step)


def _low_pass(cut_hz: float) -> Change:
    return lambda t_s, x, rng: _filtered(filters.butter(2, cut_hz, fs=_rate_hz(t_s)), x)


def _resonance(at_hz: float) -> Change:
    """A mass on a bracket, which follows its base through a spring."""
    w = 2.0 * math.pi * at_hz
    bracket = ([2.0 * BRACKET_DAMPING * w, w**2], [1.0, 2.0 * BRACKET_DAMPING * w, w**2])
    return lambda t_s, x, rng: _filtered(filters.bilinear(*bracket, fs=_rate_hz(t_s)), x)


def _filtered(by: tuple[F64, F64], x: F64) -> F64:
    filtered: F64 = x[0] + filters.lfilter(*by, x - x[0])
    return filtered


def _rate_hz(t_s: F64) -> float:
    return float((len(t_s) - 1) / (t_s[-1] - t_s[0]))


def _held(every_s: float) -> Change:
    """A device that measures at a lower rate than it sends."""
    return lambda t_s, x, rng: x[np.searchsorted(t_s, np.floor(t_s / every_s) * every_s)]


def _stuck(part_s: float) -> Change:
    """Repeats the last sample for this many seconds of every minute."""

    def change(t_s: F64, x: F64, rng: np.random.Generator) -> F64:
        begin_s = np.floor(t_s / PERIOD_S) * PERIOD_S + (PERIOD_S - part_s)
        return np.where(t_s >= begin_s, x[np.searchsorted(t_s, np.minimum(begin_s, t_s))], x)

    return change


def _wrapped(span: float) -> Change:
    return lambda t_s, x, rng: (x + span) % (2.0 * span) - span


def _late(by_s: float, *signals: Signal) -> Rewrite:
    """Samples that are older than their frames; each frame keeps its time."""
    return _of_samples(lambda t_s, x, rng: np.interp(t_s - by_s, t_s, x), *signals)


def _stuck_bit(signal: Signal, bit: int, value: int) -> Fault:
    def rewrite(log: Log, rng: np.random.Generator) -> Log:
        mapped, rows = log.mapped(signal)
        bits, one = mapped.field.bits(log.frames.payload[rows]), np.uint64(1 << bit)
        return log.sending(signal, bits | one if value else bits & ~one)

    return Fault(f"{NAMES[signal]} has a stuck bit", f"bit {bit} at {value}", (signal,), rewrite)


def _moved(back_m: float = 0.0, left_m: float = 0.0) -> Rewrite:
    """A point of a rigid body: further back it rises as the nose goes down, further left as the left side goes up."""

    def rewrite(log: Log, rng: np.random.Generator) -> Log:
        t_s, x = log.samples(ACCELERATION)
        for lever_m, signal in ((back_m, PITCH_RATE), (left_m, ROLL_RATE)):
            if lever_m:
                rate_t_s, rate = log.samples(signal)
                smooth = filters.sosfiltfilt(filters.butter(2, LEVER_CUT_HZ, fs=_rate_hz(rate_t_s), output="sos"), rate)
                x = x + lever_m * np.interp(t_s, rate_t_s, np.gradient(smooth) * _rate_hz(rate_t_s))
        return log.showing(ACCELERATION, x)

    return rewrite


def _turned(deg: float) -> Rewrite:
    """Turned about the vertical, so that pitch and roll rate mix."""
    c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))

    def rewrite(log: Log, rng: np.random.Generator) -> Log:
        (pitch_t_s, pitch), (roll_t_s, roll) = log.samples(PITCH_RATE), log.samples(ROLL_RATE)
        turned = log.showing(PITCH_RATE, c * pitch - s * np.interp(pitch_t_s, roll_t_s, roll))
        return turned.showing(ROLL_RATE, c * roll + s * np.interp(roll_t_s, pitch_t_s, pitch))

    return rewrite


def _dropped(share: float) -> Rewrite:
    return lambda log, rng: log.rows(np.flatnonzero(rng.random(len(log.frames)) >= share))


def _doubled(share: float) -> Rewrite:
    """Sent again half a millisecond later."""

    def rewrite(log: Log, rng: np.random.Generator) -> Log:
        return _joined(log, log, np.flatnonzero(rng.random(len(log.frames)) < share), round(0.0005 * NS_PER_S))

    return rewrite


def _two_devices(other: Rewrite, late_s: float) -> Rewrite:
    """A second inertial sensor sends on the identifiers of the first."""

    def rewrite(log: Log, rng: np.random.Generator) -> Log:
        inertial = np.union1d(log.mapped(ACCELERATION)[1], log.mapped(PITCH_RATE)[1])
        return _joined(log, other(log, rng), inertial, round(late_s * NS_PER_S))

    return rewrite


def _joined(log: Log, other: Log, rows: I64, late_ns: int) -> Log:
    """The log with these rows of another log with as many frames, delayed."""
    one, more = log.frames, other.rows(rows).frames
    t_ns = np.r_[one.t_ns, more.t_ns + late_ns]
    both = Frames(
        t_ns,
        np.r_[one.can_id, more.can_id],
        np.r_[one.length, more.length],
        np.concatenate([one.payload, more.payload]),
    )
    return replace(log, frames=both).rows(np.arange(len(t_ns)))


BOTH: Final = (ACCELERATION, PITCH_RATE)


def _amounts() -> Iterator[Fault]:
    """A wrong number for each sample."""
    for name, change, unit, *rows in (
        (
            "times", _times, "",
            (ACCELERATION, (0.8, 0.95, 0.98, 1.02, 1.05, 1.2)), (PITCH_RATE, (0.5, 0.8, 0.95, 1.05, 1.25, 2.0)),
            (ROLL_RATE, (0.5, 2.0)), (SPEED, (0.9, 0.97, 1.03, 1.1)),
        ),
        ("biased by", _biased, " m/s2", (ACCELERATION, (0.1, 0.3, 1.0, 3.0))),
        ("biased by", _biased, " rad/s", (PITCH_RATE, (0.01, 0.1))),
    ):  # fmt: skip
        yield from _each(name, change, unit, *rows)
    for signal in (*BOTH, ROLL_RATE):
        yield Fault(f"{NAMES[signal]} turned over", "", (signal,), _of_samples(lambda t_s, x, rng: -x, signal))
    for name, signal, by in (
        ("in g for m/s2", ACCELERATION, 1.0 / STANDARD_GRAVITY_MPS2),
        ("in rad/s for deg/s", PITCH_RATE, math.pi / 180.0),
        ("in deg/s for rad/s", PITCH_RATE, 180.0 / math.pi),
        ("in m/s for km/h", SPEED, 1.0 / 3.6),
        ("in mph for km/h", SPEED, 1.0 / 1.609344),
        ("in km/h for mph", SPEED, 1.609344),
    ):
        yield Fault(f"{NAMES[signal]} sent {name}", "", (signal,), _of_samples(_times(by), signal))


def _dynamics() -> Iterator[Fault]:
    """Samples that do not represent the present."""
    yield from _each("rings at", _resonance, " Hz", (ACCELERATION, (4.0, 8.0, 15.0, 30.0)), (PITCH_RATE, (8.0,)))
    yield from _each("low pass of", _low_pass, " Hz", *((one, (1.0, 3.0, 8.0)) for one in BOTH))
    yield Fault("both low pass of", "3 Hz", BOTH, _of_samples(_low_pass(3.0), *BOTH))
    yield from _each("held for", _held, " s", *((one, (0.05, 0.2)) for one in BOTH), (SPEED, (5.0,)))
    for name, signals, times_s in (
        ("acceleration", (ACCELERATION,), (0.01, 0.05, 0.2)),
        ("pitch rate", (PITCH_RATE,), (0.01, 0.05, 0.2)),
        ("both", BOTH, (0.2,)),
        ("speed", (SPEED,), (2.0, 10.0)),
    ):
        for by_s in times_s:
            yield Fault(f"{name} late by", f"{by_s:g} s", signals, _late(by_s, *signals))
    yield from _each("stuck each minute for", _stuck, " s", *((one, (5.0, 30.0)) for one in (*BOTH, ROLL_RATE, SPEED)))
    yield Fault("speed frozen", "", (SPEED,), _of_samples(lambda t_s, x, rng: np.full_like(x, np.median(x)), SPEED))


def _frames() -> Iterator[Fault]:
    """Too many frames, or too few."""
    for share in (0.1, 1.0):
        yield Fault("frames doubled", f"{share:.0%}", (), _doubled(share))
    for share in (0.01, 0.05, 0.2, 0.5):
        yield Fault("frames dropped", f"{share:.0%}", (), _dropped(share))
    for name, other in (
        ("alike", lambda log, rng: log),
        ("one at 0.9", _of_samples(_times(0.9), *BOTH)),
        ("one 1 m back", _moved(back_m=1.0)),
    ):
        yield Fault("two devices on one identifier", name, BOTH, _two_devices(other, 0.004))


def _mounts() -> Iterator[Fault]:
    """A sensor that was moved since calibration."""
    for back_m in (-1.0, -0.3, 0.1, 0.3, 1.0):
        yield Fault("sensor moved back", f"{back_m:g} m", BOTH, _moved(back_m=back_m))
    for left_m in (-0.3, 0.1, 0.3, 1.0):
        yield Fault("sensor moved left", f"{left_m:g} m", (*BOTH, ROLL_RATE), _moved(left_m=left_m))
    for deg in (5.0, 15.0, 45.0, 90.0, 180.0):
        yield Fault("sensor turned", f"{deg:g} degrees", (PITCH_RATE, ROLL_RATE), _turned(deg))


def _digits() -> Iterator[Fault]:
    """Errors of a number between the sensor and the bus."""
    for name, change, of_acceleration, of_pitch_rate in (
        ("clipped beyond", _clipped, (0.5, 1.0, 2.0, 4.0), (0.03, 0.1)),
        ("wraps around at", _wrapped, (11.0, 13.0), (0.05, 0.15)),
        ("noisy by", _noisy, (0.1, 0.5, 2.0), (0.005, 0.02, 0.1)),
        ("in steps of", _coarse, (0.5, 2.0), (0.02, 0.1)),
    ):
        yield from _each(name, change, " m/s2", (ACCELERATION, of_acceleration))
        yield from _each(name, change, " rad/s", (PITCH_RATE, of_pitch_rate))
    for signal, bits in ((ACCELERATION, (3, 7, 9)), (PITCH_RATE, (2, 5, 7)), (SPEED, (9, 11))):
        for bit in bits:
            yield from (_stuck_bit(signal, bit, value) for value in (0, 1))


FAULTS: Final = (
    Fault("as recorded", "", (), lambda log, rng: log),
    *_amounts(),
    *_dynamics(),
    *_frames(),
    *_mounts(),
    *_digits(),
)
