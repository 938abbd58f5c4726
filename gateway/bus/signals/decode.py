"""Frames to motion: the one decoder, for whole columns at once, used by bulk readers and the live service alike.

cantools is the reference for the bits: a property test compares every number with it.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Final

import numpy as np

from gateway.bus.signals.bit_field import U64, BitField, Coding
from gateway.bus.signals.mapping import (
    QUANTITIES,
    SOURCE_ADDRESS,
    Condition,
    MappedMessage,
    MappedSignal,
    SignalMap,
    id_name,
)
from gateway.records import ASIDE, F64, I64, U8, U32, Bool, Frames, Motion, Signal
from gateway.words import counted

J1939_LAST_VALID_BYTE: Final = 0xFA  # SAE J1939-71: a most significant byte above this is no measurement
TELLING_SHARE: Final = 0.01  # chosen: of frames, of a log or message; so many refused are why a sensor is missing
NEEDED: Final = frozenset({Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.SPEED, Signal.WHEEL_SPEED})
MOST_COMPARED: Final = 16  # chosen: allowed numbers that are compared one by one, which is faster for few
NAMED_SOURCES: Final = 4  # chosen: of a J1939 group
SAME_SPEED_SHARE: Final = 0.02  # chosen: mean speeds of two devices of one vehicle differ by less
RANGE_TOLERANCE_STEPS: Final = 0.01  # chosen: the limits of a DBC are decimals; a raw number on a limit must pass


class Rejected(StrEnum):
    """Why a frame of a mapped message gave no sample of a signal."""

    WRONG_LENGTH = "wrong_length"
    MULTIPLEXED_OUT = "multiplexed_out"
    NOT_AVAILABLE = "not_available"
    INVALID = "invalid"
    NOT_A_NUMBER = "not_a_number"
    OUT_OF_RANGE = "out_of_range"


_QUIET: Final[Mapping[Rejected, str]] = {
    Rejected.MULTIPLEXED_OUT: "have other signals in its place (multiplexed)",
    Rejected.NOT_AVAILABLE: "say that it is not available",
    Rejected.INVALID: "do not meet valid_when",
    Rejected.NOT_A_NUMBER: "have no number",
}
"""Reasons that are usual for some frames, and a cause if they are those of all."""


@dataclass(frozen=True, slots=True)
class SignalCounts:
    """Outcomes of the frames that can carry one signal."""

    samples: int
    rejected: Mapping[Rejected, int]


@dataclass(frozen=True, slots=True)
class Remark:
    """Why frames of a message give no sample or the wrong one: a sentence for people, the share of its frames, and the
    signals that suffer.
    """

    text: str
    share: float
    signals: frozenset[Signal]


class Decoder:
    """Turns frames into motion by one signal map. The counts are its only memory: chunking leaves no trace."""

    def __init__(self, signal_map: SignalMap) -> None:
        self.signals = signal_map.signals
        self._messages = [_MessageReader(message, self.signals) for message in signal_map.messages]
        self._is_aside = np.array([all(m.signal in ASIDE for m in one.signals) for one in signal_map.messages])
        self._counted = tuple(s for s in self.signals if signal_map.traits[s].counter_modulus)

    def decode(self, frames: Frames) -> Motion:
        """One row for every frame of a mapped message, in order of arrival; other frames are passed over.

        All signals of a frame share its row. NaN if a frame does not validly carry a sample.
        """
        message_of = np.full(len(frames), -1, np.int16)
        for i, message in enumerate(self._messages):
            message_of[message.mapped.id_filter.matches(frames.can_id)] = i
        rows = np.flatnonzero(message_of >= 0)
        message_of = message_of[rows]
        columns = np.full((len(rows), len(self.signals)), np.nan)
        counters = {signal: np.full(len(rows), np.nan) for signal in self._counted}
        for i, message in enumerate(self._messages):
            ours = np.flatnonzero(message_of == i)
            if len(ours):
                at = rows[ours]
                payload = frames.payload.take(at, axis=0)
                message.read(columns, counters, ours, payload, frames.length[at], frames.can_id[at])
        aside = self._is_aside[message_of] if self._is_aside.any() else None
        return Motion(self.signals, frames.t_ns[rows], columns, counters, aside)

    @property
    def counts(self) -> dict[Signal, SignalCounts]:
        return {
            one.mapped.signal: SignalCounts(message.n_frames - one.rejected.total(), dict(one.rejected))
            for message in self._messages
            for one in message.readers
        }

    def remarks(self) -> tuple[Remark, ...]:
        """Frames of another length than the database says, values out of range or with names, and signals of several
        devices.
        """
        return tuple(remark for message in self._messages for remark in message.remarks())

    def causes(self) -> tuple[Remark, ...]:
        """The causes that explain why nothing is weighed: they concern a good part of a signal that weighing needs."""
        return tuple(one for one in self.remarks() if one.share >= TELLING_SHARE and one.signals & NEEDED)

    def silent(self) -> tuple[Remark, ...]:
        """Signals that weighing needs and that have no sample, by message: no frame came, or none counts."""
        return tuple(remark for message in self._messages for remark in message.silent())


class _MessageReader:
    """Reads the mapped signals of one message, and counts."""

    def __init__(self, mapped: MappedMessage, signals: tuple[Signal, ...]) -> None:
        self.mapped = mapped
        self.name = f"{mapped.name} ({id_name(mapped.frame_id)})"
        self.readers = [_SignalReader(one, signals.index(one.signal)) for one in mapped.signals]
        self.signals = frozenset(one.signal for one in mapped.signals)
        self.n_frames = 0
        self._wrong_lengths: Counter[int] = Counter()

    def read(
        self, columns: F64, counters: Mapping[Signal, F64], ours: I64, payload: U8, length: U8, can_id: U32
    ) -> None:
        """Decode payloads (m, width), their lengths and identifiers (m,), all of this message, into the rows ``ours``
        (m,) of ``columns`` and ``counters``. A frame too short for its counter gives no sample either.
        """
        for one in self.mapped.signals:
            if one.counter is not None:
                counters[one.signal][ours] = one.counter.bits(payload)
        self.n_frames += len(ours)
        has_length = length == self.mapped.length
        if not has_length.all():
            self._wrong_lengths.update(length[~has_length].tolist())
            payload, ours, can_id = payload[has_length], ours[has_length], can_id[has_length]
            for reader in self.readers:
                reader.rejected[Rejected.WRONG_LENGTH] += int(np.count_nonzero(~has_length))
        if len(ours):
            sources = (can_id & np.uint32(SOURCE_ADDRESS)) if self.mapped.id_filter.is_of_any_source else None
            for reader in self.readers:
                columns[ours, reader.column] = reader.read(payload, sources)

    def remarks(self) -> Iterator[Remark]:
        if lengths := dict(self._wrong_lengths):
            n, short, long = sum(lengths.values()), min(lengths), max(lengths)
            have = counted(long, "byte") if short == long else f"{short} to {long} bytes"
            text = (
                f"{told_share(n, self.n_frames)} frames have {have}, the database says {self.mapped.length}; "
                "if the device sends so, correct the length there"
            )
            yield Remark(f"{self.name}: {text}", n / self.n_frames, self.signals)
        if mixed := {one.mapped.signal: one.of_source[0] for one in self.readers if one.is_mixed()}:
            n_of_source = next(iter(mixed.values()))
            addresses = np.argsort(-n_of_source, kind="stable")[: np.count_nonzero(n_of_source)]
            each = [f"{address:#04x} ({n_of_source[address]:,.0f})" for address in addresses[:NAMED_SOURCES]]
            text = (
                f"{self.mapped.name}: {len(addresses)} devices send {', '.join(mixed)}, with the source addresses "
                f"{', '.join(each)}: state the source_address of one in the signal map, unless one has changed its own"
            )
            yield Remark(text, float(1.0 - n_of_source.max() / n_of_source.sum()), frozenset(mixed))
        for one in self.readers:
            said = f"{one.mapped.signal} ({self.mapped.name})"
            if n := one.rejected[Rejected.OUT_OF_RANGE]:
                least, most = (f"{end:.4g}" for end in one.beyond)
                ends = one.mapped.minimum, one.mapped.maximum
                low, high = ("any" if np.isnan(end) else f"{end:.4g}" for end in ends)
                read = (f"{least if least == most else f'{least} to {most}'} {one.mapped.unit}").rstrip()
                text = (
                    f"{told_share(n, self.n_frames)} values read {read}, beyond the range "
                    f"{low} to {high} {one.mapped.unit}".rstrip()
                    + "; if they are true, correct the range in the database, or set minimum and maximum "
                    "in the signal map"
                )
                yield Remark(f"{said}: {text}", n / self.n_frames, frozenset({one.mapped.signal}))
            has_names = one.mapped.named_codes and not one.mapped.rejects_j1939_codes
            if has_names and (n := one.rejected[Rejected.NOT_AVAILABLE]) > TELLING_SHARE * self.n_frames:
                text = (
                    f"{told_share(n, self.n_frames)} raw values have a name in the database, which means that they "
                    "are no measurement; if they are, remove the names there"
                )
                yield Remark(f"{said}: {text}", n / self.n_frames, frozenset({one.mapped.signal}))

    def silent(self) -> Iterator[Remark]:
        """Needed signals without a sample, unless :meth:`remarks` say why."""
        needed = NEEDED & self.signals
        if needed and not self.n_frames:
            yield Remark(f"has no frame of {self.name} for {', '.join(sorted(needed))}", 0.0, needed)
        for one in self.readers if self.n_frames else ():
            quiet = {reason: n for reason, n in one.rejected.items() if reason in _QUIET}
            if one.mapped.signal in needed and sum(quiet.values()) == self.n_frames:
                told = ", ".join(f"{n:,} {_QUIET[reason]}" for reason, n in quiet.items())
                text = f"has no sample of {one.mapped.signal}: of {self.n_frames:,} frames of {self.name}, {told}"
                yield Remark(text, 1.0, frozenset({one.mapped.signal}))


class _SignalReader:
    """Reads one mapped signal into its column, and counts what it refuses."""

    def __init__(self, mapped: MappedSignal, column: int) -> None:
        self.mapped, self.column = mapped, column
        self.rejected: Counter[Rejected] = Counter()
        self.beyond = np.inf, -np.inf  # least and greatest sample out of range
        self.of_source = np.zeros((2, SOURCE_ADDRESS + 1))  # number and sum of the samples of each J1939 device
        self._checks = tuple(_checks(mapped))

    def read(self, payload: U8, sources: U32 | None) -> F64:
        """Samples (n,) of payloads (n, width), NaN if rejected. One with several faults counts for the first of them.

        ``sources`` (n,) are the J1939 devices of the frames, if frames of any device count.
        """
        bits = self.mapped.field.bits(payload)
        with np.errstate(over="ignore", invalid="ignore"):  # what is no finite number is rejected below
            samples = self.mapped.field.physical(bits) * self.mapped.to_si
        is_rejected = np.zeros(len(bits), np.bool_)
        for reason, applies_to in self._checks:
            applies = applies_to(payload, bits, samples)
            if applies.any() and (applies := applies & ~is_rejected).any():
                is_rejected |= applies
                self.rejected[reason] += int(np.count_nonzero(applies))
                if reason is Rejected.OUT_OF_RANGE:
                    beyond = samples[applies]
                    self.beyond = min(self.beyond[0], beyond.min()), max(self.beyond[1], beyond.max())
        if is_rejected.any():
            samples[is_rejected] = np.nan
        if sources is not None:
            for source in [sources[0]] if (sources == sources[0]).all() else np.unique(sources):
                known = samples[(sources == source) & ~is_rejected]
                self.of_source[:, source] += len(known), known.sum()
        return samples

    def is_mixed(self) -> bool:
        """Whether several devices send the signal; speeds that agree are one."""
        n, sums = self.of_source[:, self.of_source[0] > 0]
        if len(n) < 2:
            return False
        means = sums / n
        is_one = QUANTITIES[self.mapped.signal] == "speed" and np.ptp(means) <= SAME_SPEED_SHARE * np.abs(means).max()
        return not is_one


Check = Callable[[U8, U64, F64], Bool]  # payloads (n, width), raw bits (n,) and samples (n,) -> rows (n,) it applies to


def _checks(mapped: MappedSignal) -> Iterator[tuple[Rejected, Check]]:
    """Each reason that can apply to a signal, in order. What cannot be, as an integer that is no number, has none."""
    for condition in mapped.multiplexed_by:
        yield Rejected.MULTIPLEXED_OUT, partial(_fails, condition)
    if mapped.rejects_j1939_codes:
        yield Rejected.NOT_AVAILABLE, lambda payload, bits, samples: is_j1939_code(mapped.field, bits)
    if mapped.named_codes:
        codes = np.array(mapped.named_codes, np.uint64)
        yield Rejected.NOT_AVAILABLE, lambda payload, bits, samples: np.isin(bits, codes)
    for condition in mapped.valid_when:
        yield Rejected.INVALID, partial(_fails, condition)
    is_float = mapped.field.coding is Coding.FLOAT
    if is_float:
        yield Rejected.NOT_A_NUMBER, lambda payload, bits, samples: ~np.isfinite(samples)
    slack = 0.0 if is_float else RANGE_TOLERANCE_STEPS * mapped.resolution
    low = -np.inf if np.isnan(mapped.minimum) else mapped.minimum - slack
    high = np.inf if np.isnan(mapped.maximum) else mapped.maximum + slack
    reach = sorted(end * mapped.to_si for end in mapped.field.physical_range)
    if reach[0] < low or reach[1] > high:
        yield Rejected.OUT_OF_RANGE, lambda payload, bits, samples: (samples < low) | (samples > high)


def _fails(condition: Condition, payload: U8, bits: U64, samples: F64) -> Bool:
    """Which frames (n,) do not meet a condition on a field of their own."""
    found = condition.field.bits(payload)
    if len(condition.allowed_bits) > MOST_COMPARED:
        return ~np.isin(found, np.array(condition.allowed_bits, np.uint64))
    fails: Bool = found != np.uint64(condition.allowed_bits[0])
    for allowed in condition.allowed_bits[1:]:
        fails &= found != np.uint64(allowed)
    return fails


def is_j1939_code(field: BitField, bits: U64) -> Bool:
    """Whether each raw value (n,) is a code of SAE J1939-71 in place of a measurement.

    From 8 bits on, a most significant byte above 0xFA is a reserved code, an error or "not available"
    (8 bits: 0xFB to 0xFF, 16 bits: 0xFB00 to 0xFFFF, ...). From 2 to 7 bits the two highest codes mean error and not
    available. A single bit has no code to spare.
    """
    if field.length >= 8:
        return np.asarray(bits >> np.uint64(field.length - 8) > J1939_LAST_VALID_BYTE)
    n_codes = 2 if field.length > 1 else 0
    return np.asarray(bits >= np.uint64((1 << field.length) - n_codes))


def told_share(n: int, n_all: int) -> str:
    """ "1,708", or "1,708 of 1,720"."""
    return f"{n:,}" if n == n_all else f"{n:,} of {n_all:,}"
