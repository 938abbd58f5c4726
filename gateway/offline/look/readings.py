"""Signals of the frames by their databases: every signal with a known unit, in SI."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np

from gateway.bus.frames import take
from gateway.bus.heard import Heard
from gateway.bus.signals import Coding, DatabaseMessage, DatabaseSignal, is_j1939_code, j1939_filter, load_messages
from gateway.errors import SignalMapError
from gateway.records import EXTENDED_ID, F64
from gateway.units import NS_PER_S, TO_SI

QUANTITIES: Final = ("acceleration", "angular_rate", "speed", "angle", "distance")


@dataclass(frozen=True, slots=True)
class Described:
    """An identifier and its message by a database; ``by_group`` if only the J1939 group is the same."""

    heard: Heard
    message: DatabaseMessage
    by_group: bool

    @property
    def has_length(self) -> bool:
        """Whether frames have the length in the database."""
        return self.message.length in self.heard.lengths


@dataclass(frozen=True)
class SignalReading:
    """One signal of one identifier: times (n,) from the log's origin and valid samples (n,) in SI."""

    described: Described
    signal: DatabaseSignal
    quantity: str
    t_s: F64
    x: F64

    @property
    def name(self) -> str:
        """MESSAGE.SIGNAL."""
        return f"{self.described.message.name}.{self.signal.name}"

    @property
    def rate_hz(self) -> float:
        return self.described.heard.rate_hz

    @cached_property
    def usual(self) -> float:
        """The median, SI; NaN without a sample."""
        return float(np.median(self.x)) if len(self.x) else float("nan")


def databases_of(paths: Sequence[Path]) -> tuple[tuple[DatabaseMessage, ...], tuple[str, ...]]:
    """Every message of the databases, and the faults of unreadable ones."""
    messages: list[DatabaseMessage] = []
    faults: list[str] = []
    for path in paths:
        try:
            messages += load_messages(path, [path]).values()
        except SignalMapError as fault:
            faults.append(str(fault))
    return tuple(messages), tuple(faults)


def described(heard: Sequence[Heard], messages: Sequence[DatabaseMessage]) -> tuple[Described, ...]:
    """The identifiers with a message: first a message of their length, then the first of all."""
    found = []
    for one in heard:
        same = [Described(one, message, False) for message in messages if message.frame_id == one.can_id]
        same += [Described(one, message, True) for message in messages if _is_same_group(message, one)]
        if same:
            found.append(min(same, key=lambda each: (not each.has_length, each.by_group)))
    return tuple(found)


def _is_same_group(message: DatabaseMessage, heard: Heard) -> bool:
    if not message.frame_id & heard.can_id & EXTENDED_ID:
        return False
    group = j1939_filter(message.frame_id)
    return heard.can_id & group.mask == group.can_id


def readings_of(found: Described, origin_ns: int) -> Iterator[SignalReading]:
    """The signals with a known unit, from frames of the right length."""
    frames = found.heard.frames
    frames = take(frames, frames.length == found.message.length)
    t_s = (frames.t_ns - origin_ns) / NS_PER_S
    for signal in found.message.signals.values():
        quantity = _quantity(signal)
        if quantity is None or signal.multiplexer is not None or signal.field.n_bytes > found.message.length:
            continue
        bits = signal.field.bits(frames.payload)
        x = signal.field.physical(bits) * TO_SI[quantity][_unit(signal)]
        is_valid = np.isfinite(x)
        if found.by_group and signal.field.coding is Coding.UNSIGNED:
            is_valid &= ~is_j1939_code(signal.field, bits)
        yield SignalReading(found, signal, quantity, t_s[is_valid], x[is_valid])


def _quantity(signal: DatabaseSignal) -> str | None:
    return next((quantity for quantity in QUANTITIES if _unit(signal) in TO_SI[quantity]), None)


def _unit(signal: DatabaseSignal) -> str:
    return (signal.unit or "").strip().lower()
