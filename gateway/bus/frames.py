"""Columns of frames: splitting and joining."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

import numpy as np

from gateway.records import I64, Bool, Frames

LAST_SECOND: Final = 9_223_372_035  # int64 nanoseconds reach no further


def empty_frames(width: int) -> Frames:
    """An empty table of frames with payload rows of ``width`` bytes."""
    return Frames(np.empty(0, np.int64), np.empty(0, np.uint32), np.empty(0, np.uint8), np.empty((0, width), np.uint8))


def take(frames: Frames, rows: I64 | Bool | slice) -> Frames:
    """The chosen rows: indices in the desired order, a mask (n,), or a slice."""
    return Frames(frames.t_ns[rows], frames.can_id[rows], frames.length[rows], frames.payload[rows])


def join(parts: Sequence[Frames], width: int) -> Frames:
    """Concatenate tables of frames; all have payload rows of ``width`` bytes."""
    if len(parts) == 1:
        return parts[0]
    if not parts:
        return empty_frames(width)
    return Frames(
        np.concatenate([part.t_ns for part in parts]),
        np.concatenate([part.can_id for part in parts]),
        np.concatenate([part.length for part in parts]),
        np.concatenate([part.payload for part in parts]),
    )


def gathered(chunks: Iterable[Frames], n: int, width: int) -> Iterator[Frames]:
    """The same frames in chunks of at least ``n``; only the last may have fewer, and none is empty."""
    parts: list[Frames] = []
    n_waiting = 0
    for chunk in chunks:
        if len(chunk):
            parts.append(chunk)
            n_waiting += len(chunk)
        if n_waiting >= n:
            yield join(parts, width)
            parts, n_waiting = [], 0
    if parts:
        yield join(parts, width)


def in_order(places: Sequence[I64], parts: Sequence[Frames], width: int) -> Frames:
    """Join tables of frames and sort them by the key of each frame (n,)."""
    joined = join(parts, width)
    return joined if len(parts) < 2 else take(joined, np.argsort(np.concatenate(places), kind="stable"))


def merge_frames(parts: Sequence[Frames]) -> Frames:
    """Joined in order of time; of equal stamps, the earlier part comes first. Payload widths may differ."""
    width = max((part.payload.shape[1] for part in parts), default=8)
    return in_order([part.t_ns for part in parts], [_widened(part, width) for part in parts], width)


def _widened(frames: Frames, width: int) -> Frames:
    missing = width - frames.payload.shape[1]
    if missing == 0:
        return frames
    return Frames(frames.t_ns, frames.can_id, frames.length, np.pad(frames.payload, ((0, 0), (0, missing))))
