"""Survey of the identifiers on a channel: rate and lengths of each, and those that resemble a missing one.

A device may be set to another identifier than the database says, or to 29 bits.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.bus.frames import join, take
from gateway.bus.signals import CAN_FD_BYTES, MappedMessage, SignalMap, id_name
from gateway.records import EXTENDED_ID, Frames
from gateway.units import NS_PER_S

KEPT_FRAMES: Final = 100_000  # chosen: of one identifier: a quarter of an hour at 100 Hz; counts cover all frames


@dataclass(frozen=True, slots=True)
class Heard:
    """One identifier of one channel: the number of its frames, their time span, and the first of them."""

    channel: str | None
    can_id: int
    n_frames: int
    duration_s: float
    frames: Frames

    @property
    def rate_hz(self) -> float:
        """Frames a second, from the first to the last."""
        return (self.n_frames - 1) / self.duration_s if self.duration_s > 0.0 else 0.0

    @property
    def lengths(self) -> tuple[int, ...]:
        """The payload lengths that occur, the most frequent first."""
        lengths, n_times = np.unique(self.frames.length, return_counts=True)
        return tuple(int(length) for length in lengths[np.argsort(-n_times, kind="stable")])

    @property
    def name(self) -> str:
        """The identifier as candump writes it: three digits, or eight if it has 29 bits."""
        return id_name(self.can_id)


def heard_of(chunks: Iterable[Frames], channel: str | None = None) -> tuple[Heard, ...]:
    """Every identifier of the frames, all of one channel, ordered by identifier."""
    spans: dict[int, tuple[int, int, int]] = {}  # number of frames, first and last stamp
    kept: dict[int, list[Frames]] = {}
    for frames in chunks:
        for can_id in np.unique(frames.can_id).tolist():
            ours = take(frames, frames.can_id == can_id)
            first_ns, last_ns = int(ours.t_ns.min()), int(ours.t_ns.max())
            n, before_ns, after_ns = spans.get(can_id, (0, first_ns, last_ns))
            spans[can_id] = n + len(ours), min(first_ns, before_ns), max(last_ns, after_ns)
            if n < KEPT_FRAMES:
                kept.setdefault(can_id, []).append(ours)
    return tuple(
        Heard(channel, can_id, n, (last_ns - first_ns) / NS_PER_S, join(kept[can_id], CAN_FD_BYTES))
        for can_id, (n, first_ns, last_ns) in sorted(spans.items())
    )


NEAR: Final = 0x20  # chosen: devices that are set to other identifiers mostly keep them together
MOST_SIMILAR: Final = 3  # chosen: what a person looks through


def similar_to(message: MappedMessage, signal_map: SignalMap, heard: Sequence[Heard]) -> tuple[str, ...]:
    """Descriptions of unmapped identifiers that resemble ``message``, the most similar first."""
    others = [mapped.id_filter for mapped in signal_map.messages if mapped is not message]
    free = [one for one in heard if not any(ids.is_for(one.can_id) for ids in others)]
    ranked = sorted(free, key=lambda one: (_distance(message, one), one.can_id))[:MOST_SIMILAR]
    return tuple(
        f"{one.name}{f' on {one.channel}' if one.channel else ''}, {one.rate_hz:.0f} times a second, "
        f"{one.lengths[0]} bytes"
        for one in ranked
        if _distance(message, one)[0] <= NEAR
    )


def _distance(message: MappedMessage, one: Heard) -> tuple[int, bool]:
    """Distance of the numbers, source addresses of 29-bit ones aside, and whether the length differs."""
    ours, theirs = message.frame_id & ~EXTENDED_ID, one.can_id & ~EXTENDED_ID
    is_both_long = bool(message.frame_id & one.can_id & EXTENDED_ID)
    apart = abs(ours - theirs)
    if is_both_long:
        apart = min(apart, abs((ours >> 8 & 0x3FFFF) - (theirs >> 8 & 0x3FFFF)))
    return apart, message.length not in one.lengths
