"""The frames of a live channel on disk: the ring log of the service, and a recording into one file."""

import errno
import gzip
import logging
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO, Final, cast

import can

from gateway.bus.frames import message_of, widened
from gateway.bus.live.source import LiveSource
from gateway.bus.logs.candump_write import append_candump
from gateway.log import Event, log_event
from gateway.part import STOP_WITHIN_S, ThreadPart
from gateway.records import Frames
from gateway.status import RecordStatus

WRITE_S: Final = 2.0  # chosen: frames gather this long before they are written; a kill loses as much
HELD_FRAMES: Final = 262_144  # chosen: most frames in memory while the disk fails: some MB
RETRY_S: Final = 30.0  # chosen: pause after a fault of the disk
N_FILES: Final = 8  # chosen: the ring is divided into so many; the oldest is removed as a whole
CURRENT: Final = "current.log"


class _Files(can.SizedRotatingLogger):
    """python-can's rotating logger over numbered files; their order does not depend on the clock."""

    def __init__(self, directory: Path, channel: str, max_bytes: int) -> None:
        """Raises OSError."""
        directory.mkdir(parents=True, exist_ok=True, mode=0o750)
        self._directory, self._most_bytes = directory, max_bytes
        if (directory / CURRENT).exists():  # of an earlier run: the logger would begin it anew
            (directory / CURRENT).rename(self._next_name())
        super().__init__(directory / CURRENT, max_bytes // N_FILES, channel=channel)
        self.namer = lambda _: self._next_name()
        self.let_go()

    def _get_new_writer(self, filename: Any) -> Any:
        writer = cast(can.CanutilsLogWriter, super()._get_new_writer(filename))
        writer.last_timestamp = 0.0  # else it replaces the stamps of a clock that stepped back
        return writer

    def do_rollover(self) -> None:
        super().do_rollover()
        self.let_go()

    def let_go(self) -> None:
        """Remove the oldest files beyond the limit."""
        *closed, _ = files = self.files()
        n_bytes = sum(path.stat().st_size for path in files) + self.max_bytes
        for path in closed:
            if n_bytes > self._most_bytes:
                n_bytes -= path.stat().st_size
                path.unlink()

    def files(self) -> list[Path]:
        """Oldest first."""
        return sorted(path for path in self._directory.glob("*.log") if path.stem.isdecimal() or path.name == CURRENT)

    def _next_name(self) -> str:
        numbers = [int(path.stem) for path in self.files() if path.name != CURRENT]
        return str(self._directory / f"{max(numbers, default=0) + 1:08d}.log")


class RingLog(ThreadPart):
    """Records frames on disk, within a size. One thread hands them over and never waits; its own thread writes."""

    NAME = "recorder"

    def __init__(
        self, directory: Path, channel: str, max_bytes: int, free_bytes: int,
        *, write_s: float = WRITE_S, retry_s: float = RETRY_S,
    ) -> None:  # fmt: skip
        """``channel`` is the frames' channel name in the log. ``free_bytes`` of the disk stay free."""
        super().__init__("ring-log")
        channel = "".join("_" if char.isspace() or not char.isprintable() else char for char in channel) or "can"
        self._begin: Callable[[], _Files] = lambda: _Files(directory, channel, max_bytes)
        self._directory, self._free_bytes = directory, free_bytes
        self._write_s, self._retry_s = write_s, retry_s
        self._changed = threading.Condition()
        self._held: list[Frames] = []
        self._files: _Files | None = None
        self._n_held = self._n_written = self._n_dropped = self._size_bytes = 0
        self._fault: str | None = None

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        """Write the frames in memory, if the disk accepts them, and end."""
        with self._changed:
            self._stopping.set()
            self._changed.notify_all()
        super().stop(within_s)
        if self.is_alive():
            fault = "the disk was too slow for the stop"
            log_event(Event.RECORD_REFUSED, level=logging.WARNING, fault=fault, n_frames_held=self._n_held)

    def put(self, frames: Frames) -> None:
        """Accept frames for writing; frames without room are counted. Never waits for the disk."""
        with self._changed:
            if self._n_held + len(frames) > HELD_FRAMES:
                self._n_dropped += len(frames)
            elif len(frames):
                self._held.append(frames)
                self._n_held += len(frames)
                self._changed.notify_all()

    def status(self) -> RecordStatus:
        return RecordStatus(self._n_written, self._n_held, self._n_dropped, self._size_bytes, self._fault)

    @property
    def fault(self) -> str | None:
        """Why frames are not being recorded, for people; None while they are."""
        if self._fault is None:
            return None
        return f"frames are not being recorded ({self._fault}); {self._n_dropped} are lost so far, weighing goes on"

    def _run(self) -> None:
        try:
            while self._wait_for_frames():
                self._write_held()
        except Exception as failure:  # noqa: BLE001 - a failure of the recording must not end the weighing
            self.failure = failure
        self._close()

    def _wait_for_frames(self) -> bool:
        """Wait until there are frames, and some time for more; False at a stop with nothing left to write."""
        with self._changed:
            self._changed.wait_for(lambda: self._held or self._stopping.is_set())
            self._changed.wait_for(self._stopping.is_set, self._write_s)
            return bool(self._held)

    def _write_held(self) -> None:
        """Write what is held. If the disk refuses before the first frame all stay held, else they count as lost."""
        held, is_begun = list(self._held), False
        n = sum(map(len, held))
        try:
            self._require_room()
            self._files = files = self._files or self._begin()
            is_begun = True
            for frames in held:
                wide = widened(frames, int(frames.length.max()))  # a signal map keeps no more than it decodes
                for row in range(len(wide)):
                    files.on_message_received(message_of(wide, row))
            cast(Any, files.writer).file.flush()
            self._size_bytes = sum(path.stat().st_size for path in files.files())
        except OSError as refusal:
            self._close()
            self._note(f"{self._directory}: {refusal.strerror or refusal}")
            with self._changed:
                self._changed.wait_for(self._stopping.is_set, self._retry_s)
            if not (is_begun or self._stopping.is_set()):
                return
            self._n_dropped += n
        else:
            self._n_written += n
            self._note(None)
        with self._changed:
            del self._held[: len(held)]
            self._n_held -= n

    def _require_room(self) -> None:
        folder = next(folder for folder in (self._directory, *self._directory.parents) if folder.exists())
        room = os.statvfs(folder)
        if room.f_bavail * room.f_frsize < self._free_bytes:
            raise OSError(errno.ENOSPC, "less room is left on the disk than [record] free_mb")

    def _close(self) -> None:
        if self._files is not None:
            with suppress(OSError):
                self._files.stop()
        self._files = None

    def _note(self, fault: str | None) -> None:
        """Log a fault, and its end, once."""
        if fault is not None and fault != self._fault:
            log_event(Event.RECORD_REFUSED, level=logging.WARNING, fault=fault)
        if fault is None and self._fault is not None:
            log_event(Event.RECORD_RECOVERED, n_frames_dropped=self._n_dropped)
        self._fault = fault


FLUSH_S: Final = 10.0  # chosen: a killed recording loses as much
DRAIN_S: Final = 0.2  # chosen: how soon a stop takes effect


def record_to_file(
    source: LiveSource,
    channel: str,
    path: Path,
    stop: threading.Event,
    *,
    duration_s: float | None = None,
    on_frames: Callable[[int], None] = lambda n: None,
) -> int:
    """Listen until ``stop`` or ``duration_s`` -> frames written, as gzip if ``path`` ends so. Raises OSError.

    ``path`` must not exist yet.
    """
    n_written, due_s = 0, time.monotonic() + FLUSH_S
    packed = path.suffix.lower() == ".gz"
    with cast(BinaryIO, gzip.open(path, "xb", 6)) if packed else path.open("xb") as file:
        for frames in _received(source, stop, duration_s):
            if frames is not None:
                append_candump(widened(frames, int(frames.length.max())), channel, file)
                n_written += len(frames)
                on_frames(n_written)
            if time.monotonic() >= due_s:
                file.flush()
                due_s = time.monotonic() + FLUSH_S
    return n_written


def _received(source: LiveSource, stop: threading.Event, duration_s: float | None) -> Iterator[Frames | None]:
    """The frames of a source until ``stop`` or so long, then those still in its inbox; None after a quiet while."""
    end_s = None if duration_s is None else time.monotonic() + duration_s
    source.start()
    try:
        while not (stop.is_set() or (end_s is not None and time.monotonic() >= end_s) or source.failure):
            yield source.inbox.drain(DRAIN_S)
    finally:
        source.stop()
    while (frames := source.inbox.drain(0.0)) is not None:
        yield frames
