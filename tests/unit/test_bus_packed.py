"""Packed logs: gzip, zstd and xz, whole, of several members, cut and damaged."""

import gzip
import lzma
import random
import tracemalloc

import numpy as np
import pytest

from gateway.bus.frames import join
from gateway.bus.logs import LogReport
from gateway.bus.logs.candump import read_candump
from gateway.bus.logs.packed import open_log_file, unpacked_suffix, zstd
from gateway.bus.signals.mapping import exact_filter

PACK = {"gzip": gzip.compress, "zstd": zstd.compress, "xz": lzma.compress}
LINE = b"(1627274455.012500) can1 120#0011223344556677\n"


def text_of(n_lines, seed=1):
    """Lines that do not pack to nothing."""
    rng = random.Random(seed)
    return b"".join(b"(%d.%06d) can1 120#%016X\n" % (i, i, rng.getrandbits(64)) for i in range(n_lines))


@pytest.fixture
def read(tmp_path):
    def read(content, name="a.log"):
        path = tmp_path / name
        path.write_bytes(content)
        report = LogReport(path)
        return join(list(read_candump(path, [exact_filter(0x120)], report=report)), 8), report

    return read


@pytest.mark.parametrize("kind", PACK)
def test_a_packed_log_is_known_by_its_content_not_its_name(kind, read):
    frames, report = read(PACK[kind](LINE * 10), name="a.log")
    assert len(frames) == 10
    assert report.ended_early is None


@pytest.mark.parametrize("kind", PACK)
def test_every_member_of_a_packed_log_is_read(kind, read):
    assert len(read(PACK[kind](LINE * 3) + PACK[kind](LINE * 4) + bytes(100))[0]) == 7


def test_a_skippable_zstd_frame_holds_no_lines(read):
    """pzstd writes one before every frame."""
    skippable = b"\x50\x2a\x4d\x18" + (4).to_bytes(4, "little") + b"size"
    frames, report = read(skippable + PACK["zstd"](LINE * 3) + skippable + PACK["zstd"](LINE * 4))
    assert len(frames) == 7
    assert report.ended_early is None


@pytest.mark.parametrize("kind", PACK)
@pytest.mark.parametrize("share", [0.3, 0.7, 0.999])
def test_a_cut_log_gives_what_was_readable_and_says_so(kind, share, read):
    packed = PACK[kind](text_of(40_000))
    frames, report = read(packed[: int(share * len(packed))])
    assert share * 40_000 - 8000 < len(frames) <= 40_000
    assert report.ended_early == f"the {kind} stream is cut off"


@pytest.mark.parametrize("kind", PACK)
def test_damage_is_told_and_what_lies_before_it_is_read(kind, read):
    """zstd guards nothing but the whole: there damage may show only in lines that are none."""
    text = text_of(40_000)
    packed = bytearray(PACK[kind](text))
    middle = len(packed) // 2
    packed[middle : middle + 4000] = bytes(4000)
    frames, report = read(packed)
    sound, _ = read(text)
    assert len(frames) < 40_000
    np.testing.assert_array_equal(frames.payload[:12_000], sound.payload[:12_000])
    assert report.n_rejected or report.ended_early
    assert report.ended_early is None or report.ended_early.startswith(f"the {kind} stream is damaged")


@pytest.mark.parametrize("kind", PACK)
def test_memory_does_not_grow_with_what_is_inside(kind, tmp_path):
    """A hundred megabytes of one letter pack to a few kilobytes, and are never held at once."""
    (tmp_path / "bomb.log").write_bytes(PACK[kind](bytes(100_000_000)))
    tracemalloc.start()
    with open_log_file(tmp_path / "bomb.log") as file:
        n_bytes = sum(map(len, iter(lambda: file.read(1 << 20), b"")))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert n_bytes == 100_000_000
    assert peak < 20_000_000


@pytest.mark.parametrize("suffix", ["", ".gz", ".zst", ".xz", ".ZST"])
def test_the_kind_of_a_log_is_what_stands_before_the_packing(suffix, tmp_path):
    assert unpacked_suffix(tmp_path / f"a.BLF{suffix}") == ".blf"
