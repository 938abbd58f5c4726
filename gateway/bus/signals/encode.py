"""Samples to frames, whole columns at once: the decoder's mirror, for the simulator."""

from collections.abc import Mapping

import numpy as np

from gateway.bus.signals.bit_field import U64, BitField, Coding
from gateway.bus.signals.mapping import MappedMessage, SignalMap
from gateway.records import F64, I64, U8, Frames

J1939_UNUSED = 0xFF  # SAE J1939: unused bits are 1, "not available"


class Encoder:
    """Writes the messages of a signal map.

    A sample is rounded to the nearest step and limited to the range of the bits, as a sensor saturates.
    """

    def __init__(self, signal_map: SignalMap) -> None:
        self._map = signal_map
        self._messages = {message.name: message for message in signal_map.messages}

    def encode(self, message: str, t_ns: I64, samples: Mapping[str, F64]) -> Frames:
        """Frames of one message at the times (n,); ``samples`` (n,) by DBC signal name, in units of the DBC.

        Missing signals are 0 in the DBC's unit (all bits set if the map is J1939). Multiplexers and
        the signals of ``valid_when`` take the value under which the mapped signals count, unless given.
        Raises KeyError for a message or signal that the map does not contain.
        """
        mapped = self._messages[message]
        payload = self._blank(mapped, len(t_ns))
        for field, bits in _conditions(mapped).items():
            put_bits(payload, field, np.full(len(t_ns), bits, np.uint64))
        for name, physical in samples.items():
            field = mapped.fields[name]
            put_bits(payload, field, physical_bits(field, physical))
        can_id = np.full(len(t_ns), mapped.frame_id, np.uint32)
        return Frames(t_ns, can_id, np.full(len(t_ns), mapped.length, np.uint8), payload)

    def _blank(self, message: MappedMessage, n: int) -> U8:
        """Payload rows (n, width) before any sample is put in."""
        payload = np.zeros((n, self._map.payload_width), np.uint8)
        if self._map.j1939:
            payload[:, : message.length] = J1939_UNUSED
            return payload
        for field in message.fields.values():
            put_bits(payload, field, physical_bits(field, np.zeros(n)))
        return payload


def _conditions(message: MappedMessage) -> dict[BitField, int]:
    """Raw bits under which the message's mapped signals count."""
    every = [c for mapped in message.signals for c in (*mapped.multiplexed_by, *mapped.valid_when)]
    return {condition.field: condition.allowed_bits[0] for condition in every}


def physical_bits(field: BitField, physical: F64) -> U64:
    """Raw bits (n,) closest to ``physical`` (n,), in the unit of the DBC."""
    numbers = (np.asarray(physical, np.float64) - field.offset) / field.scale
    if field.coding is Coding.FLOAT:
        as_float = {16: np.float16, 32: np.float32, 64: np.float64}[field.length]
        return numbers.astype(as_float).view(f"u{field.length // 8}").astype(np.uint64)
    low, high = field.raw_range
    greatest = np.floor(np.nextafter(high + 1.0, 0.0))  # the greatest double that the bits can carry
    steps = np.clip(np.rint(numbers), low, greatest)
    raw = steps.astype(np.int64).view(np.uint64) if field.coding is Coding.SIGNED else steps.astype(np.uint64)
    return raw & np.uint64((1 << field.length) - 1)


def put_bits(payload: U8, field: BitField, bits: U64) -> None:
    """Write a field's raw bits (n,) into payload rows (n, width), in place."""
    n_ones = (1 << field.length) - 1
    for byte, shift in field.bytes_and_shifts:
        kept = np.uint8(~(n_ones >> shift if shift >= 0 else n_ones << -shift) & 0xFF)
        moved = bits >> np.uint64(shift) if shift >= 0 else bits << np.uint64(-shift)
        payload[:, byte] = (payload[:, byte] & kept) | moved.astype(np.uint8) & ~kept
