"""The position of a signal in a payload, and the conversion of its bits to a number and back: whole columns at once."""

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gateway.records import F64, U8

U64 = NDArray[np.uint64]

_FLOATS = {16: (np.uint16, np.float16), 32: (np.uint32, np.float32), 64: (np.uint64, np.float64)}


class Coding(StrEnum):
    """Encodings of a number as raw bits."""

    UNSIGNED = "unsigned"
    SIGNED = "signed"
    FLOAT = "float"


@dataclass(frozen=True)
class BitField:
    """A signal's place in the payload and its linear conversion, as a DBC states them.

    ``start`` counts as in a DBC: bit 0 is the least significant bit of byte 0. For little-endian
    (Intel, @1) it is the signal's least significant bit, for big-endian (Motorola, @0) its most
    significant one. ``length`` is 1 to 64 bits; floats have 16, 32 or 64.
    """

    start: int
    length: int
    is_big_endian: bool = False
    coding: Coding = Coding.UNSIGNED
    scale: float = 1.0
    offset: float = 0.0

    @cached_property
    def bytes_and_shifts(self) -> tuple[tuple[int, int], ...]:
        """Every byte of the field and its left shift in the raw number (negative: right)."""
        if self.is_big_endian:
            first_bit = self.start // 8 * 8 + 7 - self.start % 8
            end_bit = first_bit + self.length
            return tuple((byte, end_bit - 8 - 8 * byte) for byte in range(first_bit // 8, (end_bit + 7) // 8))
        last_byte = (self.start + self.length - 1) // 8
        return tuple((byte, 8 * byte - self.start) for byte in range(self.start // 8, last_byte + 1))

    @property
    def n_bytes(self) -> int:
        """Bytes that a payload needs to contain the field."""
        return self.bytes_and_shifts[-1][0] + 1

    @property
    def raw_range(self) -> tuple[int, int]:
        """Smallest and largest raw integer the bits can carry."""
        if self.coding is Coding.SIGNED:
            return -(1 << self.length - 1), (1 << self.length - 1) - 1
        return 0, (1 << self.length) - 1

    def bits(self, payload: U8) -> U64:
        """The field's bits of every row, unsigned. payload (n, width) -> (n,)."""
        raw = np.zeros(len(payload), np.uint64)
        for byte, shift in self.bytes_and_shifts:
            column = payload[:, byte].astype(np.uint64)
            raw |= column << np.uint64(shift) if shift >= 0 else column >> np.uint64(-shift)
        return raw & np.uint64((1 << self.length) - 1)

    def put(self, payload: U8, bits: U64) -> None:
        """Write raw bits (n,) into payload rows (n, width), in place."""
        n_ones = (1 << self.length) - 1
        for byte, shift in self.bytes_and_shifts:
            kept = np.uint8(~(n_ones >> shift if shift >= 0 else n_ones << -shift) & 0xFF)
            moved = bits >> np.uint64(shift) if shift >= 0 else bits << np.uint64(-shift)
            payload[:, byte] = (payload[:, byte] & kept) | moved.astype(np.uint8) & ~kept

    def numbers(self, bits: U64) -> F64:
        """Bits (n,) as numbers, before scale and offset."""
        if self.coding is Coding.FLOAT:
            as_integer, as_float = _FLOATS[self.length]
            with np.errstate(invalid="ignore"):  # a signalling NaN is a NaN all the same
                return bits.astype(as_integer).view(as_float).astype(np.float64)
        if self.coding is Coding.SIGNED:
            sign_bit = np.uint64(1 << self.length - 1)
            return ((bits ^ sign_bit) - sign_bit).view(np.int64).astype(np.float64)
        return bits.astype(np.float64)

    def physical(self, bits: U64) -> F64:
        """Bits (n,) in the unit of the DBC: number x scale + offset, in that order, as cantools does it."""
        with np.errstate(over="ignore", invalid="ignore"):  # floats beyond a double become inf or NaN, as in cantools
            return self.numbers(bits) * self.scale + self.offset

    def bits_of(self, physical: F64) -> U64:
        """Raw bits (n,) closest to ``physical`` (n,), in the unit of the DBC."""
        numbers = (np.asarray(physical, np.float64) - self.offset) / self.scale
        if self.coding is Coding.FLOAT:
            as_integer, as_float = _FLOATS[self.length]
            return numbers.astype(as_float).view(as_integer).astype(np.uint64)
        low, high = self.raw_range
        greatest = np.floor(np.nextafter(high + 1.0, 0.0))  # the greatest double that the bits can carry
        steps = np.clip(np.rint(numbers), low, greatest)
        raw = steps.astype(np.int64).view(np.uint64) if self.coding is Coding.SIGNED else steps.astype(np.uint64)
        return raw & np.uint64((1 << self.length) - 1)

    @property
    def physical_range(self) -> tuple[float, float]:
        """Smallest and largest physical number the bits can carry; infinite for floats, and for more bits than any."""
        if self.coding is Coding.FLOAT or self.length > 64:
            return -np.inf, np.inf
        ends = [raw * self.scale + self.offset for raw in self.raw_range]
        return min(ends), max(ends)
