"""Bulk reader of Vector's binary logs (.blf): whole containers at once, the objects of a kind as one table.

No specification is published; the layout is the one python-can reads, which follows T. Lorenz' Vector BLF. python-can
is the reference: a property test compares every frame with it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO, Final, cast

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from gateway.bus.frames import LAST_SECOND, empty_frames, in_order, payload_rows
from gateway.bus.logs.packed import open_log_file
from gateway.bus.logs.report import LogReject, LogReport, Selection
from gateway.errors import LogUnreadableError
from gateway.records import I64, U8, Bool, Frames
from gateway.units import NS_PER_S

MOST_BYTES: Final = 64 << 20  # chosen: of one container; Vector's tools fill containers with 128 kB
MOST_OBJECT_BYTES: Final = 1 << 20  # chosen: of one inside a container; what says more is damaged
JOINED_BYTES: Final = 1 << 20  # chosen: some 20,000 objects
_IsalError = cast(type[Exception], isal_zlib.error)

_SIGNATURE: Final = b"LOBJ"
_SIGNATURE_NUMBER: Final = int.from_bytes(_SIGNATURE, "little")
_PADDING: Final = 4  # at most so many bytes stand between an object and the next
_FILE_HEADER: Final = np.dtype(
    {
        "names": ["bytes", "file_bytes", "start"],
        "formats": ["<u4", "<u8", ("<u2", 8)],
        "offsets": [4, 16, 40],
        "itemsize": 72,
    }
)
_OBJECT: Final = np.dtype(
    {
        "names": ["header_bytes", "bytes", "flags", "stamp"],
        "formats": ["<u2", "<u4", "<u4", "<u8"],
        "offsets": [4, 8, 16, 24],
    }
)
_BASE_BYTES: Final = 16  # of an object's header without flags and stamp, all that a container has of it
_HEADER_BYTES: Final = {1: 32, 2: 40}  # by version
_TEN_MICROSECONDS: Final = 1  # flags: the stamp's unit; nanoseconds otherwise
_CONTAINER: Final = 10  # kinds of objects, as Vector numbers them, and so below
_ERROR_KINDS: Final = (2, 73, 104)  # CAN_ERROR, CAN_ERROR_EXT, CAN_FD_ERROR_64
_STORED, _DEFLATED = 0, 2  # methods of a container


@dataclass(frozen=True, slots=True)
class _Kind:
    """Where each kind of object stores its frame, and the flag of a remote one. An extension may follow the payload."""

    body: np.dtype[np.void]
    remote: int
    is_extensible: bool = False


_CLASSIC: Final = _Kind(
    np.dtype([("channel", "<u2"), ("flags", "u1"), ("length", "u1"), ("id", "<u4"), ("data", "u1", 8)]), 0x80
)
_FD: Final = _Kind(
    np.dtype(
        {
            "names": ["channel", "flags", "id", "length", "data"],
            "formats": ["<u2", "u1", "<u4", "u1", ("u1", 64)],
            "offsets": [0, 2, 4, 14, 20],
        }
    ),
    0x80,
)
_FD64: Final = _Kind(
    np.dtype(
        {
            "names": ["channel", "length", "id", "flags", "extension_at", "data"],
            "formats": ["u1", "u1", "<u4", "<u4", "u1", ("u1", 64)],
            "offsets": [0, 2, 4, 12, 35, 40],
        }
    ),
    0x10,
    is_extensible=True,
)
_KINDS: Final = {1: _CLASSIC, 86: _CLASSIC, 100: _FD, 101: _FD64}
_MARGIN: Final = _HEADER_BYTES[2] + max(kind.body.itemsize for kind in _KINDS.values())


def read_blf(selection: Selection) -> Iterator[Frames]:
    """The selected frames in order of arrival, in chunks, stamps to the microsecond as every other format's.

    Damaged parts are skipped and counted; a truncated file is read as far as it goes. Raises LogUnreadableError if it
    is no BLF at all.
    """
    with open_log_file(selection.path) as file:
        header = _header(selection.path, file)
        reader = _BlfReader(_start_ns(header), selection)
        yield from selection.given_out(map(reader.read, _joined(_contents(file, header, selection.report))))


def _header(path: Path, file: BinaryIO) -> np.void:
    head = file.read(_FILE_HEADER.itemsize)
    if len(head) < _FILE_HEADER.itemsize or not head.startswith(b"LOGG"):
        raise LogUnreadableError(f"{path}: cannot be read as .blf: it does not begin like one")
    return cast(np.void, np.frombuffer(head, _FILE_HEADER)[0])


def _start_ns(header: np.void) -> int:
    """The measurement's start; 0, and stamps are relative, if the file has none.

    Behind an impossible one no stamp is sound.
    """
    year, month, _, day, hour, minute, second, milli = map(int, header["start"])
    try:
        start = datetime(year, month, day, hour, minute, second, tzinfo=UTC)
    except ValueError:
        return 0
    start_ns, last_ns = int(start.timestamp()) * NS_PER_S + milli * 1_000_000, LAST_SECOND * NS_PER_S
    return start_ns if abs(start_ns) <= last_ns else last_ns


def _contents(file: BinaryIO, header: np.void, report: LogReport) -> Iterator[bytes | None]:
    """The contents of the containers, one after the other, None for a damaged one."""
    n_read = _FILE_HEADER.itemsize + len(file.read(max(0, int(header["bytes"]) - _FILE_HEADER.itemsize)))
    try:
        while len(head := file.read(_BASE_BYTES)) == _BASE_BYTES:
            n_bytes, kind = int.from_bytes(head[8:12], "little"), int.from_bytes(head[12:], "little")
            if not (head.startswith(_SIGNATURE) and _BASE_BYTES <= n_bytes <= MOST_BYTES):
                raise OSError("the file is damaged: no object begins where one should")
            body = file.read(n_bytes - _BASE_BYTES)
            n_read += _BASE_BYTES + len(body) + len(file.read(n_bytes % 4))
            yield _inflated(body, report) if kind == _CONTAINER else head + body
        if n_read < int(header["file_bytes"]):
            report.ended_early = "the file is cut off: shorter than its header says"
    except (EOFError, OSError) as fault:
        report.ended_early = str(fault)


def _joined(contents: Iterator[bytes | None]) -> Iterator[bytes | None]:
    """The same in pieces of at least JOINED_BYTES or up to a damaged one; calls of numpy cost as much for few objects
    as for many.
    """
    waiting: list[bytes] = []
    for content in contents:
        if content is not None:
            waiting.append(content)
        if content is None or sum(map(len, waiting)) >= JOINED_BYTES:
            yield b"".join(waiting)
            waiting = []
        if content is None:
            yield None
    yield b"".join(waiting)


def _inflated(body: bytes, report: LogReport) -> bytes | None:
    """The content of a container, as far as it is there."""
    method = int.from_bytes(body[:2], "little")
    try:
        if method in (_STORED, _DEFLATED):
            packed = body[16:]
            return packed if method == _STORED else isal_zlib.decompressobj().decompress(packed, MOST_BYTES)
    except _IsalError:
        pass
    report.reject(LogReject.DAMAGED_BLOCK)
    return None


class _BlfReader:
    """Reads content after content; an object may begin in one and end in the next."""

    def __init__(self, start_ns: int, selection: Selection) -> None:
        self._start_ns = start_ns
        self._selection = selection
        self._rest = b""
        self._is_torn = False  # what comes next may begin in the middle of an object

    def read(self, content: bytes | None) -> Frames:
        """The wanted frames of the objects that are complete by now."""
        if content is None:
            self._rest, self._is_torn = b"", True
            return empty_frames(self._selection.width)
        content = self._rest + content
        text = np.frombuffer(content + bytes(_MARGIN), np.uint8)
        begins, ends = _objects(text, len(content))
        self._count_gaps(begins, ends)
        n_whole = int(np.count_nonzero(ends <= len(content)))  # all, or all but the last
        behind = int(ends[-1]) if len(ends) else 0
        rest_at = max(behind, len(content) - _BASE_BYTES) if n_whole == len(ends) else int(begins[-1])
        self._rest = content[rest_at:]
        return self._frames(text, begins[:n_whole])

    def _count_gaps(self, begins: I64, ends: I64) -> None:
        """Count bytes between objects that are more than padding."""
        gaps = begins - np.concatenate(([0], ends[:-1]))[: len(begins)]
        if self._is_torn:
            gaps = gaps[1:]
            self._is_torn = not len(begins)
        self._selection.report.reject(LogReject.GARBLED, n=int(np.count_nonzero(gaps > _PADDING)))

    def _frames(self, text: U8, at: I64) -> Frames:
        codes = _column(text, at + 12, "<u4") << np.uint32(16) | _column(text, at + 6, "<u2")
        places: list[I64] = []
        parts: list[Frames] = []
        for code in np.unique(codes).tolist() if (codes != codes[:1]).any() else codes[:1].tolist():
            number, version = code >> 16, code & 0xFFFF
            rows = np.flatnonzero(codes == code)
            if number in _ERROR_KINDS:
                self._selection.report.error_frames += len(rows)
            elif number in _KINDS and version in _HEADER_BYTES:
                chosen, frames = self._frames_of(_KINDS[number], text, at[rows], _HEADER_BYTES[version])
                places.append(at[rows[chosen]])
                parts.append(frames)
            elif number in _KINDS:
                self._selection.report.reject(LogReject.GARBLED, n=len(rows))
        return in_order(places, parts, self._selection.width)

    def _frames_of(self, kind: _Kind, text: U8, at: I64, header_bytes: int) -> tuple[I64, Frames]:
        """The wanted rows of objects of one kind, and their frames."""
        bodies = _table(text, at + header_bytes, kind.body)
        can_id = bodies["id"] & np.uint32(0x9FFF_FFFF)
        channel = bodies["channel"].astype(np.int64) - 1  # as python-can counts them, from 0
        rows = self._selection.rows(can_id, channel, (bodies["flags"] & kind.remote) != 0)
        headers = _table(text, at[rows], _OBJECT)
        t_ns, is_sound = self._stamps(headers)
        rows, headers = rows[is_sound], headers[is_sound]
        bodies = bodies[rows]
        n_data = kind.body["data"].shape[0]
        n_there = headers["bytes"].astype(np.int64)
        if kind.is_extensible:
            n_there = np.where(bodies["extension_at"] == 0, n_there, bodies["extension_at"])
        n_there -= headers["header_bytes"] + np.int64(kind.body.itemsize - n_data)
        length = np.minimum(bodies["length"], n_data).astype(np.uint8)
        payload = payload_rows(bodies["data"], np.minimum(length, n_there), self._selection.width)
        return rows, Frames(t_ns[is_sound], can_id[rows], length, payload)

    def _stamps(self, headers: NDArray[np.void]) -> tuple[I64, Bool]:
        """Stamps (n,), and which of them are sound; the others are counted."""
        unit_ns = np.where(headers["flags"] == _TEN_MICROSECONDS, 10_000, 1).astype(np.uint64)
        is_sound: Bool = headers["stamp"] < (LAST_SECOND * NS_PER_S - self._start_ns) // unit_ns
        self._selection.report.reject(LogReject.BAD_TIME, n=int(np.count_nonzero(~is_sound)))
        since_ns = np.where(is_sound, headers["stamp"], 0) * unit_ns
        return (self._start_ns + since_ns.astype(np.int64) + 500) // 1000 * 1000, is_sound


def _objects(text: U8, n: int) -> tuple[I64, I64]:
    """Begin and end of the objects of ``text[:n]``, in order. The last may end beyond ``n``.

    Objects usually follow one another at multiples of four bytes; only where they do not, every byte is looked at.
    """
    begins, ends = _apart(text, n, 4 * np.flatnonzero(text[: n // 4 * 4].view("<u4") == _SIGNATURE_NUMBER))
    gaps = np.append(begins, n) - np.insert(ends, 0, 0)
    if (gaps[:-1] < _PADDING).all() and gaps[-1] < _BASE_BYTES:
        return begins, ends
    begins = np.flatnonzero(text[:n] == _SIGNATURE[0])
    return _apart(text, n, begins.compress(_column(text, begins, "<u4") == _SIGNATURE_NUMBER))


def _apart(text: U8, n: int, begins: I64) -> tuple[I64, I64]:
    """Begin and end of the objects whose signatures stand at ``begins``, without those within another object."""
    n_bytes = _column(text, begins + 8, "<u4").astype(np.int64)
    is_one = (n_bytes >= _BASE_BYTES) & (n_bytes <= MOST_OBJECT_BYTES) & (begins + _BASE_BYTES <= n)
    begins, n_bytes = begins.compress(is_one), n_bytes.compress(is_one)
    ends = begins + n_bytes
    if (begins[1:] < ends[:-1]).any():  # a signature within an object is payload
        steps, path, at = np.searchsorted(begins, ends).tolist(), [], 0
        while at < len(steps):
            path.append(at)
            at = steps[at]
        begins, ends = begins[path], ends[path]
    return begins, ends


def _column(text: U8, at: I64, number: str) -> NDArray[Any]:
    """The numbers that begin at ``at`` (n,), aligned or not."""
    size = np.dtype(number).itemsize
    return np.ndarray(len(text) - size + 1, number, buffer=text, strides=(1,))[at]


def _table(text: U8, at: I64, row: np.dtype[np.void]) -> NDArray[np.void]:
    """The rows that begin at ``at`` (n,)."""
    starts = np.ndarray(len(text) - row.itemsize + 1, f"V{row.itemsize}", buffer=text, strides=(1,))
    return starts[at].view(row)
