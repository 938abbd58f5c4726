"""The ring log: what is written can be read, whatever happens to the disk, the power and the clock."""

import gzip
import os
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.bus_drive import white_noise
from support.encoded import frames_of
from support.log import fields_of
from support.patience import PATIENCE_S, wait_until

from gateway.bus.frames import take
from gateway.bus.logs import open_whole_log
from gateway.bus.logs.open import open_log
from gateway.bus.ring import RingLimits, RingLog
from gateway.bus.ring.segment import number_of, packed_block
from gateway.bus.signals import load_signal_map
from gateway.log import Event
from gateway.records import Frames

DRIVE = white_noise(20.0, 1_790_000_000_000_000_000, seed=1)
PLENTY = RingLimits(max_bytes=10**9, max_daily_bytes=10**9, free_bytes=0, block_s=3600.0)


def recorded(directory: Path, *drives: Frames, limits: RingLimits = PLENTY, **options: object) -> RingLog:
    """A ring that took each drive as one block, closed again; ``options`` are the ring's."""
    for frames in drives:
        log = RingLog(directory, "can0", limits, **options)  # type: ignore[arg-type]  # a test's own
        log.start()
        log.put(frames)
        log.stop(PATIENCE_S)
    return log


def files(directory: Path) -> list[Path]:
    return sorted(directory.glob("*.log.gz"))


def read(path: Path) -> Frames:
    chunks, report = open_log(path, load_signal_map("springscale:reference"))
    parts = list(chunks)
    assert report.ended_early is None
    return Frames(*(np.concatenate([getattr(part, name) for part in parts]) for name in Frames.__slots__))


def same(one: Frames, other: Frames) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in Frames.__slots__)


def test_what_was_put_is_what_is_read(tmp_path: Path) -> None:
    log = RingLog(tmp_path / "record", "can0", PLENTY)
    log.start()
    for begin in range(0, len(DRIVE), 97):
        log.put(take(DRIVE, slice(begin, begin + 97)))
    log.stop(PATIENCE_S)
    (path,) = files(tmp_path / "record")
    assert same(read(path), DRIVE)
    (segment,) = log.segments()
    assert (segment.name, segment.n_bytes, segment.n_frames) == (path.name, path.stat().st_size, len(DRIVE))
    assert (segment.first_ns, segment.last_ns) == (DRIVE.t_ns.min(), DRIVE.t_ns.max())
    told = log.status()
    assert (told.n_frames_written, told.n_frames_dropped, told.n_frames_held) == (len(DRIVE), 0, 0)
    assert told.n_bytes_written == told.n_bytes_today == told.size_bytes == segment.n_bytes
    assert (log.fault, path.stat().st_mode & 0o777) == (None, 0o640)


def test_a_block_is_written_when_its_time_is_over(tmp_path: Path) -> None:
    log = RingLog(tmp_path, "can0", RingLimits(10**9, 10**9, 0, block_s=0.05))
    log.start()
    for begin in (0, 500):
        log.put(take(DRIVE, slice(begin, begin + 500)))
        assert wait_until(lambda: not log.status().n_frames_held)
    assert [segment.n_blocks for segment in log.segments()] == [2]  # one file, until it is an hour old
    log.stop(PATIENCE_S)


def test_segments_behind_each_other_are_one_log(tmp_path: Path) -> None:
    recorded(tmp_path, take(DRIVE, slice(0, 1000)), take(DRIVE, slice(1000, None)))
    assert len(files(tmp_path)) == 2  # a new start begins a new file
    whole = tmp_path / "whole.log.gz"
    whole.write_bytes(b"".join(path.read_bytes() for path in files(tmp_path)))
    assert same(read(whole), DRIVE)
    assert gzip.decompress(whole.read_bytes()).count(b"\n") == len(DRIVE)  # any reader of gzip will do


@settings(max_examples=40, deadline=None)
@given(cut=st.integers(0, 100_000))
def test_a_file_cut_anywhere_keeps_its_whole_blocks(tmp_path_factory: pytest.TempPathFactory, cut: int) -> None:
    directory = tmp_path_factory.mktemp("cut")
    blocks = [packed_block(take(DRIVE, slice(n, n + 500)), "can0") for n in (0, 500, 1000)]
    content = b"".join(blocks)[: cut % (sum(map(len, blocks)) + 1)]
    (directory / "00000007-20260922T000000Z.log.gz").write_bytes(content)
    ends = np.cumsum([len(block) for block in blocks])
    n_whole = int(np.count_nonzero(ends <= len(content)))
    log = recorded(directory, take(DRIVE, slice(1500, None)))
    kept = [path.read_bytes() for path in files(directory)]
    assert kept[0][: len(b"".join(blocks[:n_whole]))] == b"".join(blocks[:n_whole])
    assert len(kept) == 1 + bool(n_whole)  # what held nothing whole is gone
    assert sum(segment.n_frames for segment in log.segments()) == 500 * n_whole + len(DRIVE) - 1500
    whole = directory / "whole.log.gz"
    whole.write_bytes(b"".join(kept))
    assert len(read(whole)) == 500 * n_whole + len(DRIVE) - 1500


def test_zeros_where_a_block_should_be_are_cut_off(tmp_path: Path) -> None:
    """A file system that had grown the file and not yet written it."""
    blocks = [packed_block(take(DRIVE, slice(n, n + 500)), "can0") for n in (0, 500)]
    path = tmp_path / "00000001-20260922T000000Z.log.gz"
    path.write_bytes(blocks[0] + blocks[1][:50] + bytes(len(blocks[1]) - 50))
    log = recorded(tmp_path, take(DRIVE, slice(1000, None)))
    assert path.read_bytes() == blocks[0]
    assert log.segments()[0].n_blocks == 1


def test_the_oldest_give_way(tmp_path: Path) -> None:
    n_bytes = len(packed_block(DRIVE, "can0"))
    limits = RingLimits(max_bytes=3 * n_bytes, max_daily_bytes=10**9, free_bytes=0, block_s=3600.0)
    log = recorded(tmp_path, *[DRIVE] * 7, limits=limits)
    assert [number_of(segment.name) for segment in log.segments()] == [5, 6, 7]
    assert sum(path.stat().st_size for path in files(tmp_path)) <= limits.max_bytes


def test_a_clock_that_steps_back_changes_no_order(tmp_path: Path) -> None:
    early = Frames(DRIVE.t_ns - DRIVE.t_ns[0], *(getattr(DRIVE, name) for name in Frames.__slots__[1:]))
    log = recorded(tmp_path, DRIVE, early, DRIVE)
    assert [number_of(segment.name) for segment in log.segments()] == [1, 2, 3]
    assert log.segments()[1].name == "00000002-19700101T000000Z.log.gz"


def test_no_more_than_the_days_bytes_and_the_next_day_again(tmp_path: Path) -> None:
    n_bytes = len(packed_block(DRIVE, "can0"))
    limits = RingLimits(max_bytes=10**9, max_daily_bytes=2 * n_bytes, free_bytes=0, block_s=3600.0)
    now_s = 1_790_000_000.0
    recorded(tmp_path, DRIVE, DRIVE, limits=limits, clock_s=lambda: now_s)
    for path in files(tmp_path):
        os.utime(path, (now_s, now_s))
    log = recorded(tmp_path, DRIVE, limits=limits, clock_s=lambda: now_s)  # over a restart, too
    assert (log.status().n_frames_written, log.status().n_frames_dropped) == (0, len(DRIVE))
    assert "max_daily_mb" in str(log.fault)
    assert recorded(tmp_path, DRIVE, limits=limits, clock_s=lambda: now_s + 86_400.0).fault is None


def test_a_disk_that_refuses_is_waited_for(tmp_path: Path) -> None:
    directory = tmp_path / "record"
    directory.write_text("a file where the folder should be")
    log = RingLog(directory, "can0", RingLimits(10**9, 10**9, 0, block_s=0.01), retry_s=0.01)
    log.start()
    log.put(DRIVE)
    assert wait_until(lambda: log.fault is not None)
    assert (log.status().n_frames_held, log.segments()) == (len(DRIVE), ())
    directory.unlink()
    assert wait_until(lambda: log.status().n_frames_written == len(DRIVE))
    assert (log.fault, log.status().n_frames_dropped) == (None, 0)
    log.stop(PATIENCE_S)


def test_what_waits_is_bounded_and_the_rest_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.bus.ring.ring_log.HELD_FRAMES", 3 * len(DRIVE))
    (tmp_path / "record").write_text("")
    log = RingLog(tmp_path / "record", "can0", RingLimits(10**9, 10**9, 0, block_s=0.01), retry_s=PATIENCE_S)
    log.start()
    for _ in range(5):
        log.put(DRIVE)
    told = log.status()
    assert (told.n_frames_held, told.n_frames_dropped) == (3 * len(DRIVE), 2 * len(DRIVE))
    log.stop(PATIENCE_S)
    assert log.status().n_frames_dropped == 5 * len(DRIVE)


def test_a_disk_with_little_room_is_left_alone(tmp_path: Path) -> None:
    log = recorded(tmp_path, DRIVE, limits=RingLimits(10**9, 10**9, free_bytes=10**18, block_s=3600.0))
    assert "free_mb" in str(log.fault)
    assert (files(tmp_path), log.status().n_frames_dropped) == ([], len(DRIVE))


def test_foreign_files_are_neither_counted_nor_removed(tmp_path: Path) -> None:
    for name in ("notes.txt", "1-20260922T000000Z.log.gz", "00000001-20260922T000000Z.log.gz.part"):
        (tmp_path / name).write_text("mine")
    log = recorded(tmp_path, DRIVE, limits=RingLimits(1, 10**9, 0, 3600.0))
    assert len(log.segments()) == 1
    assert len(list(tmp_path.iterdir())) == 4


def test_a_link_with_a_segments_name_is_not_followed(tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.write_text("secret")
    (tmp_path / "record").mkdir()
    (tmp_path / "record" / "00000001-20260922T000000Z.log.gz").symlink_to(elsewhere)
    log = recorded(tmp_path / "record", DRIVE)
    assert log.fault is not None
    assert (elsewhere.read_text(), log.segments()) == ("secret", ())


@pytest.mark.parametrize(
    "name", ["", "..", "../springscale.db", "/etc/passwd", "00000001-20260922T000000Z.log.gz\0", "notes.txt"]
)
def test_only_listed_segments_are_opened(tmp_path: Path, name: str) -> None:
    (tmp_path / "record").mkdir()
    (tmp_path / "record" / "notes.txt").write_text("mine")
    assert recorded(tmp_path / "record", DRIVE).open(name) is None


def test_a_segment_that_is_let_go_is_read_to_its_end(tmp_path: Path) -> None:
    log = recorded(tmp_path, DRIVE)
    opened = log.open(log.segments()[0].name)
    file, n_bytes = opened
    files(tmp_path)[0].unlink()
    with file:
        assert len(file.read()) == n_bytes
    assert log.open(log.segments()[0].name) is None


def test_frames_longer_than_the_map_keeps_have_their_length(tmp_path: Path) -> None:
    """A CAN FD frame under a mapped identifier is refused for its length, live and from the log alike."""
    frames = frames_of((n * 10**9 + 1, 0x101, bytes(length)) for n, length in enumerate((8, 12, 2)))
    (path,) = [*files(tmp_path)] or (recorded(tmp_path, frames) and files(tmp_path))
    chunks, _ = open_whole_log(path)
    (found,) = list(chunks)
    assert found.length.tolist() == [8, 12, 2]
    assert found.t_ns.tolist() == frames.t_ns.tolist()


@pytest.mark.parametrize(
    ("channel", "written"), [("can0", b"can0"), ("/dev/tty USB0\n", b"/dev/tty_USB0_"), ("", b"can")]
)
def test_any_channels_name_makes_a_line(tmp_path: Path, channel: str, written: bytes) -> None:
    log = RingLog(tmp_path, channel, PLENTY)
    log.start()
    log.put(DRIVE)
    log.stop(PATIENCE_S)
    assert gzip.decompress(files(tmp_path)[0].read_bytes()).split(b" ", 2)[1] == written
    assert same(read(files(tmp_path)[0]), DRIVE)


def test_what_kills_the_recorder_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> bytes:
        raise ZeroDivisionError

    monkeypatch.setattr("gateway.bus.ring.ring_log.packed_block", broken)
    assert "ZeroDivisionError" in str(recorded(tmp_path, DRIVE).fault)


def test_no_thread_waits_for_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    release = threading.Event()
    real: Callable[[int], None] = os.fdatasync
    monkeypatch.setattr(os, "fdatasync", lambda file: (release.wait(PATIENCE_S), real(file)))
    log = RingLog(tmp_path, "can0", RingLimits(10**9, 10**9, 0, block_s=0.0))
    log.start()
    log.put(DRIVE)
    assert wait_until(lambda: bool(files(tmp_path)))
    log.put(DRIVE)  # returns though the disk does not
    assert log.segments() == ()  # nothing is shown before it is safe
    release.set()
    log.stop(PATIENCE_S)
    assert log.status().n_frames_written == 2 * len(DRIVE)


def test_what_a_stop_leaves_behind_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A disk that hangs holds the stop no longer than it may, and the frames went without a word."""
    release, real = threading.Event(), os.fdatasync
    monkeypatch.setattr(os, "fdatasync", lambda file: (release.wait(PATIENCE_S), real(file)))
    log = RingLog(tmp_path, "can0", PLENTY)
    log.start()
    log.put(DRIVE)
    log.stop(0.05)
    assert fields_of(caplog, Event.RECORD_REFUSED)["n_frames_held"] == len(DRIVE)
    release.set()
    assert wait_until(lambda: not log.status().n_frames_held)
