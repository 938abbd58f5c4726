"""The bytes of logs: packed ones (gzip, zstd, xz, by the first bytes) inflated during reading, text as whole lines."""

import codecs
import io
import lzma
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final, NamedTuple, cast

import numpy as np
from isal import igzip_lib

from gateway.bus.logs.log_report import LogReject, LogReport
from gateway.errors import LogUnreadableError
from gateway.records import U8

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer


if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd


__all__ = ["BUFFER_BYTES", "PACKED_SUFFIXES", "is_packed", "open_log_file", "unpacked_path", "unpacked_suffix", "zstd"]

PACKED_BYTES: Final = 1 << 18  # chosen: read of the file at a time
INFLATED_BYTES: Final = 1 << 17  # chosen: at most this much before a damage is lost
BUFFER_BYTES: Final = 2 << 20  # measured best; reading a file whole costs three times the decode in page faults
PACKED_SUFFIXES: Final = (".gz", ".zst", ".xz")


class Packing(NamedTuple):
    """A compression format: the first bytes of its members, its decompressor, and the exceptions of that."""

    name: str
    magics: tuple[bytes, ...]
    new_inflater: Callable[[], Any]  # as the standard library's decompressors are
    fault: type[Exception]


_ZSTD_SKIPPABLE: Final = tuple(bytes([0x50 + i]) + b"\x2a\x4d\x18" for i in range(16))  # RFC 8878, 3.1.2
PACKINGS: Final = (
    Packing(
        "gzip",
        (b"\x1f\x8b",),
        lambda: igzip_lib.IgzipDecompressor(flag=igzip_lib.DECOMP_GZIP),
        cast(type[Exception], igzip_lib.error),
    ),
    Packing("zstd", (b"\x28\xb5\x2f\xfd", *_ZSTD_SKIPPABLE), zstd.ZstdDecompressor, zstd.ZstdError),
    Packing("xz", (b"\xfd7zXZ\0",), lambda: lzma.LZMADecompressor(format=lzma.FORMAT_XZ), lzma.LZMAError),
)
_LONGEST_MAGIC: Final = max(len(magic) for packing in PACKINGS for magic in packing.magics)


class InflatedStream(io.RawIOBase):
    """A packed file inflated, all its members. Unlike a GzipFile it gives the data before a damage, then raises.

    Raises EOFError if the stream is cut, and nothing is lost; OSError if it is damaged, for the piece that holds it.
    """

    def __init__(self, file: BinaryIO, packing: Packing) -> None:
        self._file = file
        self._packing = packing
        self._inflater = packing.new_inflater()
        self._packed = b""

    def readable(self) -> bool:
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
                    raise EOFError(f"the {self._packing.name} stream is cut off")
            try:
                text = self._inflater.decompress(self._packed, min(len(room), INFLATED_BYTES))
            except self._packing.fault as fault:
                raise OSError(f"the {self._packing.name} stream is damaged: {fault}: its last piece is lost") from None
            self._packed = b""
            if text:
                room[: len(text)] = text
                return len(text)

    def close(self) -> None:
        """Close the file below as well."""
        self._file.close()
        super().close()

    def _next_member(self) -> bool:
        """Whether another member follows; zeros after the last one are padding. Raises OSError for other bytes."""
        self._packed = self._inflater.unused_data
        if len(self._packed) < _LONGEST_MAGIC:
            self._packed += self._file.read(PACKED_BYTES)
        if not self._packed.startswith(self._packing.magics):
            if self._packed.strip(b"\0"):
                raise OSError(f"something that is not {self._packing.name} follows the packed log")
            return False
        self._inflater = self._packing.new_inflater()
        return True


def open_log_file(path: Path) -> AbstractContextManager[BinaryIO]:
    """Open for reading, inflating packed content whatever the file's name."""
    try:
        file = path.open("rb")
    except OSError as fault:
        raise LogUnreadableError(f"{path}: cannot be read: {fault.strerror or fault}") from None
    first = file.peek(_LONGEST_MAGIC)
    packing = next((packing for packing in PACKINGS if first.startswith(packing.magics)), None)
    return file if packing is None else io.BufferedReader(InflatedStream(file, packing), BUFFER_BYTES)


@contextmanager
def unpacked_path(path: Path) -> Iterator[Path]:
    """The file itself, or a temporary unpacked copy, for libraries that need random access.

    Raises EOFError and OSError as InflatedStream does, LogUnreadableError if it cannot be opened.
    """
    with open_log_file(path) as stream:
        if not is_packed(stream):
            yield path
            return
        with tempfile.NamedTemporaryFile(suffix=unpacked_suffix(path)) as copy:
            shutil.copyfileobj(stream, copy, BUFFER_BYTES)
            copy.flush()
            yield Path(copy.name)


def is_packed(stream: BinaryIO) -> bool:
    """Whether a stream of ``open_log_file`` inflates a packed file."""
    return isinstance(getattr(stream, "raw", None), InflatedStream)


def unpacked_suffix(path: Path) -> str:
    """Lower-case suffix of a file's kind, without that of its packing and the number or date that logrotate adds."""
    name = path.with_suffix("") if path.suffix.lower() in PACKED_SUFFIXES else path
    return Path(re.sub(r"[.-]\d+$", "", name.name)).suffix.lower()


BLOCK_BYTES: Final = BUFFER_BYTES
MARGIN: Final = 512  # chosen: lets a reader look this far around any byte of a block


@dataclass(frozen=True, slots=True)
class LineBlock:
    """Whole lines: ``text[start:end]``, the last byte a newline, and so is the one before ``start``.

    ``text`` reaches MARGIN bytes beyond either end. It is overwritten by the next block.
    """

    text: U8
    start: int
    end: int


def line_blocks(report: LogReport, block_bytes: int = BLOCK_BYTES) -> Iterator[LineBlock]:
    """The log's lines in blocks of at most ``block_bytes``; memory does not grow with the file.

    A line longer than a block (a hole of NULs, usually) is rejected and passed over. A damaged packed stream ends the
    file there: ``report.ended_early`` says so.
    """
    buffer = bytearray(b"\n" * (block_bytes + 2 * MARGIN))
    text = np.frombuffer(buffer, np.uint8)
    carried, is_overlong = 0, False  # bytes of an unfinished line at the front of the buffer
    with open_log_file(report.path) as stream:
        while True:
            free = memoryview(buffer)[MARGIN + carried : MARGIN + block_bytes]
            n_read = _fill(stream, free, report)
            if not report.lines and buffer.startswith(codecs.BOM_UTF8, MARGIN):
                buffer[MARGIN : MARGIN + len(codecs.BOM_UTF8)] = bytes(len(codecs.BOM_UTF8))  # as a hole is
            end_of_text = MARGIN + carried + n_read
            if buffer.find(b"\t", MARGIN + carried, end_of_text) >= 0:
                free[:n_read] = bytes(free[:n_read]).replace(b"\t", b" ")
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
                report.reject_frame(LogReject.OVERLONG_LINE, line=report.lines + 1)
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
