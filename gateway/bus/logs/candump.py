"""Bulk reader of candump logs: the wanted frames of a text log as columns, at some 30 million lines a second.

numpy finds every ``#``; the eight bytes before it, read as one integer, give the identifier. Lines of wanted frames are
then read by shape, all lines of a shape at once; lines without a common shape are read exactly, one by one, and counted
if they contain no frame. Lines of other identifiers are passed over unread.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.bus.frames import frames_of, in_order, take
from gateway.bus.logs.candump_line import LineShape, learn_shape, read_line
from gateway.bus.logs.log_report import SHOWN_CHARS, LogReject, LogReport, Selection
from gateway.bus.logs.packed import BLOCK_BYTES, LineBlock, line_blocks
from gateway.bus.signals.mapping import EVERY_IDENTIFIER, IdFilter
from gateway.bus.text_encoding import OR_CP1252
from gateway.records import EXTENDED_ID, I64, U8, Bool, Frames

KEPT_SHAPES: Final = 32  # chosen: shapes of lines that are remembered
LONGEST_LINE: Final = 4096  # chosen: bytes examined by an exact read
_LOWER_CASE_BIT: Final = np.uint8(0x20)  # makes an ASCII letter a small one
_LOWER_CASE: Final = np.uint64(0x2020_2020_2020_2020)  # the same of each byte of a word
_PLACES: Final = np.uint64(0x0001_0203_0405_0607)
_ERROR_FRAME_TEXT: Final = "20000???"  # SocketCAN's error flag and the classes that exist


def read_candump(selection: Selection, block_bytes: int = BLOCK_BYTES) -> Iterator[Frames]:
    """The selected frames in order of arrival, in chunks.

    No content of the log ends the run: see LogReport. Raises LogUnreadableError if the file cannot be opened.
    """
    reader, report = _CandumpReader(selection), selection.report
    yield from selection.given_out(map(reader.read, line_blocks(report, block_bytes)))
    if not report.wanted and isinstance(read_line(reader.first_line), LogReject):
        whole = Selection(LogReport(report.path), EVERY_IDENTIFIER, None, selection.width)
        for _ in map(_CandumpReader(whole).read, line_blocks(whole.report, block_bytes)):
            """Every line is read, so that one which no filter could find is not taken for another identifier's."""
        report.rejects = whole.report.rejects


class IdPattern:
    """Compares the text of an identifier before its ``#`` as one masked 64-bit word."""

    def __init__(self, text: str) -> None:
        """``text`` is matched at the end of the eight bytes, case ignored; ``?`` stands for any byte."""
        padded = text.lower().rjust(8, "?")
        self.last_digit = padded[-1]
        mask = bytes(0 if byte == "?" else 0xFF for byte in padded)
        self._mask = np.frombuffer(mask, np.uint64)[0]
        self._text = (np.frombuffer(padded.encode(), np.uint64)[0] | _LOWER_CASE) & self._mask

    @classmethod
    def of_filter(cls, id_filter: IdFilter) -> "IdPattern":
        """Text that every identifier passing the filter has; if single bits are masked, others have it too."""
        is_extended = bool(id_filter.can_id & EXTENDED_ID)
        n_digits, all_bits = (8, 0x1FFF_FFFF) if is_extended else (3, 0x7FF)
        text = "" if is_extended else " "
        for shift in range(4 * n_digits - 4, -1, -4):
            is_fixed = (id_filter.mask ^ all_bits) >> shift & 0xF & (all_bits >> shift) == 0
            text += f"{(id_filter.can_id & all_bits) >> shift & 0xF:x}" if is_fixed else "?"
        return cls(text)

    def matches(self, words: NDArray[np.uint64]) -> Bool:
        """Which words (n,), in lower case, have the text."""
        is_hit: Bool = (words & self._mask) == self._text
        return is_hit


class _CandumpReader:
    """Reads block after block; keeps the shapes it has learned and the number of lines read."""

    def __init__(self, selection: Selection) -> None:
        self._selection = selection
        self._patterns = [IdPattern.of_filter(id_filter) for id_filter in selection.filters]
        self._error_pattern = IdPattern(_ERROR_FRAME_TEXT)
        self._last_digits = {pattern.last_digit for pattern in self._patterns}
        self._report = selection.report
        self._shapes: list[LineShape] = []
        self.first_line = b""  # with a mark
        self._finder = _Finder()

    def read(self, block: LineBlock) -> Frames:
        """The block's wanted frames in order of arrival."""
        report = self._report
        lines = block.text[block.start : block.end]
        n_lines = int(np.count_nonzero(self._finder.are(lines, "\n")))
        hashes = self._finder.marks(lines)
        hashes += block.start
        if len(hashes) and not self.first_line:
            self.first_line = _line_around(block, int(hashes[0]))
        if len(hashes) != n_lines:
            self._report_frameless(block, hashes)
        frames = self._wanted(block, self._hits(block, hashes))
        report.frames += len(hashes)
        report.lines += n_lines
        return frames

    def _hits(self, block: LineBlock, hashes: I64) -> I64:
        """The marks (m,) whose identifier text may be a wanted one."""
        hashes = self._likely(block.text, hashes)
        words = np.ndarray(len(block.text) - 7, np.uint64, buffer=block.text, strides=(1,))[hashes - 8] | _LOWER_CASE
        is_error = self._error_pattern.matches(words)
        n_errors = int(np.count_nonzero(is_error))
        self._report.error_frames += n_errors
        self._report.frames -= n_errors
        is_hit = np.zeros(len(hashes), np.bool_)
        for pattern in self._patterns:
            is_hit |= pattern.matches(words)
        return hashes.compress(is_hit & ~is_error if n_errors else is_hit)

    def _likely(self, text: U8, hashes: I64) -> I64:
        """The marks behind the last digit of a wanted identifier, or eight bytes behind the first of an error's."""
        if "?" in self._last_digits:
            return hashes
        last = text.take(hashes - 1) | _LOWER_CASE_BIT
        is_likely = text.take(hashes - 8) == ord(_ERROR_FRAME_TEXT[0])
        for digit in self._last_digits:
            is_likely |= last == ord(digit)
        return hashes.compress(is_likely)

    def _wanted(self, block: LineBlock, hits: I64) -> Frames:
        """The frames of the hits: by every known shape, then, line by line, by new shapes or exactly."""
        places: list[I64] = []
        parts: list[Frames] = []
        for shape in self._shapes:
            hits = self._read_shape(block, hits, shape, places, parts)
        while len(hits):
            line = _line_around(block, int(hits[0]))
            learned = learn_shape(line)
            n_before = len(hits)
            if learned is not None and learned not in self._shapes:
                self._shapes = [*self._shapes[1 - KEPT_SHAPES :], learned]  # the commonest shape was learned first
                hits = self._read_shape(block, hits, learned, places, parts)
            if len(hits) == n_before:
                self._read_exactly(block, int(hits[0]), line, places, parts)
                hits = hits[1:]
        frames = in_order(places, parts, self._selection.width)
        is_wanted = self._selection.passes(frames.can_id)  # others have the text of a wanted one
        return frames if is_wanted.all() else take(frames, is_wanted)

    def _read_shape(self, block: LineBlock, hits: I64, shape: LineShape, places: list[I64], parts: list[Frames]) -> I64:
        """Take the lines of one shape; those that remain are returned."""
        if not len(hits):
            return hits
        fits, frames = shape.read(block.text, hits, self._selection.width)
        if self._selection.has(shape.channel.decode(), len(frames)):
            places.append(hits[fits])
            parts.append(frames)
        return hits[~fits]

    def _read_exactly(self, block: LineBlock, hit: int, line: bytes, places: list[I64], parts: list[Frames]) -> None:
        content = read_line(line)
        if isinstance(content, LogReject):
            line_number = None
            if self._report.keeps_lines_of(content):
                n_before = int(np.count_nonzero(block.text[block.start : hit] == ord("\n")))
                line_number = self._report.lines + n_before + 1
            self._report.reject(content, line_number, shown(line))
        elif content.is_error_frame:  # of classes that do not exist; the others are never read
            self._report.error_frames += 1
            self._report.frames -= 1
        elif content.is_remote_frame:
            self._report.remote_frames += 1
        elif self._selection.has(content.channel, 1):
            places.append(np.array([hit]))
            parts.append(frames_of([content], self._selection.width))

    def _report_frameless(self, block: LineBlock, hashes: I64) -> None:
        """Count the non-empty lines without ``#``."""
        ends = np.flatnonzero(block.text[block.start : block.end] == ord("\n")) + block.start
        has_mark = np.zeros(len(ends), np.bool_)
        has_mark[np.searchsorted(ends, hashes)] = True
        for i in np.flatnonzero(~has_mark):
            start = block.start if i == 0 else int(ends[i - 1]) + 1
            line = block.text[start : min(int(ends[i]), start + LONGEST_LINE)].tobytes()
            if line.strip():
                content = read_line(line)
                reason = content if isinstance(content, LogReject) else LogReject.GARBLED
                self._report.reject_frame(reason, shown(line), self._report.lines + int(i) + 1)


class _Finder:
    """Finds a character in a block, with one reused buffer for the result."""

    def __init__(self) -> None:
        self._is_found = np.zeros(0, np.bool_)

    def are(self, lines: U8, character: str) -> Bool:
        """Which bytes (n,) are this character; overwritten by the next question."""
        if len(self._is_found) < len(lines) + 8:
            self._is_found = np.zeros(8 * (len(lines) // 8 + 2), np.bool_)
        return np.equal(lines, ord(character), out=self._is_found[: len(lines)])

    def marks(self, lines: U8) -> I64:
        """Positions of the marks between identifier and payload; the two characters of a CAN FD ## are one.

        Eight bytes are compared as one number: if exactly one of them is a mark, the number is 256 to the power of its
        place, and the highest byte of its product with _PLACES is the place.
        """
        is_mark = self.are(lines, "#")
        self._is_found[len(lines) : len(lines) + 8] = False
        words = self._is_found.view(np.uint64)[: len(lines) // 8 + 1]
        at = np.flatnonzero(words != 0)
        found = words[at]
        if (found & (found - np.uint64(1))).any():
            return _apart(np.flatnonzero(is_mark))
        return _apart(8 * at + ((found * _PLACES) >> np.uint64(56)).view(np.int64))


def _apart(hashes: I64) -> I64:
    """Remove positions that directly follow another."""
    follows_another = hashes[1:] - hashes[:-1] == 1
    return np.delete(hashes, np.flatnonzero(follows_another) + 1) if follows_another.any() else hashes


def _line_around(block: LineBlock, at: int) -> bytes:
    """The line that contains the byte ``at``, its newline included, as far as LONGEST_LINE on either side."""
    first = max(block.start, at - LONGEST_LINE)
    around = block.text[first : min(block.end, at + LONGEST_LINE)].tobytes()
    begin = around.rfind(b"\n", 0, at - first) + 1
    end = around.find(b"\n", at - first) + 1
    return around[begin : end or None]


def shown(line: bytes) -> str:
    """The beginning of a line for people."""
    return line.strip(b"\0 \t\r\n")[: 2 * SHOWN_CHARS].decode("utf-8", OR_CP1252)
