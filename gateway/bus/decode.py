"""Frames to motion: the one decoder, for whole columns at once, used by bulk readers and the live service alike.

cantools is the truth for the bits: a property test holds every number to it.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from gateway.bus.bit_field import U64, BitField
from gateway.bus.mapping import Condition, MappedMessage, MappedSignal, SignalMap
from gateway.records import F64, U8, Bool, Frames, Motion, Signal

J1939_LAST_VALID_BYTE: Final = 0xFA  # SAE J1939-71: a most significant byte above this is no measurement
RANGE_TOLERANCE_STEPS: Final = 0.01  # the limits of a DBC are decimals; a raw number on a limit must pass


class Rejected(StrEnum):
    """Why a frame of a mapped message gave no sample of a signal."""

    WRONG_LENGTH = "wrong_length"
    MULTIPLEXED_OUT = "multiplexed_out"
    NOT_AVAILABLE = "not_available"
    INVALID = "invalid"
    NOT_A_NUMBER = "not_a_number"
    OUT_OF_RANGE = "out_of_range"


@dataclass(frozen=True, slots=True)
class SignalCounts:
    """What became of the frames that could carry one signal."""

    samples: int
    rejected: Mapping[Rejected, int]


class Decoder:
    """Turns frames into motion by one signal map. The counts are its only memory: chunking leaves no trace."""

    def __init__(self, signal_map: SignalMap) -> None:
        self.signals = signal_map.signals
        self._messages = signal_map.messages
        self._samples: Counter[Signal] = Counter()
        self._rejected: dict[Signal, Counter[Rejected]] = {signal: Counter() for signal in self.signals}

    @property
    def counts(self) -> dict[Signal, SignalCounts]:
        """Samples and rejections of every mapped signal so far."""
        return {s: SignalCounts(self._samples[s], dict(self._rejected[s])) for s in self.signals}

    def decode(self, frames: Frames) -> Motion:
        """One row for every frame of a mapped message, in order of arrival; other frames are passed over.

        All signals of a frame share its row. What a frame does not validly carry is NaN.
        """
        message_of = np.full(len(frames), -1, np.int16)
        for i, message in enumerate(self._messages):
            message_of[message.id_filter.matches(frames.can_id)] = i
        rows = np.flatnonzero(message_of >= 0)
        message_of = message_of[rows]
        columns = np.full((len(rows), len(self.signals)), np.nan)
        for i, message in enumerate(self._messages):
            ours = np.flatnonzero(message_of == i)
            if len(ours):
                self._fill(columns, ours, rows[ours], message, frames)
        return Motion(self.signals, frames.t_ns[rows], columns)

    def _fill(self, columns: F64, ours: np.ndarray, rows: np.ndarray, message: MappedMessage, frames: Frames) -> None:
        """Decode the frames ``rows`` of one message into the rows ``ours`` of the result."""
        has_length = frames.length[rows] == message.length
        n_wrong = len(rows) - int(np.count_nonzero(has_length))
        payload = frames.payload[rows[has_length]]
        for mapped in message.signals:
            rejected = Counter({Rejected.WRONG_LENGTH: n_wrong})
            if len(payload):
                samples, refused = _samples(mapped, payload)
                columns[ours[has_length], self.signals.index(mapped.signal)] = samples
                rejected += refused
            self._samples[mapped.signal] += len(rows) - rejected.total()
            self._rejected[mapped.signal].update(+rejected)


def _samples(mapped: MappedSignal, payload: U8) -> tuple[F64, Counter[Rejected]]:
    """SI samples (n,) of payloads (n, width), NaN where rejected, and how often for each reason."""
    bits = mapped.field.bits(payload)
    with np.errstate(over="ignore", invalid="ignore"):  # what is no finite number is rejected below
        samples = mapped.field.physical(bits) * mapped.to_si
    slack = RANGE_TOLERANCE_STEPS * mapped.resolution if np.isfinite(mapped.resolution) else 0.0
    verdicts = (
        (Rejected.MULTIPLEXED_OUT, ~_all_hold(mapped.multiplexed_by, payload)),
        (Rejected.NOT_AVAILABLE, mapped.rejects_j1939_codes and is_j1939_code(mapped.field, bits)),
        (Rejected.INVALID, ~_all_hold(mapped.valid_when, payload)),
        (Rejected.NOT_A_NUMBER, ~np.isfinite(samples)),
        (Rejected.OUT_OF_RANGE, (samples < mapped.minimum - slack) | (samples > mapped.maximum + slack)),
    )
    counts: Counter[Rejected] = Counter()
    keep = np.ones(len(bits), np.bool_)
    for reason, applies in verdicts:
        counts[reason] = int(np.count_nonzero(keep & applies))
        keep &= ~np.asarray(applies)
    return np.where(keep, samples, np.nan), counts


def _all_hold(conditions: tuple[Condition, ...], payload: U8) -> Bool:
    holds = np.ones(len(payload), np.bool_)
    for condition in conditions:
        holds &= np.isin(condition.field.bits(payload), np.array(condition.allowed_bits, np.uint64))
    return holds


def is_j1939_code(field: BitField, bits: U64) -> Bool:
    """Which raw bits (n,) are no measurement by SAE J1939-71.

    From 8 bits on, a most significant byte above 0xFA is a reserved code, an error or "not available"
    (8 bits: 0xFB to 0xFF, 16 bits: 0xFB00 to 0xFFFF, ...). From 2 to 7 bits the two highest codes mean
    error and not available. A single bit has no code to spare.
    """
    if field.length >= 8:
        return np.asarray(bits >> np.uint64(field.length - 8) > J1939_LAST_VALID_BYTE)
    n_codes = 2 if field.length > 1 else 0
    return np.asarray(bits >= np.uint64((1 << field.length) - n_codes))
