"""springscale record bus and record fetch: whole files under their names, whatever breaks."""

import gzip
import io
import json
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from support.bus_drive import START_NS, white_noise
from support.commands import called
from support.patience import wait_until

from gateway.bus.live.source import LiveSource
from gateway.bus.logs.open import open_log
from gateway.bus.ring.ring_log import record_to_file
from gateway.bus.signals import load_signal_map
from gateway.bus.sink import BusSink
from gateway.cli.service import Service
from gateway.errors import SpringscaleError

SIGNAL_MAP = load_signal_map("springscale:reference")
DRIVE = white_noise(20.0, START_NS, seed=1)


def test_every_mapped_frame_is_in_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.bus.ring.ring_log.FILE_BLOCK_FRAMES", 1000)
    source, stop = LiveSource("virtual", tmp_path.name, SIGNAL_MAP, silence_s=0.05), threading.Event()

    def play() -> None:
        assert wait_until(lambda: source.state == "bus_silent")  # it is open, then
        with BusSink("virtual", tmp_path.name) as sink:
            sink.send(DRIVE)
        wait_until(lambda: source.counts().frames == len(DRIVE))
        stop.set()

    player = threading.Thread(target=play)
    player.start()
    heard: list[int] = []
    path = tmp_path / "drive.log.gz"
    assert record_to_file(source, "can0", path, stop, on_frames=heard.append) == len(DRIVE)
    player.join()
    chunks, report = open_log(path, SIGNAL_MAP)
    assert sum(map(len, chunks)) == len(DRIVE) == heard[-1]
    assert report.ended_early is None


def test_what_came_as_it_was_stopped_is_counted_too(tmp_path: Path) -> None:
    source, stop = LiveSource("virtual", tmp_path.name, SIGNAL_MAP), threading.Event()
    source.inbox.put(DRIVE)
    stop.set()
    heard: list[int] = []
    assert record_to_file(source, "can0", tmp_path / "drive.log.gz", stop, on_frames=heard.append) == len(DRIVE)
    assert heard == [len(DRIVE)]


def recorded(log: Path, signals: str = "springscale:reference") -> Result:
    """By ``springscale record bus`` from a virtual bus named after the log's folder."""
    return called(
        "record",
        "bus",
        log,
        "--signals",
        signals,
        "--for-s",
        0.3,
        "--interface",
        "virtual",
        "--channel",
        log.parent.name,
    )


@pytest.mark.parametrize(
    ("name", "why"), [("taken.log.gz", "File exists"), ("fresh.log.gz", "no mapped frame came (the bus was silent)")]
)
def test_what_cannot_be_recorded_is_told(tmp_path: Path, name: str, why: str) -> None:
    (tmp_path / "taken.log.gz").write_text("mine")
    found = recorded(tmp_path / name)
    assert isinstance(found.exception, SpringscaleError)
    assert why in str(found.exception)
    assert (tmp_path / "taken.log.gz").read_text() == "mine"


@pytest.mark.parametrize("failure", [RuntimeError, OSError])  # the thread dies; the source tries again
def test_the_reason_of_the_source_is_given_where_nothing_came(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: type[Exception]
) -> None:
    def no_bus() -> None:
        raise failure("the adapter was unplugged")

    monkeypatch.setattr("gateway.bus.live.source.opener_of", lambda *_: no_bus)
    found = recorded(tmp_path / "drive.log.gz")
    assert "the adapter was unplugged" in str(found.exception)


@pytest.mark.parametrize("map_channel", [None, "can7"])
def test_frames_carry_the_channel_of_the_map_and_else_that_of_the_bus(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, map_channel: str | None
) -> None:
    """The log can then be read with the map that recorded it."""

    def played(self: LiveSource) -> None:
        self.inbox.put(DRIVE)

    monkeypatch.setattr(LiveSource, "start", played)
    dbc = files("gateway.dbc")
    text = (dbc / "reference.toml").read_text().replace('"springscale_', f'"{dbc}/springscale_')
    signals = tmp_path / "signals.toml"
    signals.write_text(f'channel = "{map_channel}"\n{text}' if map_channel else text)
    assert recorded(tmp_path / "drive.log.gz", str(signals)).exit_code == 0
    lines = gzip.decompress((tmp_path / "drive.log.gz").read_bytes()).decode().splitlines()
    assert {line.split()[1] for line in lines} == {map_channel or tmp_path.name}
    assert sum(map(len, open_log(tmp_path / "drive.log.gz", load_signal_map(str(signals)))[0])) == len(DRIVE)


CONTENT = bytes(range(256)) * 40


def item(begin: str, end: str) -> dict[str, Any]:
    """A file of the ring log with frames from and to these times of a day, as the service lists it."""
    t_start, t_end = (f"2026-09-22T{clock}:00.000000Z" for clock in (begin, end))
    return {"name": f"{begin}.log.gz", "n_bytes": len(CONTENT), "n_frames": 7, "t_start": t_start, "t_end": t_end}


def fetched(
    monkeypatch: pytest.MonkeyPatch,
    output: Path,
    *sent: int,
    items: Sequence[dict[str, Any]] = (item("00:00", "00:10"),),
    options: Sequence[str] = (),
) -> tuple[Result, list[str]]:
    """From a service whose link breaks after so many bytes of each answer."""
    asked: list[str] = []
    lengths = iter(sent)

    @contextmanager
    def opened(self: Service, path: str, *_: Any, more: dict[str, str] | None = None) -> Iterator[io.BytesIO]:
        if more is None:
            yield io.BytesIO(json.dumps({"items": items}).encode())
            return
        asked.append(more["Range"])
        begin = int(more["Range"].removeprefix("bytes=").partition("-")[0])
        yield io.BytesIO(CONTENT[begin : begin + next(lengths)])
        raise SpringscaleError("the link broke")

    monkeypatch.setattr(Service, "opened", opened)
    return called("record", "fetch", "--output", output, "--url", "http://van", *options), asked


def test_a_link_that_breaks_is_taken_up_where_it_broke(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    output = tmp_path / "drive.log.gz"
    found, asked = fetched(monkeypatch, output, 1000, 4000, 99_999)
    assert found.exit_code == 0, found.exception
    assert output.read_bytes() == CONTENT
    last = len(CONTENT) - 1
    assert asked == [f"bytes=0-{last}", f"bytes=1000-{last}", f"bytes=5000-{last}"]
    assert list(tmp_path.iterdir()) == [output]


@pytest.mark.parametrize(
    ("options", "begins"),
    [
        ((), ["08:00", "09:00", "10:00"]),
        (("--since", "2026-09-22T09:00"), ["09:00", "10:00"]),
        (("--since", "2026-09-22T09:50"), ["09:00", "10:00"]),  # a frame at this very time
        (("--until", "2026-09-22T09:00"), ["08:00"]),  # none before this time
        (("--until", "2026-09-22T09:00:01Z"), ["08:00", "09:00"]),
        (("--since", "2026-09-22T09:00", "--until", "2026-09-22T10:00"), ["09:00"]),
    ],
)
def test_files_of_a_time_are_fetched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], begins: list[str]
) -> None:
    items = [item(f"{hour:02}:00", f"{hour:02}:50") for hour in (8, 9, 10)]
    output = tmp_path / "drive.log.gz"
    found, _ = fetched(monkeypatch, output, *[len(CONTENT)] * 3, items=items, options=(*options, "--json"))
    assert [one["name"] for one in json.loads(found.stdout)["items"]] == [f"{begin}.log.gz" for begin in begins]
    assert output.read_bytes() == len(begins) * CONTENT


def test_one_that_brings_nothing_any_more_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found, asked = fetched(monkeypatch, tmp_path / "drive.log.gz", 1000, 0)
    assert "the link broke" in str(found.exception)
    assert len(asked) == 2
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_written_is_no_fault_of_the_service(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, _ = fetched(monkeypatch, tmp_path / "no such folder" / "drive.log.gz", 99_999)
    assert isinstance(found.exception, SpringscaleError)
    assert "drive.log.gz: cannot be written: No such file or directory" in str(found.exception)
