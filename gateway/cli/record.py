"""springscale record: the ring log of a running service, listed and fetched; or a bus recorded into a log."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import click

from gateway.bus.live.source import LiveSource
from gateway.bus.ring.ring_log import record_to_file
from gateway.bus.signals import load_signal_map
from gateway.cli import options
from gateway.cli.options import FILE, NumberRange, Told, prints
from gateway.cli.progress import StatusLine
from gateway.cli.service import Answer, Service, asks_service, prints_answer
from gateway.errors import SpringscaleError
from gateway.files.whole import refusal_told, written_whole
from gateway.words import counted

PATH: Final = "/api/v1/record"
PIECE_BYTES: Final = 65_536  # chosen: read and written at a time
_MOMENT: Final = click.DateTime(
    ("%Y-%m-%dT%H:%M:%SZ", "%Y-%m-%dT%H:%M:%S", "%Y-%m-%dT%H:%MZ", "%Y-%m-%dT%H:%M", "%Y-%m-%d")
)


@click.group("record")
def record() -> None:
    """Frames on disk: list and fetch those that a service keeps ([record] enabled), or record from a bus."""


@record.command("list")
@prints_answer(lambda told: _list_text(told["items"]))
def list_segments(service: Service) -> Answer:
    """The files of the service's ring log, oldest first."""
    return service.ask(PATH)


@record.command("fetch")
@click.argument("names", nargs=-1)
@click.option("--output", type=FILE, required=True, help="the log to write, such as drive.log.gz")
@click.option("--since", type=_MOMENT, default=None, help="files with frames at or after this, UTC")
@click.option("--until", type=_MOMENT, default=None, help="files with frames before this, UTC")
@asks_service
@prints
def fetch(
    service: Service,
    names: tuple[str, ...],
    output: Path,
    since: datetime | None,
    until: datetime | None,
) -> Told:
    """Fetch files of the ring log as one log: NAMES, those of a time, or all.

    Batches are counted from the first frame of a drive: to get the very batches of the service, begin with the file in
    which the drive began.
    """
    items = service.ask(PATH)["items"]
    if unknown := sorted(set(names) - {item["name"] for item in items}):
        raise SpringscaleError(f"the ring log has no {unknown[0]}: `springscale record list` shows what it has")
    chosen = [item for item in items if (item["name"] in names or not names) and _overlaps(item, since, until)]
    if not chosen:
        raise SpringscaleError("the ring log has no such frames: `springscale record list` shows what it has")
    with refusal_told(output, SpringscaleError), written_whole(output) as file, StatusLine() as status:
        for item in chosen:
            for piece in _pieces(service, item["name"], item["n_bytes"]):
                file.write(piece)
                status.show(f"{item['name']}: {file.tell()} bytes so far")
    told = {"output": str(output), "n_bytes": output.stat().st_size, "items": chosen}
    n_frames = sum(item["n_frames"] for item in chosen)
    return told, f"{output}: {n_frames} frames, {_span_text(chosen)}"


@record.command("bus")
@click.argument("log", type=FILE)
@click.option("--signals", required=True, help="signal map whose frames are recorded, or springscale:NAME")
@options.interface
@options.channel
@click.option("--for-s", type=NumberRange(0.1), default=None, help="so many seconds [default: until Ctrl-C]")
@prints
def from_bus(log: Path, signals: str, interface: str, channel: str, for_s: float | None) -> Told:
    """Record the mapped frames of a bus into LOG (gzip-compressed candump), without a service."""
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
    n_dropped = source.counts().dropped_inbox
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


def _pieces(service: Service, name: str, n_bytes: int) -> Iterator[bytes]:
    """All of one segment; a broken connection is resumed as long as it makes progress."""
    n_got = 0
    while n_got < n_bytes:
        n_before = n_got
        try:
            with service.opened(f"{PATH}/{name}", more={"Range": f"bytes={n_got}-{n_bytes - 1}"}) as answer:
                while piece := answer.read(PIECE_BYTES):
                    n_got += len(piece)
                    yield piece
        except SpringscaleError:
            if n_got == n_before:
                raise
        if n_got == n_before:
            raise SpringscaleError(f"{name}: the service sent {n_got} of its {n_bytes} bytes")


def _overlaps(item: Answer, since: datetime | None, until: datetime | None) -> bool:
    begin, end = (datetime.fromisoformat(item[key]) for key in ("t_start", "t_end"))
    return (since is None or end >= since.replace(tzinfo=UTC)) and (until is None or begin < until.replace(tzinfo=UTC))


def _list_text(items: list[Answer]) -> str:
    if not items:
        return "nothing is recorded: is [record] enabled, and has a block's time passed?"
    lines = [f"{item['name']}  {item['n_bytes']:>11} bytes  {_span_text([item])}" for item in items]
    n_bytes = sum(item["n_bytes"] for item in items)
    return "\n".join([*lines, f"{counted(len(items), 'file')}, {n_bytes / 1e6:.1f} MB"])


def _span_text(items: list[Answer]) -> str:
    return f"{min(item['t_start'] for item in items)[:19]}Z to {max(item['t_end'] for item in items)[:19]}Z"
