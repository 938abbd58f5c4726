"""Logs that python-can reads message by message (.blf .asc .trc .csv .db), as columns of the wanted frames.

python-can reads the frames; the header of a text log (date, zone, number base, kind of stamps) is read here, because
python-can takes the computer's own zone, knows two languages, and passes over what it does not understand.
"""

import io
import re
import zlib
from collections import deque
from collections.abc import Callable, Generator, Iterator
from datetime import UTC, datetime, tzinfo
from itertools import islice
from typing import BinaryIO, Final, TextIO, cast

import can
from can.io import blf
from can.io.generic import MessageReader

from gateway.bus.frames import LAST_EXTENDED, LAST_SECOND, LAST_STANDARD, ExactStamp, frames_of, message_id, stamp_to_ns
from gateway.bus.logs.packed import is_packed, open_log_file, unpacked_path, unpacked_suffix
from gateway.bus.logs.report import SHOWN_CHARS, LogReject, LogReport, Selection
from gateway.bus.logs.wall_clock import date_in, days_since_1899
from gateway.bus.signals import CAN_FD_BYTES
from gateway.bus.text import OR_CP1252
from gateway.errors import LogUnreadableError
from gateway.records import FIRST_DATED_NS, Frames
from gateway.units import NS_PER_S

CHUNK_MESSAGES: Final = 4096  # chosen: of python-can in memory
KEPT_HEADER: Final = 16  # chosen: lines of a header for a reader that is restarted; PEAK writes three
MOST_OF_CONTAINER: Final = 16_000_000  # chosen: bytes inflated at once of a .blf; Vector writes 128 KiB
_OF_NO_LENGTH: Final = re.compile(rb"LOBJ.{4}\0{4}", re.DOTALL)
_CAN_ERROR: Final = 2  # an error frame without its details, which python-can passes over
_UNREAD: Final = re.compile(rb"LOBJ..(?:(?![\x01\x02]\0)|.{6}\x02\0{3})", re.DOTALL)
_FRAMES: Final = (blf.CAN_MESSAGE, blf.CAN_MESSAGE2, blf.CAN_FD_MESSAGE, blf.CAN_FD_MESSAGE_64)
_ERRORS: Final = (_CAN_ERROR, blf.CAN_ERROR_EXT)
_VERSIONS: Final = (1, 2)  # of an object's header
LONGEST_LINE: Final = 1 << 16  # chosen: characters of a line that are read at once


def read_message_log(selection: Selection) -> Iterator[Frames]:
    """The selected frames in order of arrival, in chunks.

    Stamps are good to the microsecond, absolute if the format is. A text line that cannot be read is rejected and
    skipped; a damaged .blf or .db is read up to there, and the report says why. Raises LogUnreadableError if not even
    the beginning can be read.
    """
    suffix = unpacked_suffix(selection.path)
    read = {".blf": _blf_messages, ".db": _database_messages}.get(suffix)
    messages = read(selection.report, selection.zone) if read else _TEXTS[suffix](selection).messages()
    ours = _ours(messages, selection)
    chunks = iter(lambda: list(islice(ours, CHUNK_MESSAGES)), [])
    yield from selection.given_out((frames_of(chunk, selection.width) for chunk in chunks), 1)


def _ours(messages: Iterator[tuple[can.Message, int]], selection: Selection) -> Iterator[can.Message]:
    """Data messages of our identifiers and channel, each moved by its nanoseconds; the others are counted."""
    report = selection.report
    is_mapped: dict[int, bool] = {}
    for message, start_ns in messages:
        if message.is_error_frame:
            report.error_frames += 1
            continue
        report.frames += 1
        last = LAST_EXTENDED if message.is_extended_id else LAST_STANDARD
        if not isinstance(message.arbitration_id, int) or not 0 <= message.arbitration_id <= last:
            report.reject(LogReject.BAD_ID, report.lines or None)
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
        elif (fault := _fault_of(message, start_ns)) is not None:
            report.reject(fault, report.lines or None)
        else:
            message.timestamp = ExactStamp(stamp_to_ns(message.timestamp) + start_ns)
            yield message


def _fault_of(message: can.Message, start_ns: int) -> LogReject | None:
    """Why a message is none: python-can passes on whatever a file says."""
    stamp = message.timestamp
    if not isinstance(stamp, int | float) or not abs(stamp + start_ns / NS_PER_S) <= LAST_SECOND:
        return LogReject.BAD_TIME
    return LogReject.TOO_LONG if len(message.data) > CAN_FD_BYTES else None


class _RestartError(Exception):
    """The header has changed: python-can's reader has to be replaced by a new one, which reads the changed header."""


class _TextLog:
    """Lines of a text log for a python-can reader; a reader that fails at a line is restarted behind it.

    A line that should hold a frame and gives none is counted.
    """

    reader: Callable[[TextIO], MessageReader]

    def __init__(self, selection: Selection) -> None:
        self.report, self.zone = selection.report, selection.zone
        self.start_ns = 0
        self.header: list[str] = []  # for a reader that is restarted
        self._inserted: deque[str] = deque()
        self._text: TextIO = io.StringIO()
        self._is_at_end = False
        self._line, self._is_awaited = "", False  # the last one, and whether it should give a message
        self._given = ""  # to the reader, from the file or from the header

    def accepted(self, line: str) -> str | None:
        """The line, which is not blank, as the reader gets it; None for one that the reader need not see."""
        return line

    def holds_frame(self, line: str) -> bool:
        """Whether a line that the reader gets should hold a frame."""
        return True

    def messages(self) -> Iterator[tuple[can.Message, int]]:
        """Each message, and the nanoseconds from 1970 to the zero of its stamp."""
        report = self.report
        with open_log_file(report.path) as stream:
            self._text = io.TextIOWrapper(stream, encoding="utf-8-sig", errors=OR_CP1252)
            try:
                while not self._is_at_end:
                    yield from self._until_failure()
            except (EOFError, OSError) as fault:
                report.ended_early = str(fault)

    def _until_failure(self) -> Iterator[tuple[can.Message, int]]:
        try:
            for message in self.reader(cast(TextIO, self)):
                self._is_awaited = False
                is_dated = message.timestamp * NS_PER_S >= FIRST_DATED_NS  # by itself, whatever the header says
                self.report.has_wall_clock &= not is_dated
                yield message, 0 if is_dated else self.start_ns
            self._count_awaited()
        except (EOFError, OSError, LogUnreadableError):
            raise
        except _RestartError:
            pass  # the next reader begins with the changed header
        except Exception:  # noqa: BLE001 # python-can's parsers raise whatever a garbled line makes int() or split() raise
            self._is_awaited = False
            self.report.reject_frame(LogReject.GARBLED, self._line)
            if self._given in self.header:  # else it fails again and again
                self.header.remove(self._given)
                self._inserted.clear()
        self._inserted.extend(self.header)

    def _count_awaited(self) -> None:
        if self._is_awaited:
            self._is_awaited = False
            self.report.reject_frame(LogReject.NO_FRAME, self._line)

    def __iter__(self) -> "_TextLog":
        return self

    def __next__(self) -> str:
        self._count_awaited()
        while True:
            if self._inserted:
                self._given = self._inserted.popleft()
                return self._given
            self._line = self._text.readline(LONGEST_LINE)
            if not self._line:
                self._is_at_end = True
                raise StopIteration
            self.report.lines += 1
            accepted = self.accepted(self._line) if self._line.strip() else None
            if accepted is not None:
                self._given, self._is_awaited = accepted, self.holds_frame(accepted)
                return accepted

    def close(self) -> None:
        """The reader closes what it was given; the file stays open for the next one."""


class _AscLog(_TextLog):
    """Vector's text: lines of ``STAMP CHANNEL IDENTIFIER Rx d LENGTH BYTES``. The header may say that stamps count from
    the line before.
    """

    reader = can.ASCReader
    _DATE = re.compile(r"\s*(?:date|begin\s+triggerblock)\b\s*(.*)", re.IGNORECASE)
    _BASE = re.compile(r"\s*base\s+(hex|dec)\b(?:\s+timestamps\s+(absolute|relative))?", re.IGNORECASE)
    _STAMP = re.compile(r"\s*(-?\d{1,12})(?:\.(\d{1,9})\d*)?(?=\s)")
    _FRAME = re.compile(r"\s*-?\d\S*\s+(?:CANFD\s+\d+|\d+)\s+(?:.*\s)?(?:[RT]x|TxRq|ErrorFrame)\b", re.IGNORECASE)

    def __init__(self, selection: Selection) -> None:
        super().__init__(selection)
        self._is_relative = False
        self._sum_ns = 0
        self._state_base("hex")
        self._inserted.extend(self.header)

    def _state_base(self, base: str) -> None:
        self.header = [f"base {base} timestamps absolute\n", "internal events logged\n"]

    def accepted(self, line: str) -> str | None:
        if date := self._DATE.match(line):
            if date[1].strip():
                self.start_ns = self.report.begin_at(date_in(date[1]), self.zone, date[1].strip())
            return None
        if base := self._BASE.match(line):
            self._state_base(base[1].lower())
            self._is_relative = (base[2] or "").lower() == "relative"
            raise _RestartError
        stamp = self._STAMP.match(line)
        if stamp is None or stamp[1].startswith("-"):
            if self.holds_frame(line):
                self.report.reject_frame(LogReject.BAD_TIME, line)
            return None
        if self._is_relative:
            self._sum_ns += int(stamp[1]) * NS_PER_S + int((stamp[2] or "0").ljust(9, "0"))
            return f"{self._sum_ns // NS_PER_S}.{self._sum_ns % NS_PER_S:09d}{line[stamp.end() :]}"
        return line

    def holds_frame(self, line: str) -> bool:
        return self._FRAME.match(line) is not None


class _TrcLog(_TextLog):
    """PEAK's text. Lines of the header begin with a semicolon; the version decides the columns."""

    reader = can.TRCReader
    VERSIONS: Final = ("1.0", "1.1", "1.3", "2.0", "2.1")

    def accepted(self, line: str) -> str | None:
        if not line.startswith(";"):
            return line
        name, _, told = (part.strip() for part in line[1:].partition("="))
        if name == "$STARTTIME":
            days = float(told) if re.fullmatch(r"\d{1,6}(\.\d*)?", told) else -1.0
            self.start_ns = self.report.begin_at(days_since_1899(days) if days > 0 else None, self.zone, told)
        elif name == "$FILEVERSION" and told not in self.VERSIONS:
            raise LogUnreadableError(
                f"{self.report.path}: line {self.report.lines}: is a .trc of version {told[:SHOWN_CHARS]!r}; read are "
                f"{', '.join(self.VERSIONS)}: convert it with PEAK's converter"
            )
        elif line.startswith(";$"):
            self.header = [*self.header, line][-KEPT_HEADER:]
            return line
        elif "start time:" in line.lower() and self.report.start_ns is None and (date := date_in(line)) is not None:
            self.start_ns = self.report.begin_at(date, self.zone, line)
        return None

    def holds_frame(self, line: str) -> bool:
        return not line.startswith(";")


class _CsvLog(_TextLog):
    """python-can's table."""

    reader = can.CSVReader
    COLUMNS: Final = "timestamp,arbitration_id,extended,remote,error,dlc,data"
    _OTHERS: Final = (
        ("time stamp,id,", "SavvyCAN's (GVRET): save it there as a candump log, .asc or .trc"),
        ("timestamp.*candata|.*databytes", "CANedge's or asammdf's: read the .mf4 itself"),
        ("timestamp[;\t]", "python-can's with another separator: save it with commas and points"),
    )

    def accepted(self, line: str) -> str | None:
        if self.report.lines > 1:
            return line
        if line.strip().lower() != self.COLUMNS:
            known = (what for form, what in self._OTHERS if re.match(form, line.strip(), re.IGNORECASE))
            raise LogUnreadableError(
                f"{self.report.path}: line 1: the table is not python-can's, whose columns are {self.COLUMNS}; it is "
                f"{next(known, repr(line.strip()[:60]))}"
            )
        self.header = [line]
        return line

    def holds_frame(self, line: str) -> bool:
        return self.report.lines > 1


_TEXTS: Final[dict[str, type[_TextLog]]] = {".asc": _AscLog, ".csv": _CsvLog, ".trc": _TrcLog}
MESSAGE_SUFFIXES: Final = (*_TEXTS, ".blf", ".db")


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
            if signature != b"LOBJ" or n_bytes < head.size:
                raise blf.BLFParseError("an object has no beginning")
            content = self.file.read(n_bytes - head.size)
            self.file.read(n_bytes % 4)  # padding
            if kind == blf.LOG_CONTAINER:
                packed = self._unpacked(content)
                self._count_unread(self._tail + packed)
                yield from self._parse_container(packed)
        if b"LOBJ" in self._tail:
            raise EOFError("the last object is cut off")
        self.stop()

    def _count_unread(self, content: bytes) -> None:
        """Count the whole objects of a container that are frames, and that python-can passes over."""
        if _UNREAD.search(content) is None:
            return
        at = 0
        while (at := content.find(b"LOBJ", at, at + 8)) >= 0 and at + blf.OBJ_HEADER_BASE_STRUCT.size <= len(content):
            _, _, version, n_bytes, kind = blf.OBJ_HEADER_BASE_STRUCT.unpack_from(content, at)
            at += n_bytes
            if at > len(content):
                return
            is_read = version in _VERSIONS and kind != _CAN_ERROR
            if kind in _ERRORS and not is_read:
                self._report.error_frames += 1
            elif kind in _FRAMES and not is_read:
                self._report.frames += 1
                self._report.reject(LogReject.UNKNOWN_VERSION, text=f"header of version {version}")

    def _unpacked(self, content: bytes) -> bytes:
        method, _ = blf.LOG_CONTAINER_STRUCT.unpack_from(content)
        packed = content[blf.LOG_CONTAINER_STRUCT.size :]
        if method == blf.ZLIB_DEFLATE:
            packed = zlib.decompressobj().decompress(packed, MOST_OF_CONTAINER)
        elif method != blf.NO_COMPRESSION:
            raise blf.BLFParseError(f"a container is packed by the unknown method {method}")
        if len(packed) + len(self._tail) >= MOST_OF_CONTAINER or _OF_NO_LENGTH.search(self._tail[-16:] + packed):
            raise blf.BLFParseError("an object has an absurd length")
        return packed


def _blf_messages(report: LogReport, zone: tzinfo | None) -> Iterator[tuple[can.Message, int]]:
    with report.until_damage(".blf"), open_log_file(report.path) as stream:
        n_bytes = None if is_packed(stream) else report.path.stat().st_size  # a packed one says itself where it is cut
        reader = _BlfReader(stream, report)
        as_utc_ns, shift_ns = round(reader.start_timestamp * 1000) * 1_000_000, 0
        if reader.start_timestamp:
            date = datetime.fromtimestamp(as_utc_ns // NS_PER_S, UTC).replace(tzinfo=None)
            shift_ns = report.begin_at(date, zone, str(date)) - as_utc_ns // NS_PER_S * NS_PER_S
        for message in reader:
            yield message, shift_ns
        if n_bytes is not None and n_bytes < reader.file_size:
            raise EOFError("the file is cut off: shorter than its header says")


def _database_messages(report: LogReport, zone: tzinfo | None) -> Iterator[tuple[can.Message, int]]:
    with report.until_damage(".db"), unpacked_path(report.path) as unpacked, can.SqliteReader(unpacked) as reader:
        for message in reader:
            yield message, 0
