"""Logs that python-can reads message by message (.blf .asc .trc), as columns of the wanted frames.

python-can reads the frames; the header of a text log (date, zone, number base, kind of stamps) is read here, because
python-can takes the computer's own zone, knows two languages, and passes over what it does not understand.
"""

import io
import re
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator, Sequence
from datetime import UTC, datetime
from itertools import chain, islice
from typing import Any, BinaryIO, ClassVar, Final

import can
from can.io import blf

from gateway.bus.frames import LAST_SECOND, ExactStamp, frames_of, has_possible_id, message_id, stamp_to_ns
from gateway.bus.logs.log_report import SHOWN_CHARS, LogReject, LogReport, Selection
from gateway.bus.logs.packed import is_packed, open_log_file, unpacked_suffix
from gateway.bus.logs.wall_clock import date_in, days_since_1899
from gateway.bus.signals.mapping import CAN_FD_BYTES
from gateway.bus.text_encoding import OR_CP1252
from gateway.errors import LogUnreadableError
from gateway.records import FIRST_DATED_NS, Frames
from gateway.units import NS_PER_S

CHUNK_MESSAGES: Final = 4096  # chosen: of python-can in memory
LINES_AT_ONCE: Final = 256  # chosen: given to python-can together; a faulty one among them is found by halving
LONGEST_LINE: Final = 1 << 16  # chosen: characters of a line that are read at once
MOST_OF_CONTAINER: Final = 16_000_000  # chosen: bytes of a .blf in memory; Vector's containers have 128 KiB
TRC_VERSIONS: Final = ("1.0", "1.1", "1.3", "2.0", "2.1")
_BLF_FRAMES: Final = (blf.CAN_MESSAGE, blf.CAN_MESSAGE2, blf.CAN_FD_MESSAGE, blf.CAN_FD_MESSAGE_64)
_BLF_ERROR: Final = 2  # an error frame without its details, which python-can passes over
_BLF_VERSIONS: Final = (1, 2)  # of the object headers that python-can reads
# Perhaps an object of no length, of another version, or an error frame; most containers have none and need no walk.
_BLF_ODD: Final = re.compile(rb"LOBJ(?:.{4}[\0-\x0f]\0{3}|..(?![\x01\x02]\0)|.{8}\x02\0{3})", re.DOTALL)


Found = tuple[can.Message, int, int | None]  # with the nanoseconds from 1970 to the zero of its stamp, and its line


def read_message_log(selection: Selection) -> Iterator[Frames]:
    """The selected frames in order of arrival, in chunks.

    Stamps are good to the microsecond, absolute if the format is. A text line that cannot be read is rejected and
    skipped; a damaged .blf is read up to there, and the report says why. Raises LogUnreadableError if not even
    the beginning can be read.
    """
    ours = _ours(_MESSAGES[unpacked_suffix(selection.path)](selection), selection)
    chunks = iter(lambda: list(islice(ours, CHUNK_MESSAGES)), [])
    yield from selection.given_out((frames_of(chunk, selection.width) for chunk in chunks), 1)


def _ours(found: Iterator[Found], selection: Selection) -> Iterator[can.Message]:
    """Data messages of our identifiers and channel with their times since 1970; the others are counted."""
    report = selection.report
    is_mapped: dict[int, bool] = {}
    for message, start_ns, line in found:
        if message.is_error_frame:
            report.error_frames += 1
            continue
        report.frames += 1
        if not has_possible_id(message):
            report.reject(LogReject.BAD_ID, line)
            continue
        can_id = message_id(message)
        if can_id not in is_mapped:
            is_mapped[can_id] = any(ids.is_for(can_id) for ids in selection.filters)
        if not is_mapped[can_id]:
            continue
        if message.is_remote_frame:
            report.remote_frames += 1
        elif not selection.has(message.channel, 1):
            continue
        elif (
            not isinstance(message.timestamp, int | float)
            or not abs(message.timestamp + start_ns / NS_PER_S) <= LAST_SECOND
        ):
            report.reject(LogReject.BAD_TIME, line)
        elif len(message.data) > CAN_FD_BYTES:
            report.reject(LogReject.TOO_LONG, line)
        else:
            message.timestamp = ExactStamp(stamp_to_ns(message.timestamp) + start_ns)
            yield message


class _TextLog(ABC):
    """What the header of a text log says of the lines behind it."""

    reader: ClassVar[Callable[..., Any]]
    header_form: ClassVar[re.Pattern[str]]

    def __init__(self, selection: Selection) -> None:
        self.report, self.zone, self.start_ns = selection.report, selection.zone, 0
        self.header: dict[str, str] = {}  # lines that tell python-can's reader how to read those of frames

    @abstractmethod
    def read_header(self, told: re.Match[str]) -> None:
        """Take a line that ``header_form`` matches."""

    @abstractmethod
    def frame_in(self, line: str) -> str | None:
        """The line as python-can reads it; None if it should hold no frame."""


class _AscLog(_TextLog):
    """Vector's text: lines of ``STAMP CHANNEL IDENTIFIER Rx d LENGTH BYTES``. The header may say that stamps count from
    the line before. J1939TP lines repeat the content of several frames.
    """

    reader = can.ASCReader
    header_form = re.compile(
        r"\s*(?:(?:date|begin\s+triggerblock)\b\s*(?P<date>.*)"
        r"|base\s+(?P<base>hex|dec)\b(?:\s+timestamps\s+(?P<stamps>absolute|relative))?)",
        re.IGNORECASE,
    )
    _STAMP = re.compile(r"\s*(-?\d{1,12})(?:\.(\d{1,9})\d*)?(?=\s)")
    _FRAME = re.compile(
        r"\s*-?\d\S*\s+(?:(?:CANFD\s+\d+|\d+)(?!\s+J1939TP)\s+(?:.*\s)?(?:[RT]x|TxRq|ErrorFrame)\b|\S+\s+\S+\s+[RT]x\s+d\s)",
        re.IGNORECASE,
    )

    def __init__(self, selection: Selection) -> None:
        super().__init__(selection)
        self._is_relative, self._sum_ns = False, 0
        self._state_base("hex")

    def _state_base(self, base: str) -> None:
        self.header["base"] = f"base {base} timestamps absolute\ninternal events logged\n"

    def read_header(self, told: re.Match[str]) -> None:
        if told["base"]:
            self._state_base(told["base"].lower())
            self._is_relative = (told["stamps"] or "").lower() == "relative"
        elif date := told["date"].strip():
            self.start_ns, self._sum_ns = self.report.begin_at(date_in(date), self.zone, date), 0

    def frame_in(self, line: str) -> str | None:
        is_frame, stamp = self._FRAME.match(line), self._STAMP.match(line)
        if stamp is None or stamp[1].startswith("-"):
            if is_frame:
                self.report.reject_frame(LogReject.BAD_TIME, line)
            return None
        if self._is_relative:
            self._sum_ns += int(stamp[1]) * NS_PER_S + int((stamp[2] or "0").ljust(9, "0"))
            line = f"{self._sum_ns // NS_PER_S}.{self._sum_ns % NS_PER_S:09d}{line[stamp.end() :]}"
        return line if is_frame else None


class _TrcLog(_TextLog):
    """PEAK's text. Lines of the header begin with a semicolon; the version decides the columns. Some lines are no
    frames: a change of the bus status or the error counters, or an event of the user.
    """

    reader = can.TRCReader
    header_form = re.compile(";.*", re.DOTALL)
    _OTHER = re.compile(r"\s*\d+\)?\s+[\d.]+\s+(?:\d\s+)?(?:(?P<error>ER|Error)|ST|EC|EV|Warng|FFFFFFFF)\b")

    def read_header(self, told: re.Match[str]) -> None:
        line = told[0]
        name, _, stated = (part.strip() for part in line[1:].partition("="))
        if name == "$STARTTIME":
            days = float(stated.replace(",", ".")) if re.fullmatch(r"\d{1,6}([.,]\d*)?", stated) else -1.0
            self.start_ns = self.report.begin_at(days_since_1899(days) if days > 0 else None, self.zone, stated)
        elif name == "$FILEVERSION" and stated not in TRC_VERSIONS:
            raise LogUnreadableError(
                f"{self.report.path}: line {self.report.lines}: is a .trc of version {stated[:SHOWN_CHARS]!r}; "
                f"read are {', '.join(TRC_VERSIONS)}: convert it with PEAK's converter"
            )
        elif name in ("$FILEVERSION", "$COLUMNS"):
            self.header[name] = line
        elif "start time:" in line.lower() and self.report.start_ns is None:
            self.start_ns = self.report.begin_at(date_in(line), self.zone, line.partition(":")[2].strip())

    def frame_in(self, line: str) -> str | None:
        other = self._OTHER.match(line)
        if other is None:
            return line
        self.report.error_frames += other["error"] is not None
        return None


def _text_messages(log: _TextLog) -> Iterator[Found]:
    report, waiting = log.report, list[tuple[int, str]]()
    with open_log_file(report.path) as stream:
        text = io.TextIOWrapper(stream, encoding="utf-8-sig", errors=OR_CP1252)
        try:
            while line := text.readline(LONGEST_LINE):
                report.lines += 1
                header = log.header_form.match(line)
                if header or len(waiting) >= LINES_AT_ONCE:
                    yield from _messages_in(waiting, log)
                    waiting = []
                if header:
                    log.read_header(header)
                elif line.strip() and (frame := log.frame_in(line)) is not None:
                    waiting.append((report.lines, frame))
        except (EOFError, OSError) as fault:
            report.ended_early = str(fault)
        yield from _messages_in(waiting, log)


def _messages_in(lines: Sequence[tuple[int, str]], log: _TextLog) -> Iterator[Found]:
    """The message of each numbered line; one that gives none is counted with its number."""
    if not lines:
        return
    report, messages, reason = log.report, list[can.Message](), LogReject.NO_FRAME
    try:
        messages = list(log.reader(io.StringIO("".join(chain(log.header.values(), (line for _, line in lines))))))
    except Exception:  # noqa: BLE001 # python-can's parsers raise whatever a garbled line makes int() or split() raise
        reason = LogReject.GARBLED
    if len(messages) == len(lines):
        for (number, _), message in zip(lines, messages, strict=True):
            is_dated = message.timestamp * NS_PER_S >= FIRST_DATED_NS  # by itself, whatever the header says
            report.has_wall_clock &= not is_dated
            yield message, 0 if is_dated else log.start_ns, number
    elif len(lines) == 1:
        report.reject_frame(reason, lines[0][1], lines[0][0])
    else:
        middle = len(lines) // 2
        yield from _messages_in(lines[:middle], log)
        yield from _messages_in(lines[middle:], log)


class _BlfReader(can.BLFReader):
    """Ends at the first container that is damaged or absurd; python-can passes over some, takes all memory for others,
    and reads an object of no length for ever. Counts the frames that python-can passes over.
    """

    def __init__(self, stream: BinaryIO, report: LogReport) -> None:
        super().__init__(stream)
        self._report = report

    def __iter__(self) -> Generator[can.Message, None, None]:
        head = blf.OBJ_HEADER_BASE_STRUCT
        while begin := self.file.read(head.size):
            signature, _, _, n_bytes, kind = head.unpack(begin)
            if signature != b"LOBJ" or not head.size <= n_bytes < MOST_OF_CONTAINER:
                raise blf.BLFParseError("an object has no beginning, or an absurd length")
            content = self.file.read(n_bytes - head.size)
            self.file.read(n_bytes % 4)  # padding
            if kind == blf.LOG_CONTAINER:
                packed = self._unpacked(content)
                self._check_objects(self._tail + packed)
                yield from self._parse_container(packed)
        if b"LOBJ" in self._tail:
            raise EOFError("the last object is cut off")
        self.stop()

    def _unpacked(self, content: bytes) -> bytes:
        method, _ = blf.LOG_CONTAINER_STRUCT.unpack_from(content)
        packed = content[blf.LOG_CONTAINER_STRUCT.size :]
        if method == blf.ZLIB_DEFLATE:
            packed = zlib.decompressobj().decompress(packed, MOST_OF_CONTAINER)
        elif method != blf.NO_COMPRESSION:
            raise blf.BLFParseError(f"a container is packed by the unknown method {method}")
        if len(packed) + len(self._tail) >= MOST_OF_CONTAINER:
            raise blf.BLFParseError("an object has an absurd length")
        return packed

    def _check_objects(self, content: bytes) -> None:
        """Count the frames among whole objects that python-can passes over; raise BLFParseError for absurd lengths."""
        head, at = blf.OBJ_HEADER_BASE_STRUCT, 0
        if _BLF_ODD.search(content) is None:
            return
        while (at := content.find(b"LOBJ", at, at + 8)) >= 0 and at + head.size <= len(content):
            _, _, version, n_bytes, kind = head.unpack_from(content, at)
            if n_bytes < head.size:
                raise blf.BLFParseError("an object has an absurd length")
            at += n_bytes
            if at > len(content):
                return
            is_read = version in _BLF_VERSIONS and kind != _BLF_ERROR
            if kind in (_BLF_ERROR, blf.CAN_ERROR_EXT) and not is_read:
                self._report.error_frames += 1
            elif kind in _BLF_FRAMES and not is_read:
                self._report.frames += 1
                self._report.reject(LogReject.UNKNOWN_VERSION, text=f"header of version {version}")


def _blf_messages(selection: Selection) -> Iterator[Found]:
    report = selection.report
    with report.until_damage(".blf"), open_log_file(report.path) as stream:
        n_bytes = None if is_packed(stream) else report.path.stat().st_size  # a packed one says itself where it is cut
        reader = _BlfReader(stream, report)
        as_utc_ns, shift_ns = round(reader.start_timestamp * 1000) * 1_000_000, 0
        if reader.start_timestamp:
            date = datetime.fromtimestamp(as_utc_ns // NS_PER_S, UTC).replace(tzinfo=None)
            shift_ns = report.begin_at(date, selection.zone, str(date)) - as_utc_ns // NS_PER_S * NS_PER_S
        for message in reader:
            yield message, shift_ns, None
        if n_bytes is not None and n_bytes < reader.file_size:
            raise EOFError("the file is cut off: shorter than its header says")


_MESSAGES: Final[dict[str, Callable[[Selection], Iterator[Found]]]] = {
    ".asc": lambda selection: _text_messages(_AscLog(selection)),
    ".trc": lambda selection: _text_messages(_TrcLog(selection)),
    ".blf": _blf_messages,
}
MESSAGE_SUFFIXES: Final = tuple(_MESSAGES)
