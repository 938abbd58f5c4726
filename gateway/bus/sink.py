"""The sending side: frames onto a bus, paced by their stamps for replay and simulation. The service never loads it."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Final

import can

from gateway.bus.frames import Speed, message_of, take
from gateway.bus.listen import system_reason
from gateway.bus.logs import LogReport, open_whole_log
from gateway.bus.logs.log_report import LEAP_S, STEP_BACK_S
from gateway.bus.receiver import require_usable_interface
from gateway.errors import BusError
from gateway.records import Frames
from gateway.units import NS_PER_S

SEND_TIMEOUT_S: Final = 5.0  # chosen: for a full transmit queue, or an in-process receiver that is busy
LONGEST_SLEEP_S: Final = 0.1  # chosen: how soon a stop takes effect
PIECE_FRAMES: Final = 512  # chosen: between two reports of progress at full speed


class BusSink(AbstractContextManager["BusSink"]):
    """An open channel to send on. On an in-process bus the recorded stamps travel with the frames."""

    def __init__(self, interface: str, channel: str, **options: Any) -> None:
        """Raises BusError if the channel cannot be opened."""
        require_usable_interface(interface)
        if interface == "virtual":
            options = {"preserve_timestamps": True, **options}
        try:
            self._bus = can.Bus(interface=interface, channel=channel, ignore_config=True, **options)
        except (OSError, can.CanError, TypeError, ValueError) as fault:
            raise BusError(f"cannot send on {interface} {channel}: {system_reason(fault, channel)}") from fault
        self._channel = channel
        self._name = f"{interface} {channel}"

    def send(self, frames: Frames) -> None:
        """Send every frame at once, in order. Raises BusError if the bus does not accept them."""
        try:
            for row in range(len(frames)):
                self._bus.send(message_of(frames, row), timeout=SEND_TIMEOUT_S)
        except (OSError, can.CanError) as fault:
            raise BusError(f"cannot send on {self._name}: {system_reason(fault, self._channel)}") from fault

    def __exit__(self, *_: object) -> None:
        self._bus.shutdown()


OnProgress = Callable[[int, float], None]  # the frames sent, and the recorded seconds from the first of them


def replay(
    log: Path | str,
    interface: str,
    channel: str,
    *,
    from_channel: str | None = None,
    speed: Speed = 1.0,
    on_progress: OnProgress | None = None,
    stop: threading.Event | None = None,
) -> LogReport:
    """Send every data frame of a log (of ``from_channel``, or of all) to a bus; returns the reader's report.

    ``speed`` 2.0 is twice as fast as recorded, "max" as fast as the bus takes them. ``stop`` ends it early.
    Raises LogUnreadableError for the log, BusError for the bus.
    """
    chunks, report = open_whole_log(log, from_channel)
    with BusSink(interface, channel) as sink:
        replay_frames(chunks, sink, speed, on_progress, stop)
    return report


def replay_frames(
    chunks: Iterable[Frames],
    sink: BusSink,
    speed: Speed = 1.0,
    on_progress: OnProgress | None = None,
    stop: threading.Event | None = None,
) -> int:
    """Send chunks of frames paced by their stamps; returns the number sent.

    Where a clock was set or another log begins, the next frame follows at once.
    """
    stop = stop or threading.Event()
    n_sent, recorded_s = 0, 0.0
    last_ns: int | None = None
    begun_s = time.monotonic()
    for piece in _pieces(chunks):
        step_s = 0.0 if last_ns is None else (int(piece.t_ns[0]) - last_ns) / NS_PER_S
        recorded_s += step_s if -STEP_BACK_S <= step_s <= LEAP_S else 0.0
        last_ns = int(piece.t_ns[0])
        due_s = begun_s if speed == "max" else begun_s + recorded_s / speed
        while not stop.is_set() and (left_s := due_s - time.monotonic()) > 0:
            stop.wait(min(left_s, LONGEST_SLEEP_S))
        if stop.is_set():
            break
        sink.send(piece)
        n_sent += len(piece)
        if on_progress:
            on_progress(n_sent, recorded_s)
    return n_sent


def _pieces(chunks: Iterable[Frames]) -> Iterator[Frames]:
    """Cut chunks into pieces of at most one millisecond or PIECE_FRAMES frames, each sent at one time."""
    for chunk in chunks:
        millisecond = chunk.t_ns // 1_000_000
        begin = 0
        for end in range(1, len(chunk) + 1):
            if end == len(chunk) or millisecond[end] != millisecond[begin] or end - begin == PIECE_FRAMES:
                yield take(chunk, slice(begin, end))
                begin = end
