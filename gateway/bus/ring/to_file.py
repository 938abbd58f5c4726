"""Records a live channel into one log file, in whole blocks, so that an interrupted file stays readable."""

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, Final

from gateway.bus.frames import join
from gateway.bus.live import LiveSource
from gateway.bus.ring.block import packed_block
from gateway.records import Frames

BLOCK_S: Final = 10.0
BLOCK_FRAMES: Final = 65_536
LOOK_S: Final = 0.2

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
    due_s = time.monotonic() + BLOCK_S
    with path.open("xb") as file:
        source.start()
        try:
            while not (stop.is_set() or (end_s is not None and time.monotonic() >= end_s) or source.failure):
                if (frames := source.inbox.drain(LOOK_S)) is not None:
                    held.append(frames)
                    n_held += len(frames)
                    on_frames(n_written + n_held)
                if n_held >= BLOCK_FRAMES or time.monotonic() >= due_s:
                    n_written += _written(file, held, channel)
                    held, n_held, due_s = [], 0, time.monotonic() + BLOCK_S
        finally:
            source.stop()
            while (frames := source.inbox.drain(0.0)) is not None:
                held.append(frames)
                n_held += len(frames)
                on_frames(n_written + n_held)
            n_written += _written(file, held, channel)
    return n_written


def _written(file: BinaryIO, held: list[Frames], channel: str) -> int:
    if not held:
        return 0
    frames = join(held, held[0].payload.shape[1])
    file.write(packed_block(frames, channel))
    file.flush()
    return len(frames)
