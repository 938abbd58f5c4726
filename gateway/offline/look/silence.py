"""Why a mapped signal has no valid sample in a log: no frames, and what there is instead, or frames refused."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from gateway.bus.logs import motion_of_log
from gateway.bus.signals import MappedMessage, SignalMap, id_name
from gateway.offline.look.heard import Heard, heard_in
from gateway.records import EXTENDED_ID, Signal

NEAR: Final = 0x20  # devices that are set to other identifiers mostly keep them together
MOST_SIMILAR: Final = 3


def why_silent(log: Path, signal_map: SignalMap, signal: Signal) -> str:
    """In words. Reads the log once or twice more; raises LogUnreadableError as every reader does."""
    message = next(m for m in signal_map.messages if any(mapped.signal is signal for mapped in m.signals))
    motions, _, decoder = motion_of_log(log, signal_map)
    for _ in motions:
        pass
    refused = decoder.counts[signal].rejected
    if n := sum(refused.values()):
        reasons = ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in sorted(refused.items()))
        return f"{n} frames of {_named(message)} came, none valid: {reasons}"
    if decoder.counts[signal].samples:
        return f"{decoder.counts[signal].samples} frames of {_named(message)} came, none of them within the run"
    similar = [_told(one) for one in _similar(message, signal_map, heard_in(log)[0])]
    instead = f"similar: {'; '.join(similar)}" if similar else "and no identifier like it"
    on = f" on {signal_map.channel}" if signal_map.channel else ""
    return f"nothing of {_named(message)} came{on}; {instead}"


def _named(message: MappedMessage) -> str:
    return f"{message.name} ({id_name(message.frame_id)})"


def _told(one: Heard) -> str:
    on = f" on {one.channel}" if one.channel else ""
    return f"{one.name}{on}, {one.rate_hz:.0f} times a second, {one.lengths[0]} bytes"


def _similar(message: MappedMessage, signal_map: SignalMap, heard: Sequence[Heard]) -> Iterator[Heard]:
    """Identifiers that nothing is mapped to, the most similar first: elsewhere, of the other width, or near by."""
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
    """How far the numbers are apart, 29 bits or 11, source addresses aside; then whether the length is another."""
    ours, theirs = message.frame_id & ~EXTENDED_ID, one.can_id & ~EXTENDED_ID
    is_both_long = bool(message.frame_id & one.can_id & EXTENDED_ID)
    apart = abs(ours - theirs)
    if is_both_long:
        apart = min(apart, abs((ours >> 8 & 0x3FFFF) - (theirs >> 8 & 0x3FFFF)))
    return apart, message.length not in one.lengths
