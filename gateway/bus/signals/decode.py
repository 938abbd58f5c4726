"""Frames to motion: the one decoder, for whole columns at once, used by bulk readers and the live service alike.

cantools is the reference for the bits: a property test compares every number with it.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from gateway.bus.signals.bit_field import U64, BitField, Coding
from gateway.bus.signals.mapping import (
    QUANTITIES,
    SOURCE_ADDRESS,
    Condition,
    IdFilter,
    MappedMessage,
    MappedSignal,
    SignalMap,
    id_name,
)
from gateway.records import ASIDE, F64, I64, U8, U32, Bool, Frames, Motion, Signal

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


class SampleReader:
    """Reads one mapped signal. Impossible faults (an integer that is not a number) are not checked."""

    def __init__(self, mapped: MappedSignal) -> None:
        self._mapped = mapped
        self._named_codes = np.array(mapped.named_codes, np.uint64)
        self._is_float = mapped.field.coding is Coding.FLOAT
        slack = 0.0 if self._is_float else RANGE_TOLERANCE_STEPS * mapped.resolution
        self._low = mapped.minimum - slack if np.isfinite(mapped.minimum) else -np.inf
        self._high = mapped.maximum + slack if np.isfinite(mapped.maximum) else np.inf
        reach = sorted(end * mapped.to_si for end in mapped.field.physical_range)
        self._can_leave_range = reach[0] < self._low or reach[1] > self._high
        self._beyond = np.inf, -np.inf  # least and greatest sample out of range

    @property
    def has_named_codes(self) -> bool:
        """Whether names of the database alone make a raw value no measurement."""
        return bool(self._mapped.named_codes) and not self._mapped.rejects_j1939_codes

    def told_range(self) -> str:
        """The samples out of range, and the range."""
        return told_range(self._beyond, (self._mapped.minimum, self._mapped.maximum), self._mapped.unit)

    def read(self, payload: U8) -> tuple[F64, dict[Rejected, int]]:
        """Samples (n,) of payloads (n, width), NaN if rejected, and how many for each reason.

        A sample with several faults counts for the first of them.
        """
        field = self._mapped.field
        bits = field.bits(payload)
        with np.errstate(over="ignore", invalid="ignore"):  # what is no finite number is rejected below
            samples = field.physical(bits) * self._mapped.to_si
        counts: dict[Rejected, int] = {}
        is_rejected = np.zeros(len(bits), np.bool_)
        for reason, applies in self._verdicts(payload, bits, samples):
            if applies.any():
                is_first = applies & ~is_rejected
                counts[reason] = counts.get(reason, 0) + int(np.count_nonzero(is_first))
                is_rejected |= applies
                if reason is Rejected.OUT_OF_RANGE and is_first.any():
                    beyond = samples[is_first]
                    self._beyond = min(self._beyond[0], beyond.min()), max(self._beyond[1], beyond.max())
        if counts:
            samples[is_rejected] = np.nan
        return samples, {reason: n for reason, n in counts.items() if n}

    def _verdicts(self, payload: U8, bits: U64, samples: F64) -> Iterator[tuple[Rejected, Bool]]:
        """Each reason that can apply, with the rows (n,) it applies to."""
        for condition in self._mapped.multiplexed_by:
            yield Rejected.MULTIPLEXED_OUT, _fails(condition, payload)
        if self._mapped.rejects_j1939_codes:
            yield Rejected.NOT_AVAILABLE, is_j1939_code(self._mapped.field, bits)
        if self._mapped.named_codes:
            yield Rejected.NOT_AVAILABLE, np.isin(bits, self._named_codes)
        for condition in self._mapped.valid_when:
            yield Rejected.INVALID, _fails(condition, payload)
        if self._is_float:
            yield Rejected.NOT_A_NUMBER, ~np.isfinite(samples)
        if self._can_leave_range:
            yield Rejected.OUT_OF_RANGE, (samples < self._low) | (samples > self._high)


def _fails(condition: Condition, payload: U8) -> Bool:
    bits = condition.field.bits(payload)
    if len(condition.allowed_bits) > MOST_COMPARED:
        return ~np.isin(bits, np.array(condition.allowed_bits, np.uint64))
    fails: Bool = bits != np.uint64(condition.allowed_bits[0])
    for allowed in condition.allowed_bits[1:]:
        fails &= bits != np.uint64(allowed)
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


@dataclass(frozen=True, slots=True)
class SignalCounts:
    """Outcomes of the frames that can carry one signal."""

    samples: int
    rejected: Mapping[Rejected, int]


def _rows_of_sources(can_id: U32) -> list[tuple[int, Bool | slice]]:
    """Each J1939 source address among the identifiers (n,), at least one, with its rows."""
    sources = can_id & np.uint32(SOURCE_ADDRESS)
    if (sources == sources[0]).all():
        return [(int(sources[0]), slice(None))]
    return [(int(source), sources == source) for source in np.unique(sources)]


def _is_mixed(signal: Signal, n: F64, sums: F64) -> bool:
    """Whether several devices send a signal, by the number and sum of samples of each; speeds that agree are one."""
    means = sums[n > 0] / n[n > 0]
    is_one = QUANTITIES[signal] == "speed" and len(means) and np.ptp(means) <= SAME_SPEED_SHARE * np.abs(means).max()
    return len(means) > 1 and not is_one


def told_lengths(counts: Mapping[int, int], n_frames: int, length: int) -> str:
    """ "1,708 of 1,720 frames have 8 bytes, the database says 4; ...", of the counts of every other length."""
    have = f"{min(counts)}" + (f" to {max(counts)}" if len(counts) > 1 else "")
    return (
        f"{told_share(sum(counts.values()), n_frames)} frames have {have} bytes, the database says {length}; if the "
        "device sends so, correct the length there"
    )


def told_range(read: tuple[float, float], limits: tuple[float, float], unit: str) -> str:
    """ "31 to 80 m/s, beyond the range 0 to 30 m/s; ..."; an end that is NaN is no limit."""
    least, most = (f"{end:.4g}" for end in read)
    low, high = ("any" if np.isnan(end) else f"{end:.4g}" for end in limits)
    return (
        f"{least if least == most else f'{least} to {most}'} {unit}".rstrip()
        + f", beyond the range {low} to {high} {unit}".rstrip()
        + "; if they are true, correct the range in the database, or set minimum and maximum in the signal map"
    )


def told_share(n: int, n_all: int) -> str:
    """ "1,708", or "1,708 of 1,720"."""
    return f"{n:,}" if n == n_all else f"{n:,} of {n_all:,}"


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
        self._is_aside = np.array([message.is_aside for message in self._messages])
        self._counted = tuple(s for s in self.signals if signal_map.traits[s].counter_modulus)

    @property
    def counts(self) -> dict[Signal, SignalCounts]:
        return {signal: counts for message in self._messages for signal, counts in message.counts()}

    def remarks(self) -> tuple[Remark, ...]:
        """Frames of another length than the database says, values out of range or with names, and signals of several
        devices.
        """
        return tuple(remark for message in self._messages for remark in message.remarks())

    def causes(self) -> tuple[Remark, ...]:
        """Those that explain why nothing is weighed: they concern a good part of a signal that weighing needs."""
        return tuple(one for one in self.remarks() if one.share >= TELLING_SHARE and one.signals & NEEDED)

    def silent(self) -> tuple[str, ...]:
        """Messages of which no frame came, each with the signals that weighing needs; none for other messages."""
        return tuple(text for message in self._messages if (text := message.told_silence()))

    def decode(self, frames: Frames) -> Motion:
        """One row for every frame of a mapped message, in order of arrival; other frames are passed over.

        All signals of a frame share its row. NaN if a frame does not validly carry a sample.
        """
        message_of = np.full(len(frames), -1, np.int16)
        for i, message in enumerate(self._messages):
            message_of[message.id_filter.matches(frames.can_id)] = i
        rows = np.flatnonzero(message_of >= 0)
        message_of = message_of[rows]
        columns = np.full((len(rows), len(self.signals)), np.nan)
        counters = {signal: np.full(len(rows), np.nan) for signal in self._counted}
        for i, message in enumerate(self._messages):
            ours = np.flatnonzero(message_of == i)
            if len(ours):
                payload = frames.payload.take(rows[ours], axis=0)
                message.count(counters, ours, payload)
                message.fill(columns, ours, payload, frames.length[rows[ours]], frames.can_id[rows[ours]])
        aside = self._is_aside[message_of] if self._is_aside.any() else None
        return Motion(self.signals, frames.t_ns[rows], columns, counters, aside)


class _MessageReader:
    """Reads the mapped signals of one message, and counts."""

    def __init__(self, message: MappedMessage, signals: tuple[Signal, ...]) -> None:
        self.id_filter: IdFilter = message.id_filter
        self.is_aside = all(m.signal in ASIDE for m in message.signals)
        self._name = message.name
        self._frame_id = message.frame_id
        self._length = message.length
        self._wrong_lengths: Counter[int] = Counter()
        self._readers = [(m.signal, signals.index(m.signal), SampleReader(m)) for m in message.signals]
        counters = [(m.counter, m.signal) for m in message.signals if m.counter is not None]
        self._counters = {field: [signal for of, signal in counters if of == field] for field, _ in counters}
        self._n_frames = 0
        sent = [m.signal for m in message.signals] if message.id_filter.is_of_any_source else []
        self._of_source = {signal: np.zeros((2, SOURCE_ADDRESS + 1)) for signal in sent}  # number and sum of samples
        self._rejected: dict[Signal, Counter[Rejected]] = {m.signal: Counter() for m in message.signals}

    def counts(self) -> list[tuple[Signal, SignalCounts]]:
        rejected = self._rejected.items()
        return [(signal, SignalCounts(self._n_frames - n.total(), dict(n))) for signal, n in rejected]

    def told_silence(self) -> str | None:
        """Its name and the needed signals, if no frame of it came."""
        needed = sorted(NEEDED.intersection(self._rejected))
        return (
            None
            if self._n_frames or not needed
            else f"{self._name} ({id_name(self._frame_id)}) for {', '.join(needed)}"
        )

    def remarks(self) -> Iterator[Remark]:
        """Those of this message."""
        if lengths := dict(self._wrong_lengths):
            text = f"{self._name} ({id_name(self._frame_id)}): {told_lengths(lengths, self._n_frames, self._length)}"
            yield Remark(text, sum(lengths.values()) / self._n_frames, frozenset(self._rejected))
        mixed = {signal: n_and_sum[0] for signal, n_and_sum in self._of_source.items() if _is_mixed(signal, *n_and_sum)}
        if mixed:
            n_of_source = next(iter(mixed.values()))
            addresses = np.argsort(-n_of_source, kind="stable")[: np.count_nonzero(n_of_source)]
            each = [f"{address:#04x} ({n_of_source[address]:,.0f})" for address in addresses[:NAMED_SOURCES]]
            text = (
                f"{self._name}: {len(addresses)} devices send {', '.join(mixed)}, with the source addresses "
                f"{', '.join(each)}: state the source_address of one in the signal map"
            )
            yield Remark(text, float(1.0 - n_of_source.max() / n_of_source.sum()), frozenset(mixed))
        for signal, _, reader in self._readers:
            if n := self._rejected[signal][Rejected.OUT_OF_RANGE]:
                text = f"{signal} ({self._name}): {told_share(n, self._n_frames)} values read {reader.told_range()}"
                yield Remark(text, n / self._n_frames, frozenset({signal}))
            n = self._rejected[signal][Rejected.NOT_AVAILABLE] if reader.has_named_codes else 0
            if n > TELLING_SHARE * self._n_frames:
                text = (
                    f"{signal} ({self._name}): {told_share(n, self._n_frames)} raw values have a name in the database, "
                    "which means that they are no measurement; if they are, remove the names there"
                )
                yield Remark(text, n / self._n_frames, frozenset({signal}))

    def fill(self, columns: F64, ours: I64, payload: U8, length: U8, can_id: U32) -> None:
        """Decode payloads (m, width), their lengths and identifiers (m,), all of this message, into the rows ``ours``
        (m,) of ``columns``.
        """
        self._n_frames += len(ours)
        has_length = length == self._length
        n_wrong = len(ours) - int(np.count_nonzero(has_length))
        if n_wrong:
            of_length = np.bincount(length[~has_length])
            self._wrong_lengths.update({int(n_bytes): int(of_length[n_bytes]) for n_bytes in of_length.nonzero()[0]})
            payload, ours, can_id = payload[has_length], ours[has_length], can_id[has_length]
            for rejected in self._rejected.values():
                rejected[Rejected.WRONG_LENGTH] += n_wrong
        if not len(ours):
            return
        by_source = _rows_of_sources(can_id) if self._of_source else []
        for signal, column, reader in self._readers:
            samples, refused = reader.read(payload)
            columns[ours, column] = samples
            self._rejected[signal].update(refused)
            for source, rows in by_source:
                known = samples[rows][np.isfinite(samples[rows])] if refused else samples[rows]
                self._of_source[signal][:, source] += len(known), known.sum()

    def count(self, counters: Mapping[Signal, F64], ours: I64, payload: U8) -> None:
        """Message counters of the same frames into the same rows; a frame too short for its counter gives no sample
        either.
        """
        for field, signals in self._counters.items():
            bits = field.bits(payload)
            for signal in signals:
                counters[signal][ours] = bits
