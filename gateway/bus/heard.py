"""Survey of the identifiers on a channel: rate and lengths of each, and those that resemble a missing one.

A device may be set to another identifier than the database says, or to 29 bits.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
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


@dataclass(slots=True)
class _Count:
    """Counts of one identifier so far."""

    n: int = 0
    first_ns: int = 0
    last_ns: int = 0
    n_kept: int = 0
    kept: list[Frames] = field(default_factory=list)

    def add(self, frames: Frames) -> None:
        self.first_ns = int(frames.t_ns.min()) if not self.n else min(self.first_ns, int(frames.t_ns.min()))
        self.last_ns = max(self.last_ns, int(frames.t_ns.max()))
        self.n += len(frames)
        if self.n_kept < KEPT_FRAMES:
            self.kept.append(frames)
            self.n_kept += len(frames)


Counts = dict[int, _Count]


def counted(chunks: Iterable[Frames]) -> Counts:
    counts: Counts = {}
    for frames in chunks:
        for can_id in np.unique(frames.can_id):
            counts.setdefault(int(can_id), _Count()).add(take(frames, frames.can_id == can_id))
    return counts


def heard_on(channel: str | None, counts: Counts) -> tuple[Heard, ...]:
    """The counts of a channel as ``Heard``, ordered by identifier."""
    return tuple(
        Heard(channel, can_id, count.n, (count.last_ns - count.first_ns) / NS_PER_S, join(count.kept, CAN_FD_BYTES))
        for can_id, count in sorted(counts.items(), key=lambda item: (item[0] & EXTENDED_ID, item[0]))
    )


NEAR: Final = 0x20  # chosen: devices that are set to other identifiers mostly keep them together
MOST_SIMILAR: Final = 3  # chosen: what a person looks through


def similar_to(message: MappedMessage, signal_map: SignalMap, heard: Sequence[Heard]) -> tuple[str, ...]:
    """Descriptions of unmapped identifiers that resemble ``message``, the most similar first."""
    return tuple(
        f"{one.name}{f' on {one.channel}' if one.channel else ''}, {one.rate_hz:.0f} times a second, "
        f"{one.lengths[0]} bytes"
        for one in _similar(message, signal_map, heard)
    )


def _similar(message: MappedMessage, signal_map: SignalMap, heard: Sequence[Heard]) -> Iterator[Heard]:
    """Identifiers without a mapping, the most similar first: another source, the other width, or a near number."""
    mapped = [m.id_filter for m in signal_map.messages]
    free = [
        one for one in heard
        if not any(ids.is_for(one.can_id) for ids in mapped) or message.id_filter.is_for(one.can_id)
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
