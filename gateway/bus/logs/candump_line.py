"""Lines of a candump log: those of a common shape read all at once, the others exactly, one by one."""

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import can
import numpy as np
from numpy.typing import NDArray

from gateway.bus.frames import LAST_EXTENDED, LAST_SECOND, LAST_STANDARD, ExactStamp
from gateway.bus.logs.log_report import LogReject
from gateway.bus.signals.mapping import CAN_FD_BYTES, CLASSIC_BYTES
from gateway.records import EXTENDED_ID, F64, I64, U8, U32, Bool, Frames
from gateway.units import NS_PER_S

_TIME = re.compile(rb"\((\d{1,15})\.(\d{1,9})\)\s")
_LINE = re.compile(
    rb"\((?P<seconds>\d{1,15})\.(?P<fraction>\d{1,9})\)\s+(?P<channel>[!-~]+)\s+(?P<id>[0-9A-Fa-f]+)"
    rb"#(?P<fd>#[0-9A-Fa-f])?(?P<payload>[^\s_]*)(?:_[0-9A-Fa-f])?(?:\s+[RT])?"
)
_REMOTE = re.compile(rb"[Rr][0-9A-Fa-f]?")
_ERROR_FLAG: Final = 0x2000_0000  # CAN_ERR_FLAG of linux/can.h


def read_line(line: bytes) -> can.Message | LogReject:
    """The frame of a line such as ``(1627274455.012500) can1 009#0011223344556677``, or why there is none.

    Hexadecimal digits of either case, stamps of any width, R/T suffixes, CAN FD (``##`` and a flags
    digit) and the ``_`` length code of 8-byte frames are understood. An identifier is a 29-bit one
    when it has 8 digits. Remote and error frames are given without their payload.
    """
    line = line.strip(b"\0 \t\r\n")  # a file hole leaves NULs before a sound line
    match = _LINE.fullmatch(line)
    if match is None:
        return _why_not(line)
    seconds, can_id, is_extended = int(match["seconds"]), int(match["id"], 16), len(match["id"]) == 8
    if seconds > LAST_SECOND:
        return LogReject.BAD_TIME
    is_error = is_extended and _ERROR_FLAG <= can_id < 2 * _ERROR_FLAG
    if not is_error and (can_id > (LAST_EXTENDED if is_extended else LAST_STANDARD) or len(match["id"]) not in (3, 8)):
        return LogReject.BAD_ID
    is_remote = _REMOTE.fullmatch(match["payload"]) is not None
    payload = b"" if is_error or is_remote else _payload(match["payload"], is_fd=match["fd"] is not None)
    if isinstance(payload, LogReject):
        return payload
    return can.Message(
        timestamp=ExactStamp(seconds * NS_PER_S + int(match["fraction"].ljust(9, b"0"))),
        channel=match["channel"].decode(),
        arbitration_id=can_id,
        is_extended_id=is_extended,
        is_error_frame=is_error,
        is_remote_frame=is_remote,
        is_fd=len(payload) > CLASSIC_BYTES,
        data=payload,
    )


def _payload(digits: bytes, *, is_fd: bool) -> bytes | LogReject:
    try:
        payload = bytes.fromhex(digits.decode("ascii"))
    except UnicodeDecodeError:
        return LogReject.BAD_PAYLOAD
    except ValueError:
        is_hex = re.fullmatch(rb"[0-9A-Fa-f]*", digits)
        return LogReject.HALF_BYTE if is_hex else LogReject.BAD_PAYLOAD
    return payload if len(payload) <= (CAN_FD_BYTES if is_fd else CLASSIC_BYTES) else LogReject.TOO_LONG


def _why_not(line: bytes) -> LogReject:
    if b"\0" in line:
        return LogReject.NUL_BYTES
    if b"#" not in line:
        return LogReject.NO_FRAME
    return LogReject.GARBLED if _TIME.match(line) else LogReject.BAD_TIME


_SHAPE = re.compile(
    rb"\((\d{1,15})\.(\d{1,9})\) ([!-~]{1,32}) ([0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})(#|##[0-9A-Fa-f])"
    rb"((?:[0-9A-Fa-f]{2})*)((?: [RT])?\r?\n)"
)
_NOT_HEX: Final = 0xFF  # no digit has so much
_NIBBLES: Final = np.full(256, _NOT_HEX, np.uint8)
for _digit in b"0123456789abcdefABCDEF":
    _NIBBLES[_digit] = int(chr(_digit), 16)


@dataclass(frozen=True)
class LineShape:
    """The widths of a line's parts and the bytes that never change within the shape."""

    n_seconds: int
    n_fraction: int
    channel: bytes
    n_id: int
    is_fd: bool
    n_payload: int
    tail: bytes

    @cached_property
    def hash_at(self) -> int:
        """Column of the first ``#``; column 0 is the newline before the line."""
        return 1 + 1 + self.n_seconds + 1 + self.n_fraction + 2 + len(self.channel) + 1 + self.n_id

    @cached_property
    def template(self) -> U8:
        """The whole line with NULs in place of digits."""
        time = b"\0" * self.n_seconds + b"." + b"\0" * self.n_fraction
        mark = b"##\0" if self.is_fd else b"#"
        head = b"\n(" + time + b") " + self.channel + b" " + b"\0" * self.n_id + mark
        return np.frombuffer(head + b"\0" * (2 * self.n_payload) + self.tail, np.uint8)

    @cached_property
    def literals(self) -> NDArray[np.intp]:
        """Columns whose byte never changes."""
        return np.flatnonzero(self.template)

    @cached_property
    def stamp_weights(self) -> tuple[F64, F64]:
        """The weight of each digit of the seconds and of the fraction, in s and ns. Both sums are exact in a double."""
        return _powers_of_ten(self.n_seconds - 1, self.n_seconds), _powers_of_ten(8, self.n_fraction)

    def read(self, text: U8, hashes: I64, width: int) -> tuple[Bool, Frames]:
        """Which of the lines around ``hashes`` (n,) have this shape, and the frames of those that do.

        Payload beyond ``width`` bytes is cut off; the length is that of the line.
        """
        n_columns = len(self.template)
        starts = np.ndarray(len(text) - n_columns + 1, f"V{n_columns}", buffer=text, strides=(1,))
        rows = starts[hashes - self.hash_at].view(np.uint8).reshape(-1, n_columns)
        fits = (rows[:, self.literals] == self.template[self.literals]).all(axis=1)
        rows = rows if fits.all() else rows.compress(fits, axis=0)
        lines = np.ascontiguousarray(rows.T)  # one row a column of the line: every step below runs along one
        t_ns, has_stamp = self._stamps(lines)
        can_id, has_id = self._identifiers(lines)
        payload, has_payload = self._payloads(lines, width)
        sound = has_stamp & has_id & has_payload
        fits[fits] = sound
        length = np.full(int(np.count_nonzero(sound)), self.n_payload, np.uint8)
        if sound.all():
            return fits, Frames(t_ns, can_id, length, payload)
        return fits, Frames(t_ns[sound], can_id[sound], length, payload[sound])

    def _stamps(self, lines: U8) -> tuple[I64, Bool]:
        dot = 2 + self.n_seconds
        digits = np.concatenate((lines[2:dot], lines[dot + 1 : dot + 1 + self.n_fraction])) - np.uint8(ord("0"))
        seconds_weights, fraction_weights = self.stamp_weights
        seconds = seconds_weights @ digits[: self.n_seconds].astype(np.float64)
        fraction_ns = fraction_weights @ digits[self.n_seconds :].astype(np.float64)
        t_ns = seconds.astype(np.int64) * NS_PER_S + fraction_ns.astype(np.int64)
        return t_ns, (np.maximum.reduce(digits) <= 9) & (seconds <= LAST_SECOND)

    def _identifiers(self, lines: U8) -> tuple[U32, Bool]:
        nibbles = _NIBBLES.take(lines[self.hash_at - self.n_id : self.hash_at])
        can_id = np.zeros(lines.shape[1], np.uint32)
        for row in nibbles:
            can_id = (can_id << np.uint32(4)) | row
        last = np.uint32(0x1FFF_FFFF if self.n_id == 8 else 0x7FF)
        is_sound = (np.maximum.reduce(nibbles) != _NOT_HEX) & (can_id <= last)
        return can_id | np.uint32(EXTENDED_ID if self.n_id == 8 else 0), is_sound

    def _payloads(self, lines: U8, width: int) -> tuple[U8, Bool]:
        first = self.hash_at + (3 if self.is_fd else 1)
        nibbles = _NIBBLES.take(lines[first : first + 2 * self.n_payload])
        payload = np.zeros((lines.shape[1], width), np.uint8)
        kept = min(self.n_payload, width)
        payload[:, :kept] = ((nibbles[0::2] << np.uint8(4)) | nibbles[1::2])[:kept].T
        is_sound: Bool = np.maximum.reduce(nibbles, initial=0) != _NOT_HEX
        return payload, is_sound


def _powers_of_ten(highest: int, n: int) -> F64:
    return np.array([10.0 ** (highest - i) for i in range(n)])


def learn_shape(line: bytes) -> LineShape | None:
    """The shape of a sound line (its newline included), or None if it needs the exact path."""
    match = _SHAPE.fullmatch(line)
    if match is None:
        return None
    seconds, fraction, channel, identifier, mark, payload, tail = match.groups()
    is_fd = len(mark) > 1
    if len(payload) > (128 if is_fd else 16):
        return None
    return LineShape(len(seconds), len(fraction), channel, len(identifier), is_fd, len(payload) // 2, tail)
