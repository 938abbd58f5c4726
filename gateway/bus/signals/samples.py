"""One signal from the payloads of its message: SI samples, and why the others are rejected."""

from collections.abc import Iterator
from enum import StrEnum
from typing import Final

import numpy as np

from gateway.bus.signals.bit_field import U64, BitField, Coding
from gateway.bus.signals.mapping import Condition, MappedSignal
from gateway.records import F64, U8, Bool

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


class SampleReader:
    """Reads one mapped signal. Impossible faults (an integer that is not a number) are not checked."""

    def __init__(self, mapped: MappedSignal) -> None:
        self._mapped = mapped
        self._is_float = mapped.field.coding is Coding.FLOAT
        slack = 0.0 if self._is_float else RANGE_TOLERANCE_STEPS * mapped.resolution
        self._low = mapped.minimum - slack if np.isfinite(mapped.minimum) else -np.inf
        self._high = mapped.maximum + slack if np.isfinite(mapped.maximum) else np.inf
        reach = sorted(end * mapped.to_si for end in mapped.field.physical_range)
        self._can_leave_range = reach[0] < self._low or reach[1] > self._high

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
                counts[reason] = counts.get(reason, 0) + int(np.count_nonzero(applies & ~is_rejected))
                is_rejected |= applies
        if counts:
            samples[is_rejected] = np.nan
        return samples, {reason: n for reason, n in counts.items() if n}

    def _verdicts(self, payload: U8, bits: U64, samples: F64) -> Iterator[tuple[Rejected, Bool]]:
        """Each reason that can apply, with the rows (n,) it applies to."""
        for condition in self._mapped.multiplexed_by:
            yield Rejected.MULTIPLEXED_OUT, _fails(condition, payload)
        if self._mapped.rejects_j1939_codes:
            yield Rejected.NOT_AVAILABLE, is_j1939_code(self._mapped.field, bits)
        for condition in self._mapped.valid_when:
            yield Rejected.INVALID, _fails(condition, payload)
        if self._is_float:
            yield Rejected.NOT_A_NUMBER, ~np.isfinite(samples)
        if self._can_leave_range:
            yield Rejected.OUT_OF_RANGE, (samples < self._low) | (samples > self._high)


def _fails(condition: Condition, payload: U8) -> Bool:
    bits = condition.field.bits(payload)
    fails: Bool = bits != np.uint64(condition.allowed_bits[0])
    for allowed in condition.allowed_bits[1:]:
        fails &= bits != np.uint64(allowed)
    return fails


def is_j1939_code(field: BitField, bits: U64) -> Bool:
    """Which raw bits (n,) are no measurement by SAE J1939-71.

    From 8 bits on, a most significant byte above 0xFA is a reserved code, an error or "not available"
    (8 bits: 0xFB to 0xFF, 16 bits: 0xFB00 to 0xFFFF, ...). From 2 to 7 bits the two highest codes mean error and not
    available. A single bit has no code to spare.
    """
    if field.length >= 8:
        return np.asarray(bits >> np.uint64(field.length - 8) > J1939_LAST_VALID_BYTE)
    n_codes = 2 if field.length > 1 else 0
    return np.asarray(bits >= np.uint64((1 << field.length) - n_codes))
