"""The ring log: what is written can be read, whatever happens to the disk, the power and the clock."""

import os
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.bus_drive import white_noise
from support.encoded import frames_of
from support.log import fields_of
from support.patience import PATIENCE_S, wait_until

from gateway.bus import ring_log
from gateway.bus.frames import message_of, take
from gateway.bus.logs import open_whole_log
from gateway.bus.logs.open import open_log
from gateway.bus.ring_log import RingLog
from gateway.bus.signals import load_signal_map
from gateway.log import Event
from gateway.records import Frames

DRIVE = white_noise(20.0, 1_790_000_000_000_000_000, seed=1)


def recorded(directory: Path, *drives: Frames, channel: str = "can0", max_bytes: int = 10**9) -> RingLog:
    """A ring that took these drives, each in a run of its own."""
    for frames in drives:
        log = RingLog(directory, channel, max_bytes, 0)
        log.start()
        log.put(frames)
        log.stop(PATIENCE_S)
    return log


def files(directory: Path) -> list[Path]:
    return sorted(directory.glob("*.log"))


def read(*paths: Path) -> Frames:
    parts = []
    for path in paths:
        chunks, report = open_log(path, load_signal_map("springscale:reference"))
        parts += list(chunks)
        assert report.ended_early is None
    return Frames(*(np.concatenate([getattr(part, name) for part in parts]) for name in Frames.__slots__))


def same(one: Frames, other: Frames) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in Frames.__slots__)


def test_recorded_frames_are_read_back(tmp_path: Path) -> None:
    log = RingLog(tmp_path / "record", "can0", 10**9, 0)
    log.start()
    for begin in range(0, len(DRIVE), 97):
        log.put(take(DRIVE, slice(begin, begin + 97)))
    log.stop(PATIENCE_S)
    (path,) = files(tmp_path / "record")
    assert same(read(path), DRIVE)
    told = log.status()
    assert (told.n_frames_written, told.n_frames_dropped, told.n_frames_held) == (len(DRIVE), 0, 0)
    assert told.size_bytes == path.stat().st_size
    assert (log.status().last_fault, path.parent.stat().st_mode & 0o027) == (None, 0)


def test_frames_that_cannot_be_written_are_lost_once_and_the_next_are_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What had been written before the fault was written again at every attempt."""
    one, other = take(DRIVE, slice(0, 100)), take(DRIVE, slice(100, 200))
    log = RingLog(tmp_path, "can0", 10**9, 0, write_s=0.01)
    with monkeypatch.context() as breaking:
        breaking.setattr(ring_log, "message_of", lambda frames, row: {}[row] if row == 50 else message_of(frames, row))
        log.put(one)
        log.start()
        assert wait_until(lambda: log.status().last_fault is not None)
        assert log.status().n_frames_dropped == 100
    log.put(other)
    assert wait_until(lambda: log.status().last_fault is None)
    log.stop(PATIENCE_S)
    assert (log.status().n_frames_written, log.status().n_frames_dropped) == (100, 100)
    assert same(read(files(tmp_path)[-1]), other)


def test_the_oldest_give_way(tmp_path: Path) -> None:
    n_bytes = recorded(tmp_path / "one", DRIVE).status().size_bytes
    log = recorded(tmp_path / "many", *[DRIVE] * 7, max_bytes=3 * n_bytes)
    kept = files(tmp_path / "many")
    assert log.status().size_bytes == sum(path.stat().st_size for path in kept) <= 3 * n_bytes
    found = read(*kept)
    n = len(found)
    assert 2 * len(DRIVE) <= n < 3 * len(DRIVE)
    np.testing.assert_array_equal(found.t_ns, np.tile(DRIVE.t_ns, 7)[-n:])
    assert log.status().n_frames_written == len(DRIVE)


def test_a_clock_that_steps_back_changes_no_order_and_no_stamp(tmp_path: Path) -> None:
    early = Frames(DRIVE.t_ns - DRIVE.t_ns[0], *(getattr(DRIVE, name) for name in Frames.__slots__[1:]))
    recorded(tmp_path, DRIVE, early, DRIVE)
    log = RingLog(tmp_path / "one", "can0", 10**9, 0)
    log.put(DRIVE)
    log.put(early)
    log.start()
    log.stop(PATIENCE_S)
    both = np.concatenate((DRIVE.t_ns, early.t_ns))
    np.testing.assert_array_equal(read(*files(tmp_path)).t_ns, np.concatenate((both, DRIVE.t_ns)))
    np.testing.assert_array_equal(read(*files(tmp_path / "one")).t_ns, both)


def test_a_power_cut_costs_the_last_line(tmp_path: Path) -> None:
    recorded(tmp_path, DRIVE)
    content = (tmp_path / "00000001.log").read_bytes()
    (tmp_path / "00000001.log").write_bytes(content[:-20] + bytes(100))
    recorded(tmp_path, DRIVE)
    assert len(read(*files(tmp_path))) == 2 * len(DRIVE) - 1


def test_a_disk_that_refuses_is_waited_for(tmp_path: Path) -> None:
    directory = tmp_path / "record"
    directory.write_text("a file where the folder should be")
    log = RingLog(directory, "can0", 10**9, 0, write_s=0.01)
    log.start()
    log.put(DRIVE)
    assert wait_until(lambda: log.status().last_fault is not None)
    assert log.status().n_frames_held == len(DRIVE)
    directory.unlink()
    assert wait_until(lambda: log.status().n_frames_written == len(DRIVE))
    assert wait_until(lambda: log.status().last_fault is None)
    assert log.status().n_frames_dropped == 0
    log.stop(PATIENCE_S)


def test_the_queue_is_bounded_and_dropped_frames_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ring_log, "HELD_FRAMES", 3 * len(DRIVE))
    (tmp_path / "record").write_text("")
    log = RingLog(tmp_path / "record", "can0", 10**9, 0, write_s=0.01)
    log.start()
    for _ in range(5):
        log.put(DRIVE)
    told = log.status()
    assert (told.n_frames_held, told.n_frames_dropped) == (3 * len(DRIVE), 2 * len(DRIVE))
    log.stop(PATIENCE_S)
    assert log.status().n_frames_dropped == 5 * len(DRIVE)


def test_a_disk_with_little_room_is_left_alone(tmp_path: Path) -> None:
    log = RingLog(tmp_path / "record", "can0", 10**9, 10**18)
    log.start()
    log.put(DRIVE)
    log.stop(PATIENCE_S)
    assert "free_mb" in str(log.status().last_fault)
    assert (files(tmp_path / "record"), log.status().n_frames_dropped) == ([], len(DRIVE))


def test_files_without_a_frame_are_not_kept(tmp_path: Path) -> None:
    """A disk that refuses leaves an empty file at every attempt."""
    (tmp_path / "00000007.log").touch()
    recorded(tmp_path, DRIVE)
    assert [path.name for path in files(tmp_path)] == ["00000008.log"]


def test_foreign_files_are_neither_counted_nor_removed(tmp_path: Path) -> None:
    for name in ("notes.txt", "drive.log", "00000001.log.part"):
        (tmp_path / name).write_text("mine")
    recorded(tmp_path, DRIVE, DRIVE, max_bytes=1000)
    assert {path.name for path in tmp_path.iterdir()} >= {"notes.txt", "drive.log", "00000001.log.part"}


def test_frames_longer_than_the_map_keeps_have_their_length(tmp_path: Path) -> None:
    """A CAN FD frame under a mapped identifier is refused for its length, live and from the log alike."""
    frames = frames_of((n * 10**9 + 1000, 0x101, bytes(length)) for n, length in enumerate((8, 12, 2)))
    recorded(tmp_path, frames)
    (found,) = list(open_whole_log(files(tmp_path)[0])[0])
    assert found.length.tolist() == [8, 12, 2]
    assert found.t_ns.tolist() == frames.t_ns.tolist()


@pytest.mark.parametrize(
    ("channel", "written"), [("can0", b"can0"), ("/dev/tty USB0\n", b"/dev/tty_USB0_"), ("", b"can")]
)
def test_any_channels_name_makes_a_line(tmp_path: Path, channel: str, written: bytes) -> None:
    recorded(tmp_path, DRIVE, channel=channel)
    assert files(tmp_path)[0].read_bytes().split(b" ", 2)[1] == written
    assert same(read(files(tmp_path)[0]), DRIVE)


@pytest.fixture
def release(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """The disk hangs until this is set."""
    release, real = threading.Event(), os.statvfs
    held: Callable[[Path], os.statvfs_result] = lambda path: (release.wait(PATIENCE_S), real(path))[1]  # noqa: E731
    monkeypatch.setattr(os, "statvfs", held)
    return release


def test_no_thread_waits_for_the_disk(tmp_path: Path, release: threading.Event) -> None:
    log = RingLog(tmp_path, "can0", 10**9, 0, write_s=0.01)
    log.start()
    log.put(DRIVE)
    log.put(DRIVE)  # returns though the disk does not
    assert log.status().n_frames_written == 0
    release.set()
    log.stop(PATIENCE_S)
    assert log.status().n_frames_written == 2 * len(DRIVE)


def test_frames_lost_at_a_stop_are_reported(
    tmp_path: Path, release: threading.Event, caplog: pytest.LogCaptureFixture
) -> None:
    """A disk that hangs holds the stop no longer than it may, and the frames went without a word."""
    log = RingLog(tmp_path, "can0", 10**9, 0)
    log.start()
    log.put(DRIVE)
    log.stop(0.05)
    assert fields_of(caplog, Event.RECORD_REFUSED)["n_frames_held"] == len(DRIVE)
    release.set()
    assert wait_until(lambda: not log.status().n_frames_held)
