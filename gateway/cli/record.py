"""springscale record: a bus recorded into a log, without a service."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import click

from gateway.bus.live.source import LiveSource
from gateway.bus.ring_log import record_to_file
from gateway.bus.signals import load_signal_map
from gateway.cli import options
from gateway.cli.options import FILE, NumberRange, Told, prints
from gateway.cli.progress import StatusLine
from gateway.errors import SpringscaleError
from gateway.files.whole import refusal_told


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
    source = LiveSource(interface, channel, signal_map)
    stop = threading.Event()
    with StatusLine() as status, _until_told(stop), refusal_told(log, SpringscaleError):
        n_frames = record_to_file(
            source,
            signal_map.channel or channel,
            log,
            stop,
            duration_s=for_s,
            on_frames=lambda n: status.show(f"{n} frames"),
        )
    counts = source.counts()
    n_dropped = counts.dropped_inbox + counts.dropped_kernel
    if not n_frames:
        raise SpringscaleError(f"{log}: no mapped frame came ({source.reason or 'the bus was silent'})")
    told = {"output": str(log), "n_frames": n_frames, "n_dropped": n_dropped}
    return told, f"{log}: {n_frames} frames, {n_dropped} lost"


@contextlib.contextmanager
def _until_told(stop: threading.Event) -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the recording instead of the program, so that received frames are written."""
    before = {number: signal.signal(number, lambda *_: stop.set()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
