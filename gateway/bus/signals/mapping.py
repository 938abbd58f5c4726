"""A resolved signal map: which frames carry our signals, the position of their bits, the conditions of their
validity.
"""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Final
from zoneinfo import ZoneInfo

import numpy as np

from gateway.bus.signals.bit_field import BitField, Coding
from gateway.records import EXTENDED_ID, U32, Bool, SensorTraits, Signal
from gateway.units import TO_SI

QUANTITIES: Final[Mapping[Signal, str]] = {
    Signal.VERTICAL_ACCELERATION: "acceleration",
    Signal.PITCH_RATE: "angular_rate",
    Signal.SPEED: "speed",
    Signal.ROLL_RATE: "angular_rate",
    Signal.LONGITUDINAL_ACCELERATION: "acceleration",
    Signal.LATERAL_ACCELERATION: "acceleration",
    Signal.YAW_RATE: "angular_rate",
    Signal.WHEEL_SPEED: "speed",
    Signal.IGNITION: "state",
    Signal.AMBIENT_TEMPERATURE: "temperature",
    Signal.AXLE_WEIGHT: "mass",
    Signal.LATITUDE: "angle",
    Signal.LONGITUDE: "angle",
    Signal.ODOMETER: "distance",
    Signal.DOOR: "state",
    Signal.AIR_SPRING_PRESSURE: "pressure",
    Signal.RIDE_HEIGHT: "distance",
    Signal.TRAILER: "state",
}

CLASSIC_BYTES = 8  # ISO 11898-1, the longest payload
CAN_FD_BYTES = 64  # likewise of CAN FD


@dataclass(frozen=True, slots=True)
class IdFilter:
    """Frames with ``can_id & mask`` equal to ours, as SocketCAN filters them.

    Both numbers contain EXTENDED_ID, so that a 29-bit identifier never equals an 11-bit one.
    """

    can_id: int
    mask: int

    def matches(self, can_id: U32) -> Bool:
        passes: Bool = (can_id & np.uint32(self.mask)) == np.uint32(self.can_id)
        return passes

    @property
    def is_of_any_source(self) -> bool:
        """Whether frames of a J1939 group count whichever device sends them."""
        return not self.mask & SOURCE_ADDRESS and bool(self.can_id & EXTENDED_ID)

    def is_for(self, can_id: int) -> bool:
        """Whether a frame with this identifier counts."""
        return can_id & self.mask == self.can_id


SOURCE_ADDRESS: Final = 0xFF  # SAE J1939-21: the last byte of a 29-bit identifier
EVERY_IDENTIFIER = (IdFilter(0, EXTENDED_ID), IdFilter(EXTENDED_ID, EXTENDED_ID))


@dataclass(frozen=True, slots=True)
class Condition:
    """A field of the same message and its required raw bits: a multiplexer, or one entry of valid_when."""

    field: BitField
    allowed_bits: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class MappedSignal:
    """One of our signals: SI = (number x scale + offset) x to_si; the factor carries unit and sign.

    ``minimum`` and ``maximum`` are SI, NaN if there is no limit. ``rejects_j1939_codes`` is true if SAE J1939-71
    reserves the highest raw numbers for "error" and "not available"; ``named_codes`` are raw bits that the database
    gives a name. ``counter`` counts the frames.
    """

    signal: Signal
    dbc_signal: str
    field: BitField
    to_si: float
    minimum: float
    maximum: float
    latency_s: float
    multiplexed_by: tuple[Condition, ...]
    valid_when: tuple[Condition, ...]
    rejects_j1939_codes: bool
    named_codes: tuple[int, ...] = ()
    counter: BitField | None = None

    @property
    def resolution(self) -> float:
        """The least step, in SI; NaN for a float."""
        return math.nan if self.field.coding is Coding.FLOAT else abs(self.field.scale * self.to_si)

    @property
    def unit(self) -> str:
        """The SI unit of its samples; empty for a state."""
        return next(iter(TO_SI[QUANTITIES[self.signal]]))

    @property
    def traits(self) -> SensorTraits:
        """What the other rooms need to know about it."""
        modulus = 0 if self.counter is None else 1 << self.counter.length
        return SensorTraits(self.latency_s, self.minimum, self.maximum, self.resolution, modulus)


@dataclass(frozen=True, slots=True)
class MappedMessage:
    """A message that carries at least one of our signals; its frames have exactly ``length`` bytes.

    ``frame_id`` is the database's own, with EXTENDED_ID. ``fields`` are all its signals by their DBC names.
    """

    name: str
    frame_id: int
    id_filter: IdFilter
    length: int
    signals: tuple[MappedSignal, ...]
    fields: Mapping[str, BitField]


@dataclass(frozen=True)
class SignalMap:
    """A signal map and its databases, resolved.

    ``channel`` filters log files (a live channel comes from the service's configuration); None accepts every channel.
    ``zone`` holds for dates of logs that state none; None: UTC.
    """

    name: str
    channel: str | None
    j1939: bool
    messages: tuple[MappedMessage, ...]
    zone: ZoneInfo | None = None

    @cached_property
    def signals(self) -> tuple[Signal, ...]:
        """The mapped signals in the order of Signal: the columns of Motion."""
        mapped = {m.signal for message in self.messages for m in message.signals}
        return tuple(signal for signal in Signal if signal in mapped)

    def message_of(self, signal: Signal) -> MappedMessage:
        return next(m for m in self.messages if any(mapped.signal is signal for mapped in m.signals))

    @cached_property
    def traits(self) -> Mapping[Signal, SensorTraits]:
        """Latency, valid range and resolution of every mapped signal."""
        return MappingProxyType({m.signal: m.traits for message in self.messages for m in message.signals})

    @cached_property
    def id(self) -> str:
        """Hash of all that decides how our signals are read."""
        read = repr((self.j1939, [(message.id_filter, message.signals) for message in self.messages]))
        return hashlib.sha256(read.encode()).hexdigest()[:16]

    @cached_property
    def filters(self) -> tuple[IdFilter, ...]:
        """The identifiers to request from the kernel."""
        return tuple(message.id_filter for message in self.messages)

    @property
    def payload_width(self) -> int:
        """Bytes of a frame's row: 8, or 64 if a mapped message needs CAN FD."""
        longest = max((message.length for message in self.messages), default=0)
        return CLASSIC_BYTES if longest <= CLASSIC_BYTES else CAN_FD_BYTES


def id_name(can_id: int) -> str:
    """An identifier as candump writes it: three digits, or eight if it has 29 bits."""
    number = can_id & ~EXTENDED_ID
    return f"{number:08X}" if can_id & EXTENDED_ID else f"{number:03X}"


def exact_filter(frame_id: int) -> IdFilter:
    """This identifier (EXTENDED_ID set for 29 bits) and no other."""
    return IdFilter(frame_id, EXTENDED_ID | (0x1FFF_FFFF if frame_id & EXTENDED_ID else 0x7FF))


def j1939_filter(frame_id: int, source_address: int | None = None) -> IdFilter:
    """The parameter group of a 29-bit identifier, whatever its priority, from one source address or from any.

    SAE J1939-21: bits 8 to 25 are the group; with a PDU format (bits 16 to 23) below 240, bits 8 to 15
    are a destination address and belong to no group.
    """
    is_addressed = (frame_id >> 16 & 0xFF) < 240
    group_mask = 0x03FF_0000 if is_addressed else 0x03FF_FF00
    if source_address is None:
        return IdFilter(frame_id & group_mask | EXTENDED_ID, group_mask | EXTENDED_ID)
    return IdFilter(frame_id & group_mask | source_address | EXTENDED_ID, group_mask | SOURCE_ADDRESS | EXTENDED_ID)
