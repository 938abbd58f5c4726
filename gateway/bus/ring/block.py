"""A block: some minutes of frames as candump text in one gzip member whose head states its length.

RFC 1952 lets a member carry an extra field, which readers of gzip ignore. With ours a segment can be listed, and its
whole blocks distinguished from one that a power cut left unfinished, without inflating anything.
"""

import io
import struct
import zlib
from dataclasses import dataclass
from typing import BinaryIO, Final

import numpy as np
from isal import isal_zlib

from gateway.bus.frames import take
from gateway.bus.logs.candump_write import append_candump
from gateway.records import Frames

PIECE_FRAMES: Final = 8192  # are text at a time
_LEVEL: Final = 2  # of isal's 0 to 3
_RAW_DEFLATE: Final = -15

_FIXED: Final = b"\x1f\x8b\x08\x04\0\0\0\0\0\xff"  # deflate, an extra field, no time, no system
_FIELD: Final = b"SF"
_CONTENT: Final = struct.Struct("<IIqq")  # bytes of the whole member, frames, first and last stamp
_LENGTHS: Final = struct.Struct("<H2sH")
_TAIL: Final = struct.Struct("<II")  # checksum and length of the text
HEAD_BYTES: Final = len(_FIXED) + _LENGTHS.size + _CONTENT.size


@dataclass(frozen=True, slots=True)
class BlockHead:
    """The content of a block's head."""

    n_bytes: int
    n_frames: int
    first_ns: int
    last_ns: int


def packed_block(frames: Frames, channel: str) -> bytes:
    """``frames``, at least one, as one gzip member. Bytes beyond the kept payload are written as zeros."""
    packer = isal_zlib.compressobj(_LEVEL, isal_zlib.DEFLATED, _RAW_DEFLATE)
    body, checksum, n_text = [], 0, 0
    for begin in range(0, len(frames), PIECE_FRAMES):
        piece = io.BytesIO()
        append_candump(_whole(take(frames, slice(begin, begin + PIECE_FRAMES))), channel, piece)
        text = piece.getvalue()
        checksum, n_text = zlib.crc32(text, checksum), n_text + len(text)
        body.append(packer.compress(text))
    body.append(packer.flush())
    n_bytes = HEAD_BYTES + sum(map(len, body)) + _TAIL.size
    content = _CONTENT.pack(n_bytes, len(frames), int(frames.t_ns.min()), int(frames.t_ns.max()))
    head = _FIXED + _LENGTHS.pack(4 + len(content), _FIELD, len(content)) + content
    return b"".join((head, *body, _TAIL.pack(checksum, n_text & 0xFFFF_FFFF)))


def read_head(file: BinaryIO) -> BlockHead | None:
    """The head at the file's position; None if no block of ours begins there."""
    head = file.read(HEAD_BYTES)
    begin = _FIXED + _LENGTHS.pack(4 + _CONTENT.size, _FIELD, _CONTENT.size)
    if len(head) < HEAD_BYTES or not head.startswith(begin):
        return None
    found = BlockHead(*_CONTENT.unpack_from(head, len(begin)))
    return found if found.n_bytes > HEAD_BYTES + _TAIL.size else None


def head_of(block: bytes) -> BlockHead:
    """The head of a block that was just packed."""
    return BlockHead(*_CONTENT.unpack_from(block, HEAD_BYTES - _CONTENT.size))


def is_sound(block: bytes) -> bool:
    """Whether the text of a whole block matches its checksum."""
    try:
        zlib.decompress(block, wbits=31)
    except zlib.error:
        return False
    return True


def _whole(frames: Frames) -> Frames:
    """With payload rows as wide as the longest frame: a signal map keeps no more than it decodes."""
    missing = int(frames.length.max(initial=0)) - frames.payload.shape[1]
    if missing <= 0:
        return frames
    return Frames(frames.t_ns, frames.can_id, frames.length, np.pad(frames.payload, ((0, 0), (0, missing))))
