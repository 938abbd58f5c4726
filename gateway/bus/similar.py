"""Identifiers on a bus that resemble a missing one: the device may be set to another number, or to 29 bits."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from gateway.bus.heard import Heard
from gateway.bus.signals import MappedMessage, SignalMap
from gateway.records import EXTENDED_ID

NEAR: Final = 0x20  # devices that are set to other identifiers mostly keep them together
MOST_SIMILAR: Final = 3


def similar_to(message: MappedMessage, signal_map: SignalMap, heard: Sequence[Heard]) -> tuple[str, ...]:
    """In words: identifiers without a mapping, the most similar first."""
    return tuple(_told(one) for one in _similar(message, signal_map, heard))


def _told(one: Heard) -> str:
    on = f" on {one.channel}" if one.channel else ""
    return f"{one.name}{on}, {one.rate_hz:.0f} times a second, {one.lengths[0]} bytes"


def _similar(message: MappedMessage, signal_map: SignalMap, heard: Sequence[Heard]) -> Iterator[Heard]:
    """Identifiers without a mapping, the most similar first: another source, the other width, or a near number."""
    mapped = [m.id_filter for m in signal_map.messages]
    free = [
        one for one in heard
        if not any(ids.matches(np.array([one.can_id], np.uint32))[0] for ids in mapped)
        or message.id_filter.matches(np.array([one.can_id], np.uint32))[0]
    ]  # fmt: skip
    ranked = sorted((_distance(message, one), one.can_id, i) for i, one in enumerate(free))
    for distance, _, i in ranked[:MOST_SIMILAR]:
        if distance[0] <= NEAR:
            yield free[i]


def _distance(message: MappedMessage, one: Heard) -> tuple[int, bool]:
    """Distance of the numbers, 29 bits or 11, source addresses aside; then whether the length differs."""
    ours, theirs = message.frame_id & ~EXTENDED_ID, one.can_id & ~EXTENDED_ID
    is_both_long = bool(message.frame_id & one.can_id & EXTENDED_ID)
    apart = abs(ours - theirs)
    if is_both_long:
        apart = min(apart, abs((ours >> 8 & 0x3FFFF) - (theirs >> 8 & 0x3FFFF)))
    return apart, message.length not in one.lengths
