"""Columns of frames: splitting, joining, and conversion from and to python-can messages."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Final, Literal

import can
import numpy as np

from gateway.records import EXTENDED_ID, I64, Bool, Frames
from gateway.units import NS_PER_S

LAST_STANDARD: Final = 0x7FF  # ISO 11898-1: 11 bits
LAST_EXTENDED: Final = 0x1FFF_FFFF  # likewise 29 bits
LAST_SECOND: Final = 9_223_372_035  # int64 nanoseconds reach no further

Speed = float | Literal["max"]  # of a replay: 2.0 is twice as fast as recorded


def empty_frames(width: int) -> Frames:
    return Frames(np.empty(0, np.int64), np.empty(0, np.uint32), np.empty(0, np.uint8), np.empty((0, width), np.uint8))


def take(frames: Frames, rows: I64 | Bool | slice) -> Frames:
    """The chosen rows: indices in the desired order, a mask (n,), or a slice."""
    if isinstance(rows, slice):
        return Frames(frames.t_ns[rows], frames.can_id[rows], frames.length[rows], frames.payload[rows])
    at = np.flatnonzero(rows) if rows.dtype == np.bool_ else rows
    payload = frames.payload.take(at, axis=0)  # ten times as fast as by brackets
    return Frames(frames.t_ns[at], frames.can_id[at], frames.length[at], payload)


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
    return in_order([part.t_ns for part in parts], [widened(part, width) for part in parts], width)


def widened(frames: Frames, width: int) -> Frames:
    """The frames with payload rows of at least ``width`` bytes, filled up with zeros."""
    missing = width - frames.payload.shape[1]
    if missing <= 0:
        return frames
    return Frames(frames.t_ns, frames.can_id, frames.length, np.pad(frames.payload, ((0, 0), (0, missing))))


class ExactStamp(float):
    """A python-can time stamp, seconds as a float, that remembers its nanoseconds.

    A double resolves today's seconds to a quarter of a microsecond only; python-can's in-process bus passes the object
    itself on, so a replay arrives with the stamps it was sent with.
    """

    t_ns: int

    def __new__(cls, t_ns: int) -> "ExactStamp":
        """The stamp of integer nanoseconds since 1970."""
        stamp = super().__new__(cls, t_ns / NS_PER_S)
        stamp.t_ns = t_ns
        return stamp


def stamp_to_ns(stamp: float) -> int:
    """Nanoseconds of a python-can stamp, to the microsecond: the resolution of a double for today's date."""
    return stamp.t_ns if isinstance(stamp, ExactStamp) else round(stamp * 1e6) * 1000


def message_id(message: can.Message) -> int:
    """Identifier with EXTENDED_ID for 29 bits."""
    return message.arbitration_id | (EXTENDED_ID if message.is_extended_id else 0)


def has_possible_id(message: can.Message) -> bool:
    """Whether a CAN bus can carry its identifier. python-can passes on whatever a file or an adapter says."""
    last = LAST_EXTENDED if message.is_extended_id else LAST_STANDARD
    return isinstance(message.arbitration_id, int) and 0 <= message.arbitration_id <= last


def frames_of(messages: Sequence[can.Message], width: int) -> Frames:
    """Data messages as columns, in the order given. Bytes beyond ``width`` are cut off; the length stays true."""
    if not messages:
        return empty_frames(width)
    rows = b"".join(bytes(message.data[:width]).ljust(width, b"\0") for message in messages)
    return Frames(
        np.array([stamp_to_ns(message.timestamp) for message in messages], np.int64),
        np.array([message_id(message) for message in messages], np.uint32),
        np.array([len(message.data) for message in messages], np.uint8),
        np.frombuffer(rows, np.uint8).reshape(-1, width),
    )


def message_of(frames: Frames, row: int) -> can.Message:
    """One row as a message with an exact stamp; CAN FD if it is longer than 8 bytes."""
    can_id, length = int(frames.can_id[row]), int(frames.length[row])
    return can.Message(
        timestamp=ExactStamp(int(frames.t_ns[row])),
        arbitration_id=can_id & ~EXTENDED_ID,
        is_extended_id=bool(can_id & EXTENDED_ID),
        is_fd=length > 8,
        data=frames.payload[row, :length].tobytes(),
    )
