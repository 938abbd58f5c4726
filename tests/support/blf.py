"""BLF files made object by object, for what python-can's writer never writes."""

import struct
import zlib
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

CLASSIC, ERROR_EXT, CLASSIC2, FD, FD64, TEXT = 1, 73, 86, 100, 101, 65
START_MS = 1_760_146_908_000


def classic(channel: int, can_id: int, payload: bytes, *, flags: int = 0) -> bytes:
    """Body of a classic frame; bit 31 of the identifier says that it has 29 bits."""
    return struct.pack("<HBBL8s", channel, flags, len(payload), can_id, payload)


def fd(channel: int, can_id: int, payload: bytes) -> bytes:
    """Body of a CAN FD frame as older tools write it."""
    return struct.pack("<HBBLLBBB5x64s", channel, 0, 15, can_id, 0, 0, 1, len(payload), payload)


def fd64(channel: int, can_id: int, payload: bytes, *, n_kept: int | None = None, extension: bytes = b"") -> bytes:
    """Body of a CAN FD frame as newer tools write it: only the first bytes may be kept, an extension may follow."""
    kept = payload[:n_kept]
    extension_at = 32 + 40 + len(kept) if extension else 0
    counts = (0, 0x1000, 0, 0, 0, 0, 0, 0, extension_at, 0)
    head = struct.pack("<BBBBLLLLLLLHBBL", channel, 15, len(payload), 0, can_id, *counts)
    return head + kept + extension


def blf_object(kind: int, stamp: int, body: bytes, *, version: int = 1, in_ten_microseconds: bool = False) -> bytes:
    """One object with its padding."""
    unit = 1 if in_ten_microseconds else 2
    stamped = struct.pack("<LHHQ", unit, 0, 0, stamp) if version == 1 else struct.pack("<LBxHQ8x", unit, 0, 0, stamp)
    size = 16 + len(stamped) + len(body)
    return struct.pack("<4sHHLL", b"LOBJ", 16 + len(stamped), version, size, kind) + stamped + body + bytes(size % 4)


def write_blf(path: Path, content: bytes, cuts: Sequence[int] = (), *, method: int = 2) -> None:
    """A file whose containers end at ``cuts`` of the content, which may be in the middle of an object."""
    places = [0, *sorted(cuts), len(content)]
    pieces = [content[begin:end] for begin, end in pairwise(places)]
    containers = b"".join(_container(piece, method) for piece in pieces)
    start = (2025, 10, 6, 11, 1, 41, 48, 0)
    counts = (144 + len(containers), len(content) + 144, 1, 1)
    head = struct.pack("<4sLBBBBBBBBQQLL8H8H", b"LOGG", 144, 5, 0, 0, 0, 2, 6, 8, 1, *counts, *start, *start)
    path.write_bytes(head.ljust(144, b"\0") + containers)


def _container(piece: bytes, method: int) -> bytes:
    packed = zlib.compress(piece) if method == 2 else piece
    size = 32 + len(packed)
    head = struct.pack("<4sHHLL", b"LOBJ", 16, 1, size, 10) + struct.pack("<H6xL4x", method, len(piece))
    return head + packed + bytes(size % 4)
