"""Segments: files of whole blocks, numbered in the order of their creation, whatever the clock said.

A block is some minutes of frames as candump text in one gzip member whose head states its length. RFC 1952 lets a
member carry an extra field, which readers of gzip ignore. With ours a segment can be listed, and its whole blocks
distinguished from one that a power cut left unfinished, without inflating anything.
"""

import io
import os
import re
import struct
import zlib
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import reduce
from typing import BinaryIO, Final

from isal import isal_zlib

from gateway.bus.frames import take, widened
from gateway.bus.logs.candump_write import append_candump
from gateway.files.kept import open_plain
from gateway.records import Frames
from gateway.status import Segment
from gateway.units import NS_PER_S

PIECE_FRAMES: Final = 8192  # chosen: in memory as text at a time
_LEVEL: Final = 2  # chosen, of isal's 0 to 3
_RAW_DEFLATE: Final = -15  # wbits of zlib: a window of 2^15 bytes, no header

_FIXED: Final = b"\x1f\x8b\x08\x04\0\0\0\0\0\xff"  # deflate, an extra field, no time, no system
_FIELD: Final = b"SF"
_CONTENT: Final = struct.Struct("<IIqq")  # bytes of the whole member, frames, first and last stamp
_LENGTHS: Final = struct.Struct("<H2sH")
_TAIL: Final = struct.Struct("<II")  # checksum and length of the text
_BEGIN: Final = _FIXED + _LENGTHS.pack(4 + _CONTENT.size, _FIELD, _CONTENT.size)
HEAD_BYTES: Final = len(_BEGIN) + _CONTENT.size


def packed_block(frames: Frames, channel: str) -> bytes:
    """``frames``, at least one, as one gzip member. Bytes beyond the kept payload are written as zeros."""
    packer = isal_zlib.compressobj(_LEVEL, isal_zlib.DEFLATED, _RAW_DEFLATE)
    body, checksum, n_text = [], 0, 0
    for begin in range(0, len(frames), PIECE_FRAMES):
        piece = io.BytesIO()
        part = take(frames, slice(begin, begin + PIECE_FRAMES))
        # the rows as wide as the longest frame: a signal map keeps no more than it decodes
        append_candump(widened(part, int(part.length.max())), channel, piece)
        text = piece.getvalue()
        checksum, n_text = zlib.crc32(text, checksum), n_text + len(text)
        body.append(packer.compress(text))
    body.append(packer.flush())
    n_bytes = HEAD_BYTES + sum(map(len, body)) + _TAIL.size
    content = _CONTENT.pack(n_bytes, len(frames), int(frames.t_ns.min()), int(frames.t_ns.max()))
    return b"".join((_BEGIN, content, *body, _TAIL.pack(checksum, n_text & 0xFFFF_FFFF)))


def block_of(head: bytes, name: str) -> Segment:
    """What the head of a block says, as a segment of this name with this block alone."""
    n_bytes, n_frames, first_ns, last_ns = _CONTENT.unpack_from(head, len(_BEGIN))
    return Segment(name, n_bytes, 1, n_frames, first_ns, last_ns)


def is_sound(block: bytes) -> bool:
    """Whether the text of a whole block matches its checksum."""
    try:
        zlib.decompress(block, wbits=31)
    except zlib.error:
        return False
    return True


_NAME: Final = re.compile(r"([0-9]{8,18})-[0-9]{8}T[0-9]{6}Z\.log\.gz")


def with_block(segment: Segment, block: Segment) -> Segment:
    """A segment with one more block."""
    if not segment.n_blocks:
        return block
    return Segment(
        segment.name,
        segment.n_bytes + block.n_bytes,
        segment.n_blocks + 1,
        segment.n_frames + block.n_frames,
        min(segment.first_ns, block.first_ns),
        max(segment.last_ns, block.last_ns),
    )


def name_of(number: int, first_ns: int) -> str:
    """The name of a segment that begins with a frame of this stamp."""
    begun = datetime.fromtimestamp(first_ns // NS_PER_S, UTC)
    return f"{number:08d}-{begun:%Y%m%dT%H%M%SZ}.log.gz"


def number_of(name: str) -> int | None:
    """The number in a segment's name; None for any other name."""
    found = _NAME.fullmatch(name)
    return None if found is None else int(found[1])


def names_in(folder: int) -> list[str]:
    """The segments in an open directory, oldest first. Raises OSError."""
    with os.scandir(folder) as entries:
        numbered = [(number, entry.name) for entry in entries if (number := number_of(entry.name)) is not None]
    return [name for _, name in sorted(numbered)]


def mended_segment(folder: int, name: str, *, is_newest: bool) -> tuple[Segment, int]:
    """Read the heads of a segment's blocks and cut off what follows the last complete one -> (segment, bytes removed).

    In the newest segment, which a power cut may have damaged, the last block is checked completely. Raises OSError.
    """
    with open_plain(folder, name) as file:
        blocks = list(_blocks(file, name))
        if is_newest and blocks:
            file.seek(sum(block.n_bytes for block in blocks[:-1]))
            if not is_sound(file.read(blocks[-1].n_bytes)):
                del blocks[-1]
        segment = reduce(with_block, blocks, Segment(name))
        n_left = os.fstat(file.fileno()).st_size - segment.n_bytes
    if n_left:
        with open_plain(folder, name, for_writing=True) as file:
            file.truncate(segment.n_bytes)
            os.fsync(file.fileno())
    return segment, n_left


def _blocks(file: BinaryIO, name: str) -> Iterator[Segment]:
    """The blocks up to the first that is not whole."""
    size = os.fstat(file.fileno()).st_size
    at = 0
    while at < size:
        file.seek(at)
        head = file.read(HEAD_BYTES)
        if len(head) < HEAD_BYTES or not head.startswith(_BEGIN):
            return
        block = block_of(head, name)
        if not HEAD_BYTES + _TAIL.size < block.n_bytes <= size - at:
            return
        at += block.n_bytes
        yield block
