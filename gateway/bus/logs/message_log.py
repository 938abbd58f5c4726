"""Logs in every format python-can reads (.asc .blf .mf4 .trc .csv .db), as columns of the wanted frames."""

import io
import re
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, Final, TextIO, cast

import can
from can.io.generic import MessageReader

from gateway.bus.frames import LAST_SECOND
from gateway.bus.logs.packed import open_log_file
from gateway.bus.logs.report import LogReject, LogReport
from gateway.bus.messages import frames_of, message_id
from gateway.bus.signals import IdFilter
from gateway.errors import LogUnreadableError
from gateway.records import Frames

CHUNK_FRAMES: Final = 4096

# What a python-can reader takes for its header when it is begun anew in the middle of a file
_TEXT_READERS: Final[Mapping[str, tuple[Callable[[TextIO], MessageReader], tuple[str, ...]]]] = {
    ".asc": (lambda file: can.ASCReader(file, relative_timestamp=False), ("internal events logged\n",)),
    ".csv": (can.CSVReader, ("timestamp,arbitration_id,extended,remote,error,dlc,data\n",)),
    ".trc": (can.TRCReader, ()),
}
_BINARY_READERS: Final[Mapping[str, Callable[[Any], MessageReader]]] = {
    ".blf": can.BLFReader,
    ".mf4": can.MF4Reader,
}
MESSAGE_SUFFIXES: Final = (*_TEXT_READERS, *_BINARY_READERS, ".db")


def read_message_log(
    path: Path, suffix: str, filters: Sequence[IdFilter], channel: str | None, width: int, report: LogReport
) -> Iterator[Frames]:
    """Frames that pass one of ``filters``, of ``channel`` or of all, in order of arrival, in chunks.

    Stamps are good to the microsecond, absolute where the format is (.asc in this machine's local time,
    as its writers mean it). A text line that cannot be read is rejected and passed over; damaged binary
    logs end with what was readable, and ``report.ended_early`` says why. Raises LogUnreadableError where
    not even the beginning can be read.
    """
    messages = _text_messages(path, suffix, report) if suffix in _TEXT_READERS else _messages(path, suffix, report)
    ours = _ours(messages, filters, channel, report)
    chunk: list[can.Message] = []
    for message in ours:
        chunk.append(message)
        if len(chunk) == CHUNK_FRAMES:
            yield _hand_on(chunk, width, report)
            chunk = []
    if chunk:
        yield _hand_on(chunk, width, report)


def _hand_on(chunk: list[can.Message], width: int, report: LogReport) -> Frames:
    frames = frames_of(chunk, width)
    report.hand_on(frames.t_ns)
    return frames


def _ours(
    messages: Iterator[can.Message], filters: Sequence[IdFilter], channel: str | None, report: LogReport
) -> Iterator[can.Message]:
    """Data messages of our identifiers and channel; the others are counted."""
    is_mapped: dict[int, bool] = {}
    for message in messages:
        if message.is_error_frame:
            report.error_frames += 1
            continue
        report.frames += 1
        can_id = message_id(message)
        if can_id not in is_mapped:
            is_mapped[can_id] = any(can_id & f.mask == f.can_id for f in filters)
        if not is_mapped[can_id]:
            continue
        report.channels.add(str(message.channel))
        if message.is_remote_frame:
            report.remote_frames += 1
        elif not is_same_channel(message.channel, channel):
            report.other_channel += 1
        elif not abs(message.timestamp) <= LAST_SECOND:
            report.reject(LogReject.BAD_TIME)
        else:
            yield message


def is_same_channel(recorded: object, wanted: str | None) -> bool:
    """Whether a recorded channel is the wanted one.

    A number, as python-can counts channels, matches a name that ends in it (1 and "can1"). A format that
    keeps no channel (.csv, .db) matches every name.
    """
    if wanted is None or recorded is None or str(recorded) == wanted:
        return True
    digits = re.search(r"\d+$", wanted)
    return isinstance(recorded, int) and digits is not None and int(digits[0]) == recorded


class _ResumableLines:
    """Lines of a text log for a python-can reader, numbered, with lines put in front of what is left."""

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._inserted: deque[str] = deque()
        self.number = 0
        self.is_exhausted = False

    def insert(self, lines: Sequence[str]) -> None:
        self._inserted.extend(lines)

    def __iter__(self) -> "_ResumableLines":
        return self

    def __next__(self) -> str:
        if self._inserted:
            return self._inserted.popleft()
        line = self._file.readline()
        if not line:
            self.is_exhausted = True
            raise StopIteration
        self.number += 1
        return line

    def close(self) -> None:
        self._file.close()


def _text_messages(path: Path, suffix: str, report: LogReport) -> Iterator[can.Message]:
    """Messages of a text log; a reader that trips over a line is begun anew behind it."""
    make_reader, header = _TEXT_READERS[suffix]
    with open_log_file(path) as stream:
        text = io.TextIOWrapper(stream, encoding="utf-8", errors="replace")
        lines = _ResumableLines(text)
        reader = make_reader(cast(TextIO, lines))
        while not lines.is_exhausted:
            try:
                yield from reader
            except (EOFError, OSError) as fault:
                report.ended_early = str(fault)
                return
            except Exception:  # noqa: BLE001 # python-can's parsers raise whatever a garbled line makes int() or split() raise
                report.reject(LogReject.GARBLED, lines.number)
                lines.insert(header)
            finally:
                report.lines = lines.number


def _messages(path: Path, suffix: str, report: LogReport) -> Iterator[can.Message]:
    try:
        with open_log_file(path) as stream, _binary_reader(path, suffix, stream) as reader:
            yield from reader
            if _is_cut(path, reader):
                report.ended_early = "the file is cut off: shorter than its header says"
    except NotImplementedError:
        raise LogUnreadableError(f'{path}: reading {suffix} needs asammdf: pip install "python-can[mf4]"') from None
    except LogUnreadableError:
        raise
    except Exception as fault:  # noqa: BLE001 # each format's library has errors of its own for a damaged file
        if report.frames == 0:
            raise LogUnreadableError(f"{path}: cannot be read as {suffix}: {_told(fault)}") from None
        report.ended_early = f"the file is damaged: {_told(fault)}"


def _binary_reader(path: Path, suffix: str, stream: BinaryIO) -> MessageReader:
    return can.SqliteReader(path) if suffix == ".db" else _BINARY_READERS[suffix](stream)


def _is_cut(path: Path, reader: MessageReader) -> bool:
    """Whether an (uncompressed) .blf is shorter than it says; python-can ends such a file without a word."""
    is_plain = path.suffix.lower() == ".blf"
    return is_plain and isinstance(reader, can.BLFReader) and path.stat().st_size < reader.file_size


def _told(fault: Exception) -> str:
    return str(fault) or type(fault).__name__
