"""A text file, gzip or not, as blocks of whole lines in one buffer that is used again and again."""

import io
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Final, cast

import numpy as np
from isal import igzip_lib

from gateway.bus.logs.report import LogReject, LogReport
from gateway.errors import LogUnreadableError
from gateway.records import U8

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

BLOCK_BYTES: Final = 2 << 20  # measured best; reading a file whole costs three times the decode in page faults
MARGIN: Final = 512  # lets a reader look this far around any byte of a block
PACKED_BYTES: Final = 1 << 18
INFLATED_BYTES: Final = 1 << 17  # at most this much before a damage is lost
_GZIP_MAGIC: Final = b"\x1f\x8b"
_IsalError = cast(type[Exception], igzip_lib.error)


@dataclass(frozen=True, slots=True)
class LineBlock:
    """Whole lines: ``text[start:end]``, the last byte a newline, and so is the one before ``start``.

    ``text`` reaches MARGIN bytes beyond either end. It is overwritten when the next block is asked for.
    """

    text: U8
    start: int
    end: int


class GzipStream(io.RawIOBase):
    """A gzip file inflated by isal. Unlike a GzipFile it gives all there is before a damage, then raises.

    Raises EOFError where the stream is cut, OSError where it is damaged.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._inflater = _new_inflater()
        self._packed = b""

    def readable(self) -> bool:
        """A stream to read from."""
        return True

    def readinto(self, buffer: "WriteableBuffer") -> int:
        """Inflate into ``buffer``; bytes written, 0 at the end."""
        room = memoryview(buffer).cast("B")
        while True:
            if self._inflater.eof and not self._next_member():
                return 0
            if self._inflater.needs_input and not self._packed:
                self._packed = self._file.read(PACKED_BYTES)
                if not self._packed:
                    raise EOFError("the gzip stream is cut off")
            try:
                text = self._inflater.decompress(self._packed, min(len(room), INFLATED_BYTES))
            except _IsalError as fault:
                raise OSError(f"the gzip stream is damaged: {fault}") from None
            self._packed = b""
            if text:
                room[: len(text)] = text
                return len(text)

    def close(self) -> None:
        """Close the file below as well."""
        self._file.close()
        super().close()

    def _next_member(self) -> bool:
        """Whether another gzip member follows; zeros and what is no gzip after the last one are padding."""
        self._packed = self._inflater.unused_data or self._file.read(PACKED_BYTES)
        if not self._packed.startswith(_GZIP_MAGIC):
            return False
        self._inflater = _new_inflater()
        return True


def _new_inflater() -> igzip_lib.IgzipDecompressor:
    return igzip_lib.IgzipDecompressor(flag=igzip_lib.DECOMP_GZIP)


def open_maybe_gzip(path: Path) -> AbstractContextManager[BinaryIO]:
    """Open for reading, inflating where the content is gzip whatever the file is called."""
    try:
        file = path.open("rb")
    except OSError as fault:
        raise LogUnreadableError(f"{path}: cannot be read: {fault.strerror or fault}") from None
    if not file.peek(2).startswith(_GZIP_MAGIC):
        return file
    return io.BufferedReader(GzipStream(file), BLOCK_BYTES)


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
    except (EOFError, OSError) as fault:
        report.ended_early = str(fault)
    return n_read
