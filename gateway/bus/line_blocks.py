"""A text file, gzip or not, as blocks of whole lines in one buffer that is used again and again."""

import zlib
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final, cast

import numpy as np
from isal import igzip, isal_zlib

from gateway.bus.log_report import LogReject, LogReport
from gateway.errors import LogUnreadableError
from gateway.records import U8

BLOCK_BYTES: Final = 1 << 20  # stays in the cache; reading a file whole costs three times the decode in page faults
MARGIN: Final = 512  # lets a reader look this far around any byte of a block
_GZIP_MAGIC: Final = b"\x1f\x8b"
_IsalError = cast(type[Exception], isal_zlib.error)


@dataclass(frozen=True, slots=True)
class LineBlock:
    """Whole lines: ``text[start:end]``, the last byte a newline, and so is the one before ``start``.

    ``text`` reaches MARGIN bytes beyond either end. It is overwritten when the next block is asked for.
    """

    text: U8
    start: int
    end: int


def open_maybe_gzip(path: Path) -> AbstractContextManager[BinaryIO]:
    """Open for reading, inflating where the content is gzip whatever the file is called."""
    try:
        with path.open("rb") as file:
            is_gzip = file.read(2) == _GZIP_MAGIC
        return cast(BinaryIO, igzip.IGzipFile(path)) if is_gzip else path.open("rb")  # type: ignore[no-untyped-call] # isal has no types
    except OSError as fault:
        raise LogUnreadableError(f"{path}: cannot be read: {fault.strerror or fault}") from None


def line_blocks(path: Path, report: LogReport, block_bytes: int = BLOCK_BYTES) -> Iterator[LineBlock]:
    """The file's lines in blocks of at most ``block_bytes``; memory does not grow with the file.

    A line longer than a block (a hole of NULs, usually) is rejected and passed over. A damaged gzip
    stream ends the file there: ``report.ended_early`` says so.
    """
    buffer = bytearray(b"\n" * (block_bytes + 2 * MARGIN))
    text = np.frombuffer(buffer, np.uint8)
    carried, is_overlong = 0, False  # bytes of an unfinished line at the front of the buffer
    with open_maybe_gzip(path) as stream:
        while True:
            free = memoryview(buffer)[MARGIN + carried : MARGIN + block_bytes]
            n_read = _fill(stream, free, report)
            end_of_text = MARGIN + carried + n_read
            is_last = n_read < len(free)
            if is_last and buffer[end_of_text - 1] != ord("\n"):
                buffer[end_of_text] = ord("\n")
                end_of_text += 1
            end = buffer.rfind(b"\n", MARGIN, end_of_text) + 1
            start = MARGIN
            if is_overlong and end:
                start = buffer.index(b"\n", MARGIN) + 1
                report.lines += 1
                is_overlong = False
            if end > start:
                yield LineBlock(text, start, end)
            if is_last:
                return
            if not end and not is_overlong:
                report.reject(LogReject.OVERLONG_LINE, report.lines + 1)
                is_overlong = True
            carried = 0 if is_overlong else end_of_text - end
            buffer[MARGIN : MARGIN + carried] = buffer[end : end + carried]


def _fill(stream: BinaryIO, free: memoryview, report: LogReport) -> int:
    """Read until ``free`` is full or the file ends; bytes read."""
    n_read = 0
    try:
        while n_read < len(free) and (n := stream.readinto1(free[n_read:])):  # type: ignore[attr-defined] # BufferedIOBase has it
            n_read += n
    except (EOFError, OSError, zlib.error, _IsalError) as fault:
        report.ended_early = f"the file is damaged: {fault}"
    return n_read
