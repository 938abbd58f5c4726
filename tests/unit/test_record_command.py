"""springscale record: every mapped frame of a bus in a log."""

import gzip
import os
import signal
import threading
from importlib.resources import files
from pathlib import Path

import can
import numpy as np
import pytest
from click.testing import Result
from support.bus_drive import START_NS, white_noise
from support.commands import called
from support.patience import PATIENCE_S, wait_until

from gateway.bus.frames import take
from gateway.bus.listen import LiveSource, SourceCounts
from gateway.bus.logs.open import open_log
from gateway.bus.signals import load_signal_map
from gateway.bus.sink import BusSink
from gateway.cli import record
from gateway.errors import SpringscaleError

SIGNAL_MAP = load_signal_map("springscale:reference")
DRIVE = white_noise(20.0, START_NS, seed=1)


def recorded(log: Path, signals: str = "springscale:reference", for_s: float = 0.3) -> Result:
    """The log that ``springscale record`` makes from a virtual bus named after the log's folder."""
    return called(
        "record", log, "--signals", signals, "--for-s", for_s, "--interface", "virtual", "--channel", log.parent.name
    )


def test_every_mapped_frame_is_in_the_log_and_remote_and_error_frames_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Remote frames of other identifiers than the mapped ones are the filter's affair, error frames are not."""
    monkeypatch.setattr(record, "FLUSH_S", 0.0)
    source = LiveSource("virtual", tmp_path.name, SIGNAL_MAP, silence_s=0.05)
    monkeypatch.setattr(record, "LiveSource", lambda *_: source)
    remote = [can.Message(arbitration_id=n, is_extended_id=False, is_remote_frame=True) for n in (0x120, 0x121, 0x7FF)]
    errors = [can.Message(arbitration_id=4, is_error_frame=True)] * 3

    def play() -> None:
        assert wait_until(lambda: source.state == "bus_silent")  # it is open, then
        with BusSink("virtual", tmp_path.name) as sink:
            for message in (*remote, *errors):
                sink._bus.send(message)
            sink.send(DRIVE)
        wait_until(lambda: source.counts().frames == len(DRIVE))
        os.kill(os.getpid(), signal.SIGTERM)

    player = threading.Thread(target=play)
    player.start()
    found = recorded(tmp_path / "drive.log.gz", for_s=PATIENCE_S)
    player.join()
    assert f"{len(DRIVE)} frames, 0 lost\nleft out: 2 remote frames\nleft out: 3 error frames\n" in found.output
    chunks, report = open_log(tmp_path / "drive.log.gz", SIGNAL_MAP)
    assert np.concatenate([chunk.t_ns for chunk in chunks]).tolist() == DRIVE.t_ns.tolist()
    assert report.ended_early is None


def test_frames_that_arrive_during_the_stop_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(LiveSource, "start", lambda _: None)
    monkeypatch.setattr(LiveSource, "stop", lambda source: source.inbox.put(DRIVE))
    assert recorded(tmp_path / "drive.log.gz").output.endswith(f"{len(DRIVE)} frames, 0 lost\n")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("taken.log.gz", "taken.log.gz: is there already, and is not written over; name another"),
        ("fresh.log.gz", "no mapped frame came (the bus was silent)"),
    ],
)
def test_faults_of_recording_are_reported(tmp_path: Path, name: str, why: str) -> None:
    (tmp_path / "taken.log.gz").write_text("mine")
    found = recorded(tmp_path / name)
    assert isinstance(found.exception, SpringscaleError)
    assert why in str(found.exception)
    assert (tmp_path / "taken.log.gz").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["taken.log.gz"]  # the next try may have the same name


@pytest.mark.parametrize("failure", [RuntimeError, OSError])  # the thread dies; the source tries again
def test_the_reason_of_the_source_is_given_where_nothing_came(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: type[Exception]
) -> None:
    def no_bus() -> None:
        raise failure("the adapter was unplugged")

    monkeypatch.setattr("gateway.bus.listen.open_channel", lambda *_: no_bus())
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


def test_frames_that_the_kernel_lost_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def played(source: LiveSource) -> None:
        source.inbox.put(DRIVE)

    monkeypatch.setattr(LiveSource, "start", played)
    monkeypatch.setattr(LiveSource, "counts", lambda _: SourceCounts(len(DRIVE), 2, 5, 0, 0, 0))
    found = recorded(tmp_path / "drive.log.gz")
    assert found.output.endswith(f"{len(DRIVE)} frames, 7 lost\n")


def test_a_missing_sensor_and_a_dated_adapter_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the drive is over, and not by the command that weighs it."""
    monkeypatch.setattr(LiveSource, "start", lambda source: source.inbox.put(take(DRIVE, DRIVE.can_id != 0x130)))
    monkeypatch.setattr(LiveSource, "counts", lambda _: SourceCounts(len(DRIVE), 0, 0, 0, 0, 0, clock_sets=2))
    said = recorded(tmp_path / "drive.log.gz").output.splitlines()
    assert said[-2] == "has no frame of GPS_SPEED (130) for speed"
    assert said[-1] == "the adapter's stamps were dated by this computer's clock, 2 times"
