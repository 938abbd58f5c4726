"""Frames of a live channel on disk in whole blocks: the thread of the ring log, and a recording into one file."""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, Final

from gateway.bus.frames import join
from gateway.bus.live.source import LiveSource
from gateway.bus.ring.folder import RingFolder, RingLimits
from gateway.bus.ring.segment import packed_block
from gateway.log import Event, log_event
from gateway.part import STOP_WITHIN_S, ThreadPart
from gateway.records import Frames
from gateway.status import RecordStatus, Segment

BLOCK_FRAMES: Final = 131_072  # chosen: so many frames are written before the time of a block is over
HELD_FRAMES: Final = 2 * BLOCK_FRAMES  # chosen: most frames in memory while the disk fails: some MB
RETRY_S: Final = 30.0  # chosen: pause after a fault of the disk


class RingLog(ThreadPart):
    """The ring log. One thread hands frames over, its own thread writes them, any thread lists and opens segments."""

    NAME = "recorder"

    def __init__(
        self,
        directory: Path,
        channel: str,
        limits: RingLimits,
        *,
        clock_s: Callable[[], float] = time.time,
        retry_s: float = RETRY_S,
    ) -> None:
        """``channel`` is the frames' channel name in the log, as far as a candump line allows it."""
        super().__init__("ring-log")
        self._folder = RingFolder(directory, limits, clock_s)
        self._channel = "".join("_" if char.isspace() or not char.isprintable() else char for char in channel) or "can"
        self._block_s = limits.block_s
        self._retry_s = retry_s
        self._changed = threading.Condition()
        self._held: list[Frames] = []
        self._n_held = 0
        self._held_since_s = 0.0
        self._n_written = self._n_dropped = self._n_bytes = 0
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
        if not len(frames):
            return
        with self._changed:
            if self._n_held + len(frames) > HELD_FRAMES:
                self._n_dropped += len(frames)
                return
            if not self._held:
                self._held_since_s = time.monotonic()
            self._held.append(frames)
            self._n_held += len(frames)
            if self._n_held >= BLOCK_FRAMES or len(self._held) == 1:
                self._changed.notify_all()

    def segments(self) -> tuple[Segment, ...]:
        """The segments that can be fetched, oldest first."""
        return tuple(segment for segment in self._folder.segments() if segment.n_blocks)

    def open(self, name: str) -> tuple[BinaryIO, int] | None:
        return self._folder.open(name)

    def status(self) -> RecordStatus:
        segments = self.segments()
        return RecordStatus(
            n_frames_written=self._n_written,
            n_frames_held=self._n_held,
            n_frames_dropped=self._n_dropped,
            n_bytes_written=self._n_bytes,
            n_bytes_today=self._folder.n_bytes_today,
            size_bytes=sum(segment.n_bytes for segment in segments),
            n_segments=len(segments),
            last_fault=self._fault,
        )

    @property
    def fault(self) -> str | None:
        """Why frames are not being recorded, for people; None while they are."""
        if self._fault is None:
            return None
        return f"frames are not being recorded ({self._fault}); {self._n_dropped} are lost so far, weighing goes on"

    def _run(self) -> None:
        try:
            self._read_folder()
            while self._wait_for_block():
                self._write_held()
            self._folder.close()
        except Exception as failure:  # noqa: BLE001 - a failure of the recording must not end the weighing
            self._note(f"the recorder died: {failure!r}")

    def _read_folder(self) -> None:
        """Read the directory, so that segments of earlier runs can be fetched at once."""
        try:
            self._folder.read()
        except OSError as refusal:
            self._note(refusal)

    def _wait_for_block(self) -> bool:
        """Wait until a block is due or it is time to stop; False if nothing is left to do."""
        with self._changed:
            while not self._stopping.is_set() and self._n_held < BLOCK_FRAMES:
                left_s = self._held_since_s + self._block_s - time.monotonic() if self._held else None
                if left_s is not None and left_s <= 0.0:
                    break
                self._changed.wait(left_s)
            return bool(self._held)

    def _write_held(self) -> None:
        """Write a block to disk; if that fails it stays in memory, and the next try waits a while."""
        with self._changed:
            parts = list(self._held)
        frames = join(parts, parts[0].payload.shape[1])
        try:
            is_written = self._write(frames)
        except OSError as refusal:
            self._note(refusal)
            with self._changed:
                if not self._stopping.is_set():
                    self._changed.wait_for(self._stopping.is_set, self._retry_s)
                    return
            is_written = False
        with self._changed:
            del self._held[: len(parts)]
            self._n_held -= len(frames)
            self._held_since_s = time.monotonic()
            self._n_written += len(frames) if is_written else 0
            self._n_dropped += 0 if is_written else len(frames)

    def _write(self, frames: Frames) -> bool:
        """False if the day's bytes are used up. Raises OSError."""
        block = packed_block(frames, self._channel)
        if self._folder.is_over_day(len(block)):
            self._note("the day's bytes are used up: [record] max_daily_mb")
            return False
        self._folder.append(block)
        self._n_bytes += len(block)
        if self._fault is not None:
            log_event(Event.RECORD_RECOVERED, n_frames_dropped=self._n_dropped)
            self._fault = None
        return True

    def _note(self, refusal: OSError | str) -> None:
        """Report a fault, and log it if it is new."""
        fault = str(refusal)
        if isinstance(refusal, OSError):
            fault = f"{self._folder.directory}: {refusal.strerror or refusal}"
        if fault != self._fault:
            log_event(Event.RECORD_REFUSED, level=logging.WARNING, fault=fault)
        self._fault = fault


FILE_BLOCK_S: Final = 10.0  # chosen: a killed recording loses as much
FILE_BLOCK_FRAMES: Final = 65_536  # chosen: likewise of a busy bus
DRAIN_S: Final = 0.2  # chosen: how soon a stop takes effect

OnFrames = Callable[[int], None]


def record_to_file(
    source: LiveSource,
    channel: str,
    path: Path,
    stop: threading.Event,
    *,
    duration_s: float | None = None,
    on_frames: OnFrames = lambda n: None,
) -> int:
    """Listen until ``stop`` or ``duration_s`` -> frames written. ``path`` must not exist yet. Raises OSError."""
    end_s = None if duration_s is None else time.monotonic() + duration_s
    held: list[Frames] = []
    n_held = n_written = 0
    due_s = time.monotonic() + FILE_BLOCK_S
    with path.open("xb") as file:
        for frames in _received(source, stop, end_s):
            if frames is not None:
                held.append(frames)
                n_held += len(frames)
                on_frames(n_written + n_held)
            if held and (n_held >= FILE_BLOCK_FRAMES or time.monotonic() >= due_s):
                n_written += _write(file, held, channel)
                held, n_held, due_s = [], 0, time.monotonic() + FILE_BLOCK_S
        return n_written + (_write(file, held, channel) if held else 0)


def _received(source: LiveSource, stop: threading.Event, end_s: float | None) -> Iterator[Frames | None]:
    """The frames of a source until ``stop`` or ``end_s``, then those still in its inbox; None after a quiet while."""
    source.start()
    try:
        while not (stop.is_set() or (end_s is not None and time.monotonic() >= end_s) or source.failure):
            yield source.inbox.drain(DRAIN_S)
    finally:
        source.stop()
    while (frames := source.inbox.drain(0.0)) is not None:
        yield frames


def _write(file: BinaryIO, held: list[Frames], channel: str) -> int:
    frames = join(held, held[0].payload.shape[1])
    file.write(packed_block(frames, channel))
    file.flush()
    return len(frames)
