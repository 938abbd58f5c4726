"""One line of a candump log, read exactly: the slow path for wanted lines of unusual shape."""

import re
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from gateway.bus.frames import LAST_SECOND
from gateway.bus.logs.report import LogReject
from gateway.records import EXTENDED_ID
from gateway.units import NS_PER_S

_TIME = re.compile(rb"\((\d{1,15})\.(\d{1,9})\)\s")
_LINE = re.compile(
    rb"\((?P<seconds>\d{1,15})\.(?P<fraction>\d{1,9})\)\s+(?P<channel>[!-~]+)\s+(?P<id>[0-9A-Fa-f]+)"
    rb"#(?P<fd>#[0-9A-Fa-f])?(?P<payload>[^\s_]*)(?:_[0-9A-Fa-f])?(?:\s+[RT])?"
)
_REMOTE = re.compile(rb"[Rr][0-9A-Fa-f]?")
_ERROR_FLAG: Final = 0x2000_0000
_LAST_EXTENDED: Final = 0x1FFF_FFFF
_LAST_STANDARD: Final = 0x7FF


class NotData(Enum):
    """A sound line that carries no payload."""

    REMOTE_FRAME = auto()
    ERROR_FRAME = auto()


@dataclass(frozen=True, slots=True)
class LineFrame:
    """A data frame as one line states it."""

    t_ns: int
    channel: bytes
    can_id: int
    payload: bytes


def read_line(line: bytes) -> LineFrame | NotData | LogReject:
    """The frame of a line such as ``(1627274455.012500) can1 009#0011223344556677``, or why there is none.

    Hexadecimal digits of either case, stamps of any width, R/T suffixes, CAN FD (``##`` and a flags
    digit) and the ``_`` length code of 8-byte frames are understood. An identifier is a 29-bit one
    when it has 8 digits.
    """
    line = line.strip(b"\0 \t\r\n")  # a file hole leaves NULs before a sound line
    match = _LINE.fullmatch(line)
    if match is None:
        return _why_not(line)
    t_ns = stamp_ns(match["seconds"], match["fraction"])
    if t_ns is None:
        return LogReject.BAD_TIME
    can_id = _identifier(match["id"])
    if not isinstance(can_id, int):
        return can_id
    if _REMOTE.fullmatch(match["payload"]):
        return NotData.REMOTE_FRAME
    payload = _payload(match["payload"], is_fd=match["fd"] is not None)
    return LineFrame(t_ns, match["channel"], can_id, payload) if isinstance(payload, bytes) else payload


def stamp_ns(seconds: bytes, fraction: bytes) -> int | None:
    """Digits before and after the point as integer nanoseconds, exactly; None beyond LAST_SECOND."""
    whole = int(seconds)
    return None if whole > LAST_SECOND else whole * NS_PER_S + int(fraction.ljust(9, b"0"))


def _identifier(digits: bytes) -> int | NotData | LogReject:
    can_id = int(digits, 16)
    if len(digits) == 8:
        if can_id & _ERROR_FLAG and can_id < 2 * _ERROR_FLAG:
            return NotData.ERROR_FRAME
        return can_id | EXTENDED_ID if can_id <= _LAST_EXTENDED else LogReject.BAD_ID
    return can_id if len(digits) == 3 and can_id <= _LAST_STANDARD else LogReject.BAD_ID


def _payload(digits: bytes, *, is_fd: bool) -> bytes | LogReject:
    try:
        payload = bytes.fromhex(digits.decode("ascii"))
    except UnicodeDecodeError:
        return LogReject.BAD_PAYLOAD
    except ValueError:
        is_hex = re.fullmatch(rb"[0-9A-Fa-f]*", digits)
        return LogReject.HALF_BYTE if is_hex else LogReject.BAD_PAYLOAD
    return payload if len(payload) <= (64 if is_fd else 8) else LogReject.TOO_LONG


def _why_not(line: bytes) -> LogReject:
    if b"\0" in line:
        return LogReject.NUL_BYTES
    if b"#" not in line:
        return LogReject.NO_FRAME
    return LogReject.GARBLED if _TIME.match(line) else LogReject.BAD_TIME
