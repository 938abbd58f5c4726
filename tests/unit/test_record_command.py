"""springscale record bus and record fetch: whole files under their names, whatever breaks."""

import io
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from support.bus_drive import START_NS, white_noise
from support.patience import wait_until

from gateway.bus.live.source import LiveSource
from gateway.bus.logs.open import open_log
from gateway.bus.ring.ring_log import record_to_file
from gateway.bus.signals import load_signal_map
from gateway.bus.sink import BusSink
from gateway.cli import springscale
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


@pytest.mark.parametrize(("name", "why"), [("taken.log.gz", "File exists"), ("fresh.log.gz", "no mapped frame came")])
def test_what_cannot_be_recorded_is_told(tmp_path: Path, name: str, why: str) -> None:
    (tmp_path / "taken.log.gz").write_text("mine")
    arguments = ["record", "bus", str(tmp_path / name), "--signals", "springscale:reference", "--for-s", "0.3"]
    found = CliRunner().invoke(springscale, [*arguments, "--interface", "virtual", "--channel", tmp_path.name])
    assert isinstance(found.exception, SpringscaleError)
    assert why in str(found.exception)
    assert (tmp_path / "taken.log.gz").read_text() == "mine"


CONTENT = bytes(range(256)) * 40
ITEM = {
    "name": "00000001-20260922T000000Z.log.gz",
    "n_bytes": len(CONTENT),
    "n_frames": 7,
    "t_start": "2026-09-22T00:00:00.000000Z",
    "t_end": "2026-09-22T00:10:00.000000Z",
}


def fetched(monkeypatch: pytest.MonkeyPatch, output: Path, *sent: int) -> tuple[Result, list[str]]:
    """From a service whose link breaks after so many bytes of each answer."""
    asked: list[str] = []
    lengths = iter(sent)

    @contextmanager
    def opened(self: Service, path: str, *_: Any, more: dict[str, str] | None = None) -> Iterator[io.BytesIO]:
        if more is None:
            yield io.BytesIO(json.dumps({"items": [ITEM]}).encode())
            return
        asked.append(more["Range"])
        begin = int(more["Range"].removeprefix("bytes=").partition("-")[0])
        yield io.BytesIO(CONTENT[begin : begin + next(lengths)])
        raise SpringscaleError("the link broke")

    monkeypatch.setattr(Service, "opened", opened)
    arguments = ["record", "fetch", "--output", str(output), "--url", "http://van"]
    return CliRunner().invoke(springscale, arguments), asked


def test_a_link_that_breaks_is_taken_up_where_it_broke(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    output = tmp_path / "drive.log.gz"
    found, asked = fetched(monkeypatch, output, 1000, 4000, 99_999)
    assert found.exit_code == 0, found.exception
    assert output.read_bytes() == CONTENT
    last = len(CONTENT) - 1
    assert asked == [f"bytes=0-{last}", f"bytes=1000-{last}", f"bytes=5000-{last}"]
    assert list(tmp_path.iterdir()) == [output]


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
