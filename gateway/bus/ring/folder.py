"""The directory of the ring log: segments; the oldest are removed when a new block needs room."""

import errno
import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

from gateway.bus.ring.segment import block_of, mended_segment, name_of, names_in, number_of, with_block
from gateway.files.kept import create_plain, open_plain, opened_folder, write_all
from gateway.log import Event, log_event
from gateway.status import Segment
from gateway.units import S_PER_DAY

SEGMENT_S: Final = 3600.0  # chosen: of frames in one file to fetch
SEGMENT_SHARE: Final = 1 / 8  # chosen: of the ring at most in one segment, and so in one removal


@dataclass(frozen=True, slots=True)
class RingLimits:
    """Limits of the ring: bytes on disk and bytes written per day; ``free_bytes`` of the disk stay free.

    ``block_s`` seconds of frames are written at a time; a power cut loses as much.
    """

    max_bytes: int
    max_daily_bytes: int
    free_bytes: int
    block_s: float


@dataclass(frozen=True, slots=True)
class _Growing:
    """The newest segment, still written to."""

    name: str
    file: BinaryIO
    since_s: float


class RingFolder:
    """One directory. Written by one thread; ``segments`` and ``open`` may be called from any."""

    def __init__(self, directory: Path, limits: RingLimits, clock_s: Callable[[], float]) -> None:
        self.directory = directory
        self._limits = limits
        self._clock_s = clock_s
        self._segments: tuple[Segment, ...] | None = None  # replaced, never changed; None: to be read (again)
        self._growing: _Growing | None = None
        self._day: int | None = None
        self.n_bytes_today = 0

    def segments(self) -> tuple[Segment, ...]:
        """The segments, oldest first, as far as their whole blocks reach."""
        return self._segments or ()

    def open(self, name: str) -> tuple[BinaryIO, int] | None:
        """A segment to read from and the bytes of its whole blocks; None if there is none of that name.

        It can be read to its end even if the ring removes it meanwhile. Raises OSError if the disk fails.
        """
        segment = next((one for one in self.segments() if one.name == name), None)
        if segment is None:
            return None
        with opened_folder(self.directory) as folder:
            try:
                return open_plain(folder, segment.name), segment.n_bytes
            except FileNotFoundError:  # removed just now
                return None

    def read(self) -> None:
        """Inspect the directory once: an unfinished block is cut off, this day's bytes are counted.

        Raises OSError.
        """
        self.directory.mkdir(parents=True, exist_ok=True, mode=0o750)
        if self._segments is None:
            with opened_folder(self.directory) as folder:
                self._segments = self._found(folder)

    def is_over_day(self, n_bytes: int) -> bool:
        """Whether so many bytes more are too many for this day."""
        today = int(self._clock_s() // S_PER_DAY)
        if today != self._day:
            self._day, self.n_bytes_today = today, 0
        return self.n_bytes_today + n_bytes > self._limits.max_daily_bytes

    def append(self, content: bytes) -> None:
        """One more block, on disk when this returns. Raises OSError; the next call then begins a new segment."""
        try:
            self.read()
            with opened_folder(self.directory) as folder:
                self._require_room(folder, len(content))
                self._let_go(folder, self._limits.max_bytes - len(content))
                growing = self._to_grow(folder, content)
                self.n_bytes_today += len(content)
                write_all(growing.file, content)
                os.fdatasync(growing.file.fileno())
        except OSError:
            self.close()
            self._segments = None
            raise
        *older, newest = self.segments()
        self._segments = (*older, with_block(newest, block_of(content, newest.name)))

    def close(self) -> None:
        if self._growing is not None:
            with suppress(OSError):
                self._growing.file.close()
            self._growing = None

    def _found(self, folder: int) -> tuple[Segment, ...]:
        names = names_in(folder)
        if self._day is None:
            self._day = int(self._clock_s() // S_PER_DAY)
            self.n_bytes_today = sum(_size_if_of_day(folder, name, self._day) for name in names)
        found = []
        for name in names:
            segment, n_cut = mended_segment(folder, name, is_newest=name == names[-1])
            if n_cut:
                log_event(Event.RECORD_MENDED, segment=name, n_bytes_cut=n_cut)
            if segment.n_blocks:
                found.append(segment)
            else:
                os.unlink(name, dir_fd=folder)
        return tuple(found)

    def _require_room(self, folder: int, n_bytes: int) -> None:
        room = os.statvfs(folder)
        if room.f_bavail * room.f_frsize < self._limits.free_bytes + n_bytes:
            raise OSError(errno.ENOSPC, "less room is left on the disk than [record] free_mb")

    def _let_go(self, folder: int, most_bytes: int) -> None:
        """Remove the oldest until at most so many bytes remain."""
        while (kept := self.segments()) and sum(segment.n_bytes for segment in kept) > most_bytes:
            if self._growing is not None and kept[0].name == self._growing.name:
                self.close()
            with suppress(FileNotFoundError):
                os.unlink(kept[0].name, dir_fd=folder)
            self._segments = kept[1:]

    def _to_grow(self, folder: int, content: bytes) -> _Growing:
        """The segment for one more block: the newest while it is young and small, else a new one."""
        kept = self.segments()
        if self._growing is not None:
            is_young = time.monotonic() - self._growing.since_s < SEGMENT_S
            if is_young and kept[-1].n_bytes + len(content) <= SEGMENT_SHARE * self._limits.max_bytes:
                return self._growing
            self.close()
        last = number_of(kept[-1].name) if kept else None
        name = name_of(1 + (last or 0), block_of(content, "").first_ns)
        self._growing = _Growing(name, create_plain(folder, name, 0o640), time.monotonic())
        self._segments = (*kept, Segment(name))
        os.fsync(folder)  # the new name, too, outlives a power cut
        return self._growing


def _size_if_of_day(folder: int, name: str, day: int) -> int:
    """Bytes of a segment that was last written on this day, 0 for others."""
    status = os.stat(name, dir_fd=folder, follow_symlinks=False)
    return status.st_size if status.st_mtime // S_PER_DAY == day else 0
