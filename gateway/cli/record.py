"""springscale record: a bus recorded into a log, without a service."""

import contextlib
import gzip
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, cast

import click

from gateway.bus.frames import widened
from gateway.bus.listen import LiveSource
from gateway.bus.logs.candump_write import append_candump
from gateway.bus.signals import Decoder, load_signal_map
from gateway.cli import options
from gateway.cli.options import FILE, NumberRange, Told, prints
from gateway.cli.progress import StatusLine
from gateway.errors import SpringscaleError
from gateway.files.whole import refusal_told
from gateway.records import Frames
from gateway.words import counted

FLUSH_S: Final = 10.0  # chosen: a killed recording loses as much
DRAIN_S: Final = 0.2  # chosen: how soon a stop takes effect


@click.command("record")
@click.argument("log", type=FILE)
@click.option("--signals", required=True, help="signal map whose frames are recorded, or springscale:NAME")
@options.interface
@options.channel
@click.option("--for-s", type=NumberRange(0.1), default=None, help="so many seconds [default: until Ctrl-C]")
@prints
def record(log: Path, signals: str, interface: str, channel: str, for_s: float | None) -> Told:
    """Record the mapped frames of a bus into LOG (candump text, compressed if it ends in .gz)."""
    signal_map = load_signal_map(signals)
    source, decoder = LiveSource(interface, channel, signal_map), Decoder(signal_map)
    n_frames, due_s = 0, time.monotonic() + FLUSH_S
    with StatusLine() as status, refusal_told(log, SpringscaleError), _new(log) as file:
        for frames in _received(source, for_s):
            if frames is not None:
                append_candump(widened(frames, int(frames.length.max())), signal_map.channel or channel, file)
                decoder.decode(frames)
                n_frames += len(frames)
                status.show(f"{n_frames} frames")
            if time.monotonic() >= due_s:
                file.flush()
                due_s = time.monotonic() + FLUSH_S
    counts = source.counts()
    n_dropped = counts.dropped_inbox + counts.dropped_kernel
    if not n_frames:
        log.unlink()  # so that the same command works once the bus does
        raise SpringscaleError(f"{log}: no mapped frame came ({source.reason or 'the bus was silent'})")
    others = {"remote_frames": counts.remote_frames, "error_frames": counts.error_frames}
    remarks = [f"left out: {counted(n, name[:-1].replace('_', ' '))}" for name, n in others.items() if n]
    remarks += [remark.text for remark in (*decoder.silent(), *decoder.remarks())]
    if n := counts.clock_sets:
        remarks.append(f"the adapter's stamps were dated by this computer's clock, {counted(n, 'time')}")
    told = {"output": str(log), "n_frames": n_frames, "n_dropped": n_dropped, **others, "remarks": remarks}
    return told, "\n".join([f"{log}: {n_frames} frames, {n_dropped} lost", *remarks])


def _new(log: Path) -> BinaryIO:
    """Raises OSError, also if the file exists."""
    return cast(BinaryIO, gzip.open(log, "xb", 6)) if log.suffix.lower() == ".gz" else log.open("xb")


def _received(source: LiveSource, for_s: float | None) -> Iterator[Frames | None]:
    """The frames of a source until a stop or so long, then those still in its inbox; None after a quiet while."""
    end_s = None if for_s is None else time.monotonic() + for_s
    source.start()
    try:
        with _stop_told() as stop:
            while not (stop.is_set() or (end_s is not None and time.monotonic() >= end_s) or source.failure):
                yield source.inbox.drain(DRAIN_S)
    finally:
        source.stop()
    while (frames := source.inbox.drain(0.0)) is not None:
        yield frames


@contextlib.contextmanager
def _stop_told() -> Iterator[threading.Event]:
    """Let Ctrl-C and SIGTERM end the recording instead of the program, so that received frames are written."""
    stop = threading.Event()
    before = {number: signal.signal(number, lambda *_: stop.set()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
