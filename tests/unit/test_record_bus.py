"""springscale record bus: a channel into a log, without a service."""

import threading
from pathlib import Path

import pytest
from click.testing import CliRunner
from support.bus_drive import START_NS, white_noise
from support.patience import wait_until

from gateway.bus.live.source import LiveSource
from gateway.bus.logs.open import open_log
from gateway.bus.ring.ring_log import record_to_file
from gateway.bus.signals import load_signal_map
from gateway.bus.sink import BusSink
from gateway.cli import springscale
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
