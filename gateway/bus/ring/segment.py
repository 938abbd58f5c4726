"""Segments: files of whole blocks, numbered in the order of their creation, whatever the clock said."""

import os
import re
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import reduce
from typing import BinaryIO, Final

from gateway.bus.ring.block import BlockHead, is_sound, read_head
from gateway.units import NS_PER_S

_NAME: Final = re.compile(r"([0-9]{8,18})-[0-9]{8}T[0-9]{6}Z\.log\.gz")


@dataclass(frozen=True, slots=True)
class Segment:
    """One file as far as its whole blocks reach; stamps of its first and its last frame."""

    name: str
    n_bytes: int = 0
    n_blocks: int = 0
    n_frames: int = 0
    first_ns: int = 0
    last_ns: int = 0

    @property
    def number(self) -> int:
        """Its place in the order."""
        return number_of(self.name) or 0

    def with_block(self, head: BlockHead) -> "Segment":
        """With one more block at its end."""
        is_first = self.n_blocks == 0
        return Segment(
            self.name,
            self.n_bytes + head.n_bytes,
            self.n_blocks + 1,
            self.n_frames + head.n_frames,
            head.first_ns if is_first else min(self.first_ns, head.first_ns),
            head.last_ns if is_first else max(self.last_ns, head.last_ns),
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


def open_segment(folder: int, name: str, *, for_writing: bool = False) -> BinaryIO:
    """A plain file in an open directory; no link is followed. Raises OSError."""
    flags = os.O_RDWR if for_writing else os.O_RDONLY
    file = os.open(name, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=folder)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise FileNotFoundError(f"{name} is no plain file")
    return os.fdopen(file, "r+b" if for_writing else "rb")


def create_segment(folder: int, name: str) -> BinaryIO:
    """A new file in an open directory, unbuffered. Raises OSError, also if the file exists already."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    return os.fdopen(os.open(name, flags, 0o640, dir_fd=folder), "wb", buffering=0)


def mended_segment(folder: int, name: str, *, is_newest: bool) -> tuple[Segment, int]:
    """Read the heads of a segment's blocks and cut off what follows the last complete one -> (segment, bytes removed).

    In the newest segment, which a power cut may have damaged, the last block is checked completely. Raises OSError.
    """
    with open_segment(folder, name) as file:
        heads = list(_heads(file))
        if is_newest and heads and not _is_last_sound(file, heads):
            del heads[-1]
        segment = reduce(Segment.with_block, heads, Segment(name))
        n_left = os.fstat(file.fileno()).st_size - segment.n_bytes
    if n_left:
        with open_segment(folder, name, for_writing=True) as file:
            file.truncate(segment.n_bytes)
            os.fsync(file.fileno())
    return segment, n_left


def _is_last_sound(file: BinaryIO, heads: Sequence[BlockHead]) -> bool:
    file.seek(sum(head.n_bytes for head in heads[:-1]))
    return is_sound(file.read(heads[-1].n_bytes))


def _heads(file: BinaryIO) -> Iterator[BlockHead]:
    """The heads of the whole blocks, from the first to the first that is not whole."""
    size = os.fstat(file.fileno()).st_size
    at = 0
    while at < size:
        file.seek(at)
        head = read_head(file)
        if head is None or at + head.n_bytes > size:
            return
        at += head.n_bytes
        yield head
