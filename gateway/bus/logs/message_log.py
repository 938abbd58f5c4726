"""Logs that python-can reads message by message (.blf .asc .trc .csv .db), as columns of the wanted frames."""

import io
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Final, TextIO, cast

import can
from can.io.generic import MessageReader

from gateway.bus.frames import LAST_SECOND, frames_of, message_id
from gateway.bus.logs.packed import is_packed, open_log_file, unpacked_path, unpacked_suffix
from gateway.bus.logs.report import LogReject, LogReport, Selection
from gateway.records import Frames

CHUNK_MESSAGES: Final = 4096  # chosen: of python-can in memory

# The header for a python-can reader that is restarted in the middle of a file
_TEXT_READERS: Final[Mapping[str, tuple[Callable[[TextIO], MessageReader], tuple[str, ...]]]] = {
    ".asc": (lambda file: can.ASCReader(file, relative_timestamp=False), ("internal events logged\n",)),
    ".csv": (can.CSVReader, ("timestamp,arbitration_id,extended,remote,error,dlc,data\n",)),
    ".trc": (can.TRCReader, ()),
}
MESSAGE_SUFFIXES: Final = (*_TEXT_READERS, ".blf", ".db")


def read_message_log(selection: Selection) -> Iterator[Frames]:
    """The selected frames in order of arrival, in chunks.

    Stamps are good to the microsecond, absolute if the format is (.asc in this machine's local time, as its writers
    mean it). A text line that cannot be read is rejected and skipped; a damaged .blf or .db is read up to there, and
    the report says why. Raises LogUnreadableError if not even the beginning can be read.
    """
    report, suffix = selection.report, unpacked_suffix(selection.path)
    binary = {".blf": _blf_messages, ".db": _database_messages}
    ours = _ours(binary[suffix](report) if suffix in binary else _text_messages(suffix, report), selection)
    chunks = iter(lambda: list(islice(ours, CHUNK_MESSAGES)), [])
    yield from selection.given_out((frames_of(chunk, selection.width) for chunk in chunks), 1)


def _ours(messages: Iterator[can.Message], selection: Selection) -> Iterator[can.Message]:
    """Data messages of our identifiers and channel; the others are counted."""
    report = selection.report
    is_mapped: dict[int, bool] = {}
    for message in messages:
        if message.is_error_frame:
            report.error_frames += 1
            continue
        report.frames += 1
        can_id = message_id(message)
        if can_id not in is_mapped:
            is_mapped[can_id] = any(ids.is_for(can_id) for ids in selection.filters)
        if not is_mapped[can_id]:
            continue
        if message.is_remote_frame:
            report.remote_frames += 1
        elif not selection.has(message.channel, 1):
            continue
        elif not abs(message.timestamp) <= LAST_SECOND:
            report.reject(LogReject.BAD_TIME)
        else:
            yield message


class _ResumableLines:
    """Lines of a text log for a python-can reader, numbered, with lines inserted before the rest."""

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


def _text_messages(suffix: str, report: LogReport) -> Iterator[can.Message]:
    """Messages of a text log; a reader that fails at a line is restarted behind it."""
    make_reader, header = _TEXT_READERS[suffix]
    with open_log_file(report.path) as stream:
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


def _blf_messages(report: LogReport) -> Iterator[can.Message]:
    with report.until_damage(".blf"), open_log_file(report.path) as stream:
        n_bytes = None if is_packed(stream) else report.path.stat().st_size  # a packed one says itself where it is cut
        reader = can.BLFReader(stream)
        yield from reader
        if n_bytes is not None and n_bytes < reader.file_size:
            raise EOFError("the file is cut off: shorter than its header says")


def _database_messages(report: LogReport) -> Iterator[can.Message]:
    with report.until_damage(".db"), unpacked_path(report.path) as unpacked, can.SqliteReader(unpacked) as reader:
        yield from reader
