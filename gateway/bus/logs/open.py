"""Any log file as the wanted frames of a signal map."""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from datetime import tzinfo
from itertools import islice, product
from pathlib import Path
from typing import Final

import numpy as np

from gateway.bus.logs.candump import read_candump
from gateway.bus.logs.log_report import LogReport, Selection
from gateway.bus.logs.message_log import MESSAGE_SUFFIXES, read_message_log
from gateway.bus.logs.mf4 import read_mf4
from gateway.bus.logs.packed import PACKED_SUFFIXES, open_log_file, unpacked_suffix
from gateway.bus.signals import Decoder, SignalMap
from gateway.bus.signals.mapping import CAN_FD_BYTES, EVERY_IDENTIFIER, SOURCE_ADDRESS, IdFilter, id_name, j1939_filter
from gateway.errors import LogUnreadableError
from gateway.records import EXTENDED_ID, Frames, Motion

CANDUMP_SUFFIXES: Final = (".log", ".txt", ".candump", "")
READERS: Final = {
    **dict.fromkeys(CANDUMP_SUFFIXES, read_candump),
    **dict.fromkeys(MESSAGE_SUFFIXES, read_message_log),
    ".mf4": read_mf4,
}
UNMISTAKABLE: Final = frozenset(READERS.keys() - {".txt", ""})

OTHER_KINDS: Final = (
    (rb"\xff\xfe\0\0", "UTF-32; save it as UTF-8"),
    (rb"\xff\xfe|\xfe\xff", "UTF-16; save it as UTF-8"),
    (rb"\x89PNG|\xff\xd8\xff|GIF8", "a picture"),
    (rb"%PDF", "a PDF document"),
    (rb"<!doctype|<!DOCTYPE|<html|<\?xml", "a web page, or XML"),
    (rb"version https://git-lfs", "a pointer of Git LFS; fetch the file itself"),
    (rb"PK\x03\x04", "a ZIP archive; unpack it"),
    (rb"BZh", "packed with bzip2; unpack it"),
    (rb"7z\xbc\xaf", "a 7z archive; unpack it"),
    (rb"\x1f\x8b", "packed twice; unpack it once"),
    (rb"\xd4\xc3\xb2\xa1|\n\r\r\n", "a capture of Wireshark or tcpdump; record with candump -L"),
    (rb"SQLite format 3", "an SQLite database"),
    (rb"\x7fELF", "a program"),
    (rb"LOGG", "a BLF log; name it .blf", ".blf"),
    (rb"MDF ", "an MDF log; name it .mf4", ".mf4"),
    (rb"\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]+#", "candump's text; name it .log", *CANDUMP_SUFFIXES),
    (rb"date[^\n]*\n\s*base\s+(?:hex|dec)\b", "the text of an ASC log; name it .asc", ".asc"),
    (rb";\$FILEVERSION|;##", "the text of a TRC log; name it .trc", ".trc"),
)
"""The beginning of a file, what it is, and the suffixes that say so."""
LONGEST_START: Final = 512  # chosen: bytes


def is_named_as_log(path: Path | str) -> bool:
    """Whether a file's name alone says that it is a log; .txt may be anything."""
    return unpacked_suffix(Path(path)) in UNMISTAKABLE


def open_log(path: Path | str, signal_map: SignalMap) -> tuple[Iterator[Frames], LogReport]:
    """The map's frames of a log in order of arrival, and a report that fills while they are read.

    candump text (.log, .txt, .candump) goes through a reader that takes thousands of frames at once, .mf4 through
    asammdf, .blf .asc .trc through python-can; each may be packed. Raises LogUnreadableError if the file is
    missing or of an unknown kind.
    """
    return _open(Path(path), signal_map.filters, signal_map.channel, signal_map.payload_width, signal_map.zone)


def open_whole_log(
    path: Path | str, channel: str | None = None, zone: tzinfo | None = None
) -> tuple[Iterator[Frames], LogReport]:
    """As open_log, with every data frame of any identifier, CAN FD included."""
    return _open(Path(path), EVERY_IDENTIFIER, channel, CAN_FD_BYTES, zone)


def _open(
    path: Path, filters: Sequence[IdFilter], channel: str | None, width: int, zone: tzinfo | None
) -> tuple[Iterator[Frames], LogReport]:
    suffix = unpacked_suffix(path)
    if path.is_dir():
        raise LogUnreadableError(f"{path}: is a folder, not a log file")
    if not path.exists():
        raise LogUnreadableError(f"{path}: no such file")
    if not path.is_file():
        raise LogUnreadableError(f"{path}: is a pipe or a device: write a file first")
    if suffix not in READERS:
        known, packed = " ".join(filter(None, READERS)), ", ".join(PACKED_SUFFIXES)
        raise LogUnreadableError(
            f"{path}: cannot tell the kind of log from {suffix!r}; known are {known}, and each with {packed}"
        )
    if not path.stat().st_size:
        raise LogUnreadableError(f"{path}: is empty")
    _require_no_other_kind(path, suffix)
    selection = Selection(LogReport(path), filters, channel, width, zone)
    return _compared(READERS[suffix], selection), selection.report


def _compared(read: Callable[[Selection], Iterator[Frames]], selection: Selection) -> Iterator[Frames]:
    """The frames. If there is none, the report says how an identifier differs from one that is wanted."""
    yield from read(selection)
    report = selection.report
    if not report.wanted and report.other_identifiers:
        with suppress(LogUnreadableError):
            for frames in islice(read(Selection(LogReport(report.path), EVERY_IDENTIFIER, None, CAN_FD_BYTES)), 1):
                pairs = product(np.unique(frames.can_id).tolist(), selection.filters)
                report.nearly = next((told for pair in pairs if (told := _told_difference(*pair))), None)


def _told_difference(can_id: int, wanted: IdFilter) -> str | None:
    """How an identifier differs from the wanted ones, if only by its width or its J1939 source address."""
    found, asked = id_name(can_id), id_name(wanted.can_id)
    if can_id ^ wanted.can_id == EXTENDED_ID:
        n_bits = 29 if can_id & EXTENDED_ID else 11
        return f", but {found} has the number of {asked} in {n_bits} bits: correct the database"
    if can_id & wanted.can_id & EXTENDED_ID and j1939_filter(wanted.can_id).is_for(can_id):
        source = f"from the J1939 source address {can_id & SOURCE_ADDRESS:#04x}"
        return f", but {found} has the group of {asked} {source}: correct source_address, or set j1939 = true"
    return None


def motion_of_log(path: Path | str, signal_map: SignalMap) -> tuple[Iterator[Motion], LogReport]:
    """A log decoded: motion in chunks, and the reader's report with the decoder."""
    chunks, report = open_log(path, signal_map)
    report.decoder = Decoder(signal_map)
    return map(report.decoder.decode, chunks), report


def _require_no_other_kind(path: Path, suffix: str) -> None:
    """A log may be damaged; a file that begins like another kind never was what its name says."""
    try:
        with open_log_file(path) as stream:
            start = stream.read(LONGEST_START)
    except (OSError, EOFError, LogUnreadableError):
        return  # the reader says why it cannot be read
    for form, kind, *suffixes in OTHER_KINDS:
        if suffix not in suffixes and re.match(rb"(?:\xef\xbb\xbf)?\s*(?:" + form + rb")", start):
            raise LogUnreadableError(f"{path}: is not what its name says, but {kind}")
