"""The ring log: the frames of a live channel on disk, within a size, by python-can's rotating logger."""

import errno
import logging
import shutil
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, cast

import can

from gateway.bus.frames import message_of, widened
from gateway.log import Event, log_event
from gateway.part import STOP_WITHIN_S, ThreadPart
from gateway.records import Frames
from gateway.status import RecordStatus

WRITE_S: Final = 2.0  # chosen: frames gather this long before they are written; a kill loses as much
HELD_FRAMES: Final = 262_144  # chosen: most frames in memory while the disk fails: some MB
N_FILES: Final = 8  # chosen: the ring is divided into so many; the oldest is removed as a whole


class _Files(can.SizedRotatingLogger):
    """python-can's rotating logger over numbered files; their order does not depend on the clock. Raises OSError."""

    def __init__(self, directory: Path, channel: str, max_bytes: int) -> None:
        self._directory, self._most_bytes = directory, max_bytes
        super().__init__(directory / "00000000.log", max_bytes // N_FILES, channel=channel)  # a name never used

    def _get_new_writer(self, filename: Any) -> Any:
        """Remove empty files, and the oldest until the next one has room; open the next."""
        last, excess = 0, self.size_bytes() - self._most_bytes + self._most_bytes // N_FILES
        for path in self._files():
            last, n_bytes = int(path.stem), path.stat().st_size
            if excess > 0 or not n_bytes:
                excess -= n_bytes
                path.unlink()
        writer = cast(can.CanutilsLogWriter, super()._get_new_writer(self._directory / f"{last + 1:08d}.log"))
        writer.last_timestamp = 0.0  # else it replaces the stamps of a clock that stepped back
        return writer

    def _files(self) -> list[Path]:
        """Oldest first."""
        return sorted(path for path in self._directory.glob("*.log") if path.stem.isdecimal())

    def size_bytes(self) -> int:
        return sum(path.stat().st_size for path in self._files())


class RingLog(ThreadPart):
    """Records frames on disk, within a size. One thread hands them over and never waits; its own thread writes."""

    NAME = "recorder"

    def __init__(
        self, directory: Path, channel: str, max_bytes: int, free_bytes: int, *, write_s: float = WRITE_S
    ) -> None:
        """``channel`` is the frames' channel name in the log. ``free_bytes`` of the disk stay free."""
        super().__init__("ring-log")
        channel = "".join("_" if char.isspace() or not char.isprintable() else char for char in channel) or "can"
        self._ring, self._free_bytes, self._write_s = (directory, channel, max_bytes), free_bytes, write_s
        self._held: deque[Frames] = deque()
        self._files: _Files | None = None
        self._n_put = self._n_refused = 0  # by the thread that hands over
        self._n_written = self._n_lost = self._size_bytes = 0  # by the thread that writes
        self._fault: str | None = None

    def stop(self, within_s: float = STOP_WITHIN_S) -> None:
        """Write the frames in memory, if the disk accepts them, and end."""
        super().stop(within_s)
        if self.is_alive():
            fault, n_held = "the disk was too slow for the stop", self.status().n_frames_held
            log_event(Event.RECORD_REFUSED, level=logging.WARNING, fault=fault, n_frames_held=n_held)

    def put(self, frames: Frames) -> None:
        """Accept frames for writing; frames without room are counted. Never waits for the disk."""
        if self.status().n_frames_held + len(frames) > HELD_FRAMES:
            self._n_refused += len(frames)
        elif len(frames):
            self._n_put += len(frames)
            self._held.append(frames)

    def status(self) -> RecordStatus:
        n_written, n_lost = self._n_written, self._n_lost
        n_held, n_dropped = self._n_put - n_written - n_lost, n_lost + self._n_refused
        return RecordStatus(n_written, n_held, n_dropped, self._size_bytes, self._fault)

    def _work(self) -> None:
        try:
            is_stopping = False
            while not is_stopping:
                is_stopping = self._stopping.wait(self._write_s)
                if self._held:
                    self._write_held()
                    self._succeeded()
            self._n_lost = self._n_put - self._n_written  # at a stop, what the disk does not take is lost
        finally:
            self._close()

    def _write_held(self) -> None:
        """Write what is held. If the disk refuses before the first frame all stay held, else they count as lost."""
        begun: list[Frames] = []
        directory = self._ring[0]
        try:
            directory.mkdir(parents=True, exist_ok=True, mode=0o750)
            if shutil.disk_usage(directory).free < self._free_bytes:
                raise OSError(errno.ENOSPC, "less room is left on the disk than [record] free_mb")
            self._files = files = self._files or _Files(*self._ring)
            begun = list(self._held)
            for frames in begun:
                wide = widened(frames, int(frames.length.max()))  # a signal map keeps no more than it decodes
                for row in range(len(wide)):
                    files.on_message_received(message_of(wide, row))
            cast(Any, files.writer).file.flush()
            self._size_bytes = files.size_bytes()
            self._n_written += sum(map(len, begun))
            if self._fault is not None:
                log_event(Event.RECORD_RECOVERED, n_frames_dropped=self.status().n_frames_dropped)
            self._fault = None
        except Exception as refusal:  # noqa: BLE001 - frames that cannot be written must not come back for ever
            self._close()
            self._n_lost += sum(map(len, begun))
            if self._fault != (fault := f"{directory}: {getattr(refusal, 'strerror', None) or repr(refusal)}"):
                log_event(Event.RECORD_REFUSED, level=logging.WARNING, fault=fault)
            self._fault = fault
        for _ in begun:
            self._held.popleft()

    def _close(self) -> None:
        with suppress(OSError):
            if self._files is not None:
                self._files.stop()
        self._files = None
