"""Identifiers heard: each identifier of a channel, how often, and how long its frames are."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from gateway.bus.frames import join, take
from gateway.bus.signals import CAN_FD_BYTES, id_name
from gateway.records import EXTENDED_ID, Frames
from gateway.units import NS_PER_S

KEPT_FRAMES: Final = 100_000  # of one identifier: a quarter of an hour at 100 Hz; counts and rates know them all


@dataclass(frozen=True, slots=True)
class Heard:
    """One identifier of one channel: its frames in all, the usual number of bytes, and the first of its frames."""

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
        """Every number of bytes that occurs, the usual one first."""
        lengths, n_times = np.unique(self.frames.length, return_counts=True)
        return tuple(int(length) for length in lengths[np.argsort(-n_times, kind="stable")])

    @property
    def name(self) -> str:
        """The identifier as candump writes it: three digits, or eight if it has 29 bits."""
        return id_name(self.can_id)


@dataclass(slots=True)
class _Count:
    """What was counted of one identifier so far."""

    n: int = 0
    first_ns: int = 0
    last_ns: int = 0
    n_kept: int = 0
    kept: list[Frames] = field(default_factory=list)

    def add(self, frames: Frames) -> None:
        """Further frames of it."""
        self.first_ns = int(frames.t_ns.min()) if not self.n else min(self.first_ns, int(frames.t_ns.min()))
        self.last_ns = max(self.last_ns, int(frames.t_ns.max()))
        self.n += len(frames)
        if self.n_kept < KEPT_FRAMES:
            self.kept.append(frames)
            self.n_kept += len(frames)


Counts = dict[int, _Count]


def counted(chunks: Iterable[Frames]) -> Counts:
    """Frames of every identifier in them."""
    counts: Counts = {}
    for frames in chunks:
        for can_id in np.unique(frames.can_id):
            counts.setdefault(int(can_id), _Count()).add(take(frames, frames.can_id == can_id))
    return counts


def heard_on(channel: str | None, counts: Counts) -> tuple[Heard, ...]:
    """The counts, in order of the identifiers."""
    return tuple(
        Heard(channel, can_id, count.n, (count.last_ns - count.first_ns) / NS_PER_S, join(count.kept, CAN_FD_BYTES))
        for can_id, count in sorted(counts.items(), key=lambda item: (item[0] & EXTENDED_ID, item[0]))
    )
