"""Binary logs as they are found: cut, damaged, of several channels, larger than memory likes."""

import tracemalloc

import numpy as np
import pytest
from support.blf import CLASSIC, FD, FD64, blf_object, classic, fd, fd64, write_blf

from gateway.bus.frames import join
from gateway.bus.logs import open_whole_log
from gateway.bus.logs.report import LogReject
from gateway.errors import LogUnreadableError

N = 400
CONTENT = b"".join(
    blf_object(CLASSIC, i * 1_000_000, classic(1 + i % 2, 0x100 + i, i.to_bytes(8, "little"))) for i in range(N)
)
N_BYTES = len(CONTENT) // N


@pytest.fixture
def read(tmp_path):
    def read(change=bytes, channel=None, **how):
        path = tmp_path / "a.blf"
        write_blf(path, **{"content": CONTENT, "cuts": range(1000, len(CONTENT), 1000)} | how)
        path.write_bytes(change(path.read_bytes()))
        chunks, report = open_whole_log(path, channel)
        return join(list(chunks), 64), report

    return read


def test_objects_go_on_over_the_ends_of_containers(read):
    frames, report = read()
    np.testing.assert_array_equal(frames.can_id, 0x100 + np.arange(N))
    np.testing.assert_array_equal(np.diff(frames.t_ns), 1_000_000)
    assert report.channels == {"0", "1"}
    assert report.ended_early is None


def test_one_of_several_channels(read):
    frames, report = read(channel="can1")
    np.testing.assert_array_equal(frames.can_id, 0x100 + np.arange(1, N, 2))
    assert (report.frames, report.wanted, report.other_channel) == (N, N // 2, N // 2)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9, 0.999])
def test_a_cut_file_gives_what_it_holds_and_says_so(share, read):
    frames, report = read(lambda content: content[: int(share * len(content))], method=0)
    assert share * N - 5 < len(frames) < N
    assert report.ended_early == "the file is cut off: shorter than its header says"


def test_a_damaged_container_costs_its_own_frames_alone(read):
    def damage(content):
        second = content.index(b"LOBJ", content.index(b"LOBJ", 144) + 4)
        return content[: second + 40] + bytes(200) + content[second + 240 :]

    frames, report = read(damage, cuts=[100 * N_BYTES + 7, 200 * N_BYTES + 9])
    left = {*range(100), *range(201, N)}  # the objects cut by its ends are lost with it
    assert set(frames.can_id - 0x100) == left
    assert report.rejects[LogReject.DAMAGED_BLOCK].count == 1
    assert report.ended_early is None


def test_a_damaged_object_costs_itself_alone(read):
    content = bytearray(CONTENT)
    content[50 * N_BYTES : 50 * N_BYTES + 4] = b"JUNK"
    content[80 * N_BYTES + 8 : 80 * N_BYTES + 12] = b"\xff\xff\xff\x7f"  # as if two gigabytes long
    frames, report = read(content=bytes(content))
    assert set(range(N)) - set(frames.can_id - 0x100) == {50, 80}
    assert report.rejects[LogReject.GARBLED].count == 2


def test_a_file_damaged_between_containers_ends_there(read):
    frames, report = read(lambda content: content.replace(b"LOBJ", b"JUNK").replace(b"JUNK", b"LOBJ", 3), method=2)
    assert 50 < len(frames) < 70
    assert report.ended_early == "the file is damaged: no object begins where one should"


def test_a_container_packed_by_an_unknown_method_is_counted(read):
    frames, report = read(method=7)
    assert len(frames) == 0
    assert report.rejects[LogReject.DAMAGED_BLOCK].count == 20


@pytest.mark.parametrize("kind", ["FD", "FD64"])
def test_can_fd_frames(kind, read):
    payload = bytes(range(48))
    body = fd(3, 0x9234_5678, payload) if kind == "FD" else fd64(3, 0x9234_5678, payload)
    frames, report = read(content=blf_object(FD if kind == "FD" else FD64, 1000, body), cuts=[])
    assert frames.payload[0, : frames.length[0]].tobytes() == payload
    assert (int(frames.can_id[0]), report.channels) == (0x9234_5678, {"2"})


def test_a_stamp_beyond_all_time_is_refused(read):
    _, report = read(content=blf_object(CLASSIC, 2**64 - 1, classic(1, 0x100, b"")), cuts=[])
    assert {reason: n.count for reason, n in report.rejects.items()} == {LogReject.BAD_TIME: 1}


def test_without_a_start_stamps_are_relative(read):
    frames, _ = read(lambda content: content[:40] + bytes(32) + content[72:])
    assert frames.t_ns[1] == 1_000_000


@pytest.mark.parametrize("year", [1, 1601, 2263, 9999])
def test_a_start_beyond_all_time_refuses_every_stamp(year, read):
    """A damaged year ended in numpy's OverflowError."""
    frames, report = read(lambda content: content[:40] + year.to_bytes(2, "little") + content[42:])
    assert len(frames) == 0
    assert {reason: n.count for reason, n in report.rejects.items()} == {LogReject.BAD_TIME: N}


@pytest.mark.parametrize("content", [b"", b"LOGG", b"no such thing" * 100])
def test_what_is_no_blf_is_refused(content, read):
    with pytest.raises(LogUnreadableError, match=r"a\.blf: cannot be read as \.blf: it does not begin like one"):
        read(lambda _: content)


def test_memory_does_not_grow_with_the_file(tmp_path):
    peaks = []
    for n_times in (200, 800):
        write_blf(tmp_path / "a.blf", CONTENT * n_times, range(0, N_BYTES * N * n_times, 128 << 10), method=2)
        tracemalloc.start()
        chunks, report = open_whole_log(tmp_path / "a.blf")
        assert sum(map(len, chunks)) == report.frames == N * n_times
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]
