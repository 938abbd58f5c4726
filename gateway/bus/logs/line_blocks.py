"""Reads a text file, compressed or not, as blocks of whole lines in one reused buffer."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np

from gateway.bus.logs.packed import BUFFER_BYTES, open_log_file
from gateway.bus.logs.report import LogReject, LogReport
from gateway.records import U8

BLOCK_BYTES: Final = BUFFER_BYTES  # measured best; reading a file whole costs three times the decode in page faults
MARGIN: Final = 512  # lets a reader look this far around any byte of a block


@dataclass(frozen=True, slots=True)
class LineBlock:
    """Whole lines: ``text[start:end]``, the last byte a newline, and so is the one before ``start``.

    ``text`` reaches MARGIN bytes beyond either end. It is overwritten by the next block.
    """

    text: U8
    start: int
    end: int


def line_blocks(path: Path, report: LogReport, block_bytes: int = BLOCK_BYTES) -> Iterator[LineBlock]:
    """The file's lines in blocks of at most ``block_bytes``; memory does not grow with the file.

    A line longer than a block (a hole of NULs, usually) is rejected and passed over. A damaged packed stream ends the
    file there: ``report.ended_early`` says so.
    """
    buffer = bytearray(b"\n" * (block_bytes + 2 * MARGIN))
    text = np.frombuffer(buffer, np.uint8)
    carried, is_overlong = 0, False  # bytes of an unfinished line at the front of the buffer
    with open_log_file(path) as stream:
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
