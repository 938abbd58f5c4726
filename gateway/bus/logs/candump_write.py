"""Frames to a candump log, text or gzip, whole columns at once."""

from pathlib import Path
from typing import Any, BinaryIO, Final, cast

import numpy as np
from isal import igzip
from numpy.typing import NDArray

from gateway.bus.frames import take
from gateway.records import EXTENDED_ID, I64, U8, Frames
from gateway.units import NS_PER_S

BEST_COMPRESSION: Final = 3  # of isal's 0 to 3
CHUNK_FRAMES: Final = 65_536  # chosen: text of so many in memory, some megabytes
MICROSECOND_DIGITS: Final = 6  # as candump -L writes them
NANOSECOND_DIGITS: Final = 9
_HEX: Final = np.frombuffer(b"0123456789ABCDEF", np.uint8)


def write_candump(frames: Frames, channel: str, path: Path | str) -> None:
    """Write frames as ``candump -L`` does, in the order given; gzip if the name ends in .gz.

    Stamps have microseconds, like candump's, or nanoseconds if any stamp needs them. Raises OSError.
    """
    path = Path(path)
    with _open(path) as file:
        append_candump(frames, channel, file)


def append_candump(frames: Frames, channel: str, file: BinaryIO) -> None:
    digits = NANOSECOND_DIGITS if np.any(frames.t_ns % 1000) else MICROSECOND_DIGITS
    for begin in range(0, len(frames), CHUNK_FRAMES):
        file.write(_lines(take(frames, slice(begin, begin + CHUNK_FRAMES)), channel.encode(), digits))


def _open(path: Path) -> BinaryIO:
    if path.suffix.lower() != ".gz":
        return path.open("wb")
    return cast(BinaryIO, igzip.IGzipFile(path, "wb", compresslevel=BEST_COMPRESSION))  # type: ignore[no-untyped-call] # isal has no types


def _lines(frames: Frames, channel: bytes, digits: int) -> bytes:
    """The lines of some frames: a table of bytes as wide as the longest line, unused places left out at the end."""
    n, t_ns, can_id, length, payload = len(frames), frames.t_ns, frames.can_id, frames.length, frames.payload
    is_extended = (can_id & EXTENDED_ID) != 0
    number = (can_id & np.uint32(~EXTENDED_ID & 0xFFFF_FFFF))[:, None]
    identifier = _HEX[(number >> np.arange(28, -1, -4, dtype=np.uint32)) & np.uint32(0xF)]
    is_fd = length > 8
    widest = int(length.max(initial=0))
    nibbles = np.stack((payload[:, :widest] >> 4, payload[:, :widest] & 0xF), axis=2).reshape(n, 2 * widest)
    columns: list[tuple[NDArray[np.uint8], Any]] = [
        (_literal(b"(", n), True),
        (_decimal(t_ns // NS_PER_S, 10), True),
        (_literal(b".", n), True),
        (_decimal(t_ns % NS_PER_S // 10 ** (9 - digits), digits), True),
        (_literal(b") " + channel + b" ", n), True),
        (identifier[:, :5], is_extended),
        (identifier[:, 5:], True),
        (_literal(b"#", n), True),
        (_literal(b"#0", n), is_fd),
        (_HEX[nibbles], np.arange(2 * widest) < 2 * length.astype(np.int64)[:, None]),
        (_literal(b"\n", n), True),
    ]
    text = np.concatenate([part for part, _ in columns], axis=1)
    used = np.concatenate([_spread(mask, part) for part, mask in columns], axis=1)
    return bytes(text[used])


def _spread(mask: Any, part: U8) -> NDArray[np.bool_]:
    mask = np.asarray(mask, np.bool_)
    return np.broadcast_to(mask[:, None] if mask.ndim == 1 else mask, part.shape)


def _literal(text: bytes, n: int) -> U8:
    return np.broadcast_to(np.frombuffer(text, np.uint8), (n, len(text)))


def _decimal(numbers: I64, digits: int) -> U8:
    places = 10 ** np.arange(digits - 1, -1, -1, dtype=np.int64)
    return (numbers[:, None] // places % 10 + ord("0")).astype(np.uint8)
