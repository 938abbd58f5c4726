"""python-can messages to and from columns of frames."""

from collections.abc import Sequence

import can
import numpy as np

from gateway.bus.frames import empty_frames
from gateway.records import EXTENDED_ID, Frames
from gateway.units import NS_PER_S


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
