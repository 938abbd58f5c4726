"""ASAM measurement files with bus frames: one table or many, with what tools leave out, packed, cut and damaged."""

from dataclasses import replace

import numpy as np
import pytest
from support.mdf_blocks import write_variable_mf4
from support.mf4 import can_group, write_mf4

from gateway.bus.frames import join, merge_frames, take
from gateway.bus.logs import mf4, open_whole_log
from gateway.bus.logs.open import open_log
from gateway.bus.signals import load_signal_map
from gateway.errors import LogUnreadableError
from gateway.records import EXTENDED_ID, Frames

START_NS = 1_760_146_908_000_000_000
N = 5000


@pytest.fixture(scope="module")
def frames() -> Frames:
    """Classic frames of ten identifiers, every other one of 29 bits."""
    rng = np.random.default_rng(3)
    ids = np.array([0x100 + i if i % 2 else (0x18FEF100 + i) | EXTENDED_ID for i in range(10)], np.uint32)
    length = rng.integers(0, 9, N).astype(np.uint8)
    payload = np.where(np.arange(8) < length[:, None], rng.integers(0, 256, (N, 8)), 0).astype(np.uint8)
    t_ns = START_NS + np.cumsum(rng.integers(1, 900, N)) * 1000
    return Frames(t_ns, rng.choice(ids, N), length, payload)


def read(path, channel=None):
    chunks, report = open_whole_log(path, channel)
    return join(list(chunks), 64), report


def assert_same(found: Frames, truth: Frames) -> None:
    np.testing.assert_array_equal(found.t_ns, truth.t_ns)
    np.testing.assert_array_equal(found.can_id, truth.can_id)
    np.testing.assert_array_equal(found.length, truth.length)
    width = truth.payload.shape[1]
    np.testing.assert_array_equal(found.payload[:, :width], truth.payload)
    assert not found.payload[:, width:].any()


@pytest.mark.parametrize("n_at_once", [7, 100, 100_000])
def test_tables_of_every_identifier_are_merged_in_order_of_time(n_at_once, tmp_path, frames, monkeypatch):
    monkeypatch.setattr(mf4, "PIECE_RECORDS", n_at_once)
    few = take(frames, slice(0, 700))
    groups = [can_group(take(few, few.can_id == can_id), START_NS) for can_id in np.unique(few.can_id)]
    write_mf4(tmp_path / "a.mf4", START_NS, groups)
    found, report = read(tmp_path / "a.mf4")
    assert_same(found, few)
    assert report.out_of_order == 0


def test_a_table_without_a_mapped_frame_is_passed_over(tmp_path, frames):
    """It was taken for a damage, and the tables behind it were not read."""
    speed = frames.t_ns[:10]
    mapped = Frames(speed + 1, np.full(10, 0x130, np.uint32), frames.length[:10], frames.payload[:10])
    groups = [can_group(take(frames, frames.can_id == 0x101), START_NS), can_group(mapped, START_NS)]
    write_mf4(tmp_path / "a.mf4", START_NS, groups)
    chunks, report = open_log(tmp_path / "a.mf4", load_signal_map("springscale:reference"))
    assert (len(join(list(chunks), 8)), report.ended_early) == (10, None)


def test_can_fd_frames_of_any_length(tmp_path):
    lengths = np.array([0, 8, 12, 16, 20, 24, 32, 48, 64], np.uint8)
    payload = np.where(np.arange(64) < lengths[:, None], np.arange(1, 65), 0).astype(np.uint8)
    t_ns = START_NS + np.arange(9) * 1_000_000
    fd = Frames(t_ns, np.full(9, 0x123, np.uint32), lengths, payload)
    write_mf4(tmp_path / "a.mf4", START_NS, [can_group(fd, START_NS)])
    assert_same(read(tmp_path / "a.mf4")[0], fd)
    write_mf4(tmp_path / "coded.mf4", START_NS, [can_group(fd, START_NS, without=["DataLength"])])
    assert_same(read(tmp_path / "coded.mf4")[0], fd)


def test_without_a_word_on_width_an_identifier_beyond_11_bits_has_29(tmp_path, frames):
    write_mf4(tmp_path / "a.mf4", START_NS, [can_group(frames, START_NS, without=["IDE", "BusChannel"])])
    found, report = read(tmp_path / "a.mf4", channel="can7")  # a file that keeps no channel matches every name
    assert_same(found, frames)
    assert report.other_channel == 0


def test_remote_and_error_frames_are_counted_not_read(tmp_path, frames):
    ten = take(frames, slice(0, 10))
    others = [can_group(ten, START_NS, name=name) for name in ("CAN_RemoteFrame", "CAN_ErrorFrame")]
    write_mf4(tmp_path / "a.mf4", START_NS, [can_group(frames, START_NS), *others])
    found, report = read(tmp_path / "a.mf4")
    assert_same(found, frames)
    assert (report.frames, report.remote_frames, report.error_frames) == (N + 10, 10, 10)


def test_frames_of_other_buses_are_none_of_ours(tmp_path, frames):
    lin = can_group(frames, START_NS, bus_type=3)
    write_mf4(tmp_path / "a.mf4", START_NS, [lin])
    _, report = read(tmp_path / "a.mf4")
    with pytest.raises(LogUnreadableError, match="holds no CAN frame"):
        report.require_frames()


def test_a_file_damaged_in_the_middle_gives_what_lies_before(tmp_path, frames):
    """Deflated blocks of four megabytes: the first is sound, the second is not."""
    many = merge_frames([replace(frames, t_ns=frames.t_ns + i * 10**10) for i in range(60)])
    write_mf4(tmp_path / "a.mf4", START_NS, [can_group(many, START_NS)], compression=1)
    content = bytearray((tmp_path / "a.mf4").read_bytes())
    last = content.rindex(b"##DZ")
    assert last > content.index(b"##DZ")
    content[last + 100 : last + 4000] = bytes(3900)
    (tmp_path / "a.mf4").write_bytes(content)
    found, report = read(tmp_path / "a.mf4")
    assert 50_000 < len(found) < len(many)
    assert_same(found, take(many, slice(0, len(found))))
    assert report.ended_early.startswith("the file is damaged: ")


@pytest.mark.parametrize("content", [b"", b"MDF     4.10    ", b"no such thing" * 100])
def test_what_is_no_measurement_is_refused(content, tmp_path):
    (tmp_path / "a.mf4").write_bytes(content)
    with pytest.raises(LogUnreadableError, match=r"a\.mf4: (cannot be read as \.mf4: |is empty)"):
        read(tmp_path / "a.mf4")


def test_payloads_kept_apart_from_the_records(tmp_path):
    """As loggers of CAN FD do; the file is made byte by byte after the standard, not by asammdf."""
    rng = np.random.default_rng(9)
    lengths = [8, 64, 0, 12, 1, 48]
    frames = [(0.01 * i, 0x123 + i, i % 2 == 0, rng.bytes(n)) for i, n in enumerate(lengths)]
    write_variable_mf4(tmp_path / "a.mf4", START_NS, frames)
    found, report = read(tmp_path / "a.mf4", channel="can1")
    payloads = [row[:n].tobytes() for row, n in zip(found.payload, found.length, strict=True)]
    assert payloads == [payload for *_, payload in frames]
    assert found.can_id.tolist() == [can_id | (EXTENDED_ID if is_29 else 0) for _, can_id, is_29, _ in frames]
    np.testing.assert_array_equal(found.t_ns, START_NS + 10_000_000 * np.arange(len(frames)))
    assert report.channels == {"1"}


def test_one_of_several_channels(tmp_path, frames):
    channel = np.arange(N) % 3
    write_mf4(tmp_path / "a.mf4", START_NS, [can_group(frames, START_NS, channel=channel)])
    found, report = read(tmp_path / "a.mf4", channel="can2")
    assert_same(found, take(frames, channel == 2))
    assert (report.frames, report.wanted, report.other_channel) == (N, len(found), N - len(found))
    assert report.channels == {"0", "1", "2"}
