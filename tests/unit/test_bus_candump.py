"""The bulk reader on logs as they are found, packed or not: what is read and counted, and that nothing ends a run."""

import gzip
import lzma
import random
import tracemalloc

import numpy as np
import pytest

from gateway.bus.frames import join
from gateway.bus.logs import LogReport
from gateway.bus.logs.candump import read_candump
from gateway.bus.logs.log_report import LogReject, Selection
from gateway.bus.logs.open import open_whole_log
from gateway.bus.logs.packed import open_log_file, unpacked_suffix, zstd
from gateway.bus.signals.mapping import IdFilter, exact_filter, j1939_filter
from gateway.errors import LogUnreadableError
from gateway.records import EXTENDED_ID, Frames

WANTED = (exact_filter(0x120), exact_filter(0x18FEF100 | EXTENDED_ID))
GOOD = b"(1627274455.012500) can1 120#0011223344556677\n"
GOOD_NS = 1627274455_012500_000


@pytest.fixture
def read(tmp_path):
    def read(text, filters=WANTED, channel="can1", width=8, name="a.log", **options):
        path = tmp_path / name
        path.write_bytes(text)
        report = LogReport(path)
        chunks = list(read_candump(Selection(report, filters, channel, width), **options))
        return join(chunks, width), report

    return read


def rows(frames: Frames):
    return [
        (int(t), int(i), p[:n].tobytes())
        for t, i, n, p in zip(frames.t_ns, frames.can_id, frames.length, frames.payload, strict=True)
    ]


SOUND_LINES = {
    "nanoseconds": (b"(1627274455.012500001) can1 120#0011223344556677\n", GOOD_NS + 1),
    "few decimals": (b"(1627274455.0125) can1 120#0011223344556677\n", GOOD_NS),
    "relative stamps": (b"(3.000001) can1 120#0011223344556677\n", 3_000_001_000),
    "padded relative stamps": (b"(0000000003.000001) can1 120#0011223344556677\n", 3_000_001_000),
    "lower case": (b"(1627274455.012500) can1 120#0011223344556677\n".lower(), GOOD_NS),
    "CRLF": (GOOD.replace(b"\n", b"\r\n"), GOOD_NS),
    "direction suffix": (GOOD.replace(b"\n", b" R\n"), GOOD_NS),
    "direction suffix and CRLF": (GOOD.replace(b"\n", b" T\r\n"), GOOD_NS),
    "no final newline": (GOOD.rstrip(b"\n"), GOOD_NS),
    "trailing blanks": (GOOD.replace(b"\n", b" \t \n"), GOOD_NS),
    "two blanks": (GOOD.replace(b") can1 ", b")  can1  "), GOOD_NS),
    "NULs before the line": (b"\0" * 100 + GOOD, GOOD_NS),
    "length code": (GOOD.replace(b"\n", b"_9\n"), GOOD_NS),
    "last stamp of all": (b"(9223372035.999999999) can1 120#0011223344556677\n", 9223372035_999999999),
}


@pytest.mark.parametrize("kind", SOUND_LINES)
def test_a_sound_line_of_any_kind_is_read(kind, read):
    line, t_ns = SOUND_LINES[kind]
    frames, report = read(GOOD + line)
    assert rows(frames) == [(t, 0x120, bytes.fromhex("0011223344556677")) for t in (GOOD_NS, t_ns)]
    assert report.n_rejected == 0


DIRTY_LINES = {
    "half a byte": (b"(1627274455.012500) can1 120#010\n", LogReject.HALF_BYTE),
    "no hexadecimal": (b"(1627274455.012500) can1 120#00112233445566zz\n", LogReject.BAD_PAYLOAD),
    "no ASCII": (b"(1627274455.012500) can1 120#00\xff1\n", LogReject.BAD_PAYLOAD),
    "nine bytes": (b"(1627274455.012500) can1 120#001122334455667788\n", LogReject.TOO_LONG),
    "cut at the front": (b"4455.012500) can1 120#0011223344556677\n", LogReject.BAD_TIME),
    "cut in the stamp": (b"(162727\n", LogReject.NO_FRAME),
    "cut before the mark": (b"(1627274455.012500) can1 12\n", LogReject.NO_FRAME),
    "joined to the next": (b"(1627274455.012500) can1 120#0011(1627274455.0\n", LogReject.BAD_PAYLOAD),
    "NULs inside": (b"(1627274455.012500) can1\0\0\0 120#0011223344556677\n", LogReject.NUL_BYTES),
    "stamp without a point": (b"(1627274455) can1 120#0011223344556677\n", LogReject.BAD_TIME),
    "stamp beyond 2262": (b"(9999999999.000000) can1 120#0011223344556677\n", LogReject.BAD_TIME),
    "negative stamp": (b"(-1.000000) can1 120#0011223344556677\n", LogReject.BAD_TIME),
    "no channel": (b"(1627274455.012500) 120#0011223344556677\n", LogReject.GARBLED),
    "words": (b"candump: write error: no space left on device\n", LogReject.NO_FRAME),
    "another tool's format": (b"  can1  120   [8]  00 11 22 33 44 55 66 77\n", LogReject.NO_FRAME),
    "identifier of 30 bits": (b"(1627274455.012500) can1 58FEF100#00\n", LogReject.BAD_ID),
}


@pytest.mark.parametrize("kind", DIRTY_LINES)
def test_a_dirty_line_is_rejected_by_reason_and_number_and_the_rest_is_read(kind, read):
    line, reason = DIRTY_LINES[kind]
    filters = (*WANTED, j1939_filter(0x18FEF100))
    frames, report = read(GOOD + line + GOOD + line + GOOD, filters)
    assert rows(frames) == [(GOOD_NS, 0x120, bytes.fromhex("0011223344556677"))] * 3
    assert {r: (n.count, n.first_lines) for r, n in report.rejects.items()} == {reason: (2, [2, 4])}


def test_only_the_first_line_numbers_are_kept_but_all_are_counted(read):
    _, report = read(b"(1627274455.012500) can1 120#010\n" * 1000)
    rejected = report.rejects[LogReject.HALF_BYTE]
    assert (rejected.count, rejected.first_lines) == (1000, [1, 2, 3, 4, 5])


def test_line_numbers_count_on_over_blocks(read):
    _, report = read((GOOD * 500 + b"garbage\n" + GOOD * 10 + GOOD.replace(b"77\n", b"7\n")), block_bytes=4096)
    assert report.rejects[LogReject.NO_FRAME].first_lines == [501]
    assert report.rejects[LogReject.HALF_BYTE].first_lines == [512]
    assert report.lines == 512


OTHERS = {  # of a log with one frame that is wanted: further lines, filters, and what is counted of them
    "error frames": (
        b"(1627274455.012500) can1 20000004#0008000000000000\n", j1939_filter(0x00000000), {"error_frames": 1}
    ),
    "remote frames": (b"(1.0) can1 120#R\n(2.0) can1 120#R8\n", WANTED[0], {"remote_frames": 2}),
    "other channels": (
        GOOD.replace(b"can1", b"can0") * 2 + GOOD.replace(b"can1", b"vcan11"), WANTED[0], {"other_channel": 3}
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", OTHERS)
def test_what_is_no_wanted_frame_is_counted_not_read(kind, read):
    lines, id_filter, counted = OTHERS[kind]
    frames, report = read(GOOD + lines, (*WANTED, id_filter))
    assert (len(frames), report.left_out) == (1, counted)
    assert report.channels == ({"can0", "can1", "vcan11"} if kind == "other channels" else {"can1"})


def test_without_a_channel_all_are_read_in_order(read):
    frames, report = read(GOOD + b"(1627274455.012501) can0 120#01\n" + GOOD, channel=None)
    assert frames.length.tolist() == [8, 1, 8]
    assert report.out_of_order == 1


def test_can_fd_lines(read):
    frames, report = read(
        b"(1.000001) can1 120##1" + b"AB" * 64 + b"\n(1.000002) can1 120##0\n(1.000003) can1 120##101\n" + GOOD,
        width=64,
    )
    assert [len(p) for _, _, p in rows(frames)] == [64, 0, 1, 8]
    assert frames.payload[0].tolist() == [0xAB] * 64
    assert (report.frames, report.n_rejected) == (4, 0)


def test_j1939_frames_are_found_by_group(read):
    ids = [b"18FEF100", b"0CFEF1AB", b"18FEF200", b"1CEE2103", b"18EEFFAB", b"19FEF100"]
    text = b"".join(b"(1.0) can1 %s#00\n" % i for i in ids)
    frames, _ = read(text, (j1939_filter(0x18FEF1FE), j1939_filter(0x18EEFF00)))
    assert [f"{i & 0x1FFFFFFF:08X}".encode() for _, i, _ in rows(frames)] == [ids[0], ids[1], ids[3], ids[4]]


def test_a_mask_finer_than_a_digit_is_honoured(read):
    text = b"".join(b"(1.0) can1 %03X#00\n" % i for i in range(0x120, 0x130))
    frames, _ = read(text, (IdFilter(0x120, 0x7FC | EXTENDED_ID),))
    assert frames.can_id.tolist() == [0x120, 0x121, 0x122, 0x123]


@pytest.mark.parametrize("n_behind", [0, 2])
def test_a_hole_of_nuls_longer_than_a_block_is_passed_over(n_behind, read):
    frames, report = read(GOOD + b"\0" * 20_000 + GOOD * n_behind, block_bytes=4096)
    assert len(frames) == 1 + max(0, n_behind - 1)  # the line of the hole ends with the first behind it
    assert report.rejects[LogReject.OVERLONG_LINE].first_lines == [2]


def test_an_empty_log_and_blank_lines(read):
    assert read(b"")[1].lines == 0
    frames, report = read(b"\n\n" + GOOD + b"\r\n \n")
    assert (len(frames), report.lines, report.n_rejected) == (1, 5, 0)


def test_a_folder_or_a_missing_file_is_said_so(tmp_path):
    with pytest.raises(LogUnreadableError, match="Is a directory"):
        list(read_candump(Selection(LogReport(tmp_path), WANTED, None, 8)))
    with pytest.raises(LogUnreadableError, match="No such file"):
        list(read_candump(Selection(LogReport(tmp_path / "b.log"), WANTED, None, 8)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "holds no CAN frame"),
        (b"hello\n", "candump -L"),
        (b"(1.0) can1 7E8#00\n", "none of its 1 frames has an identifier"),
        (b"(1.0) can0 120#00\n", "the mapped frames are on can0 only; correct channel"),
    ],
)
def test_a_log_without_a_wanted_frame_says_why(text, message, read):
    _, report = read(text)
    with pytest.raises(LogUnreadableError, match=message):
        report.require_frames()


def test_the_report_tells_all_to_machines(read):
    _, report = read(GOOD + b"(1.0) can1 120#0\n")
    told = report.to_json()
    assert told["rejects"] == {"half_byte": {"count": 1, "first_lines": [2]}}
    assert (told["lines"], told["frames"], told["wanted"]) == (2, 2, 1)


@pytest.mark.parametrize(("start", "kind"), [(b"\x89PNG\r\n\x1a\n", "a picture"), (b"LOGG", "a BLF log")])
def test_another_kind_of_file_named_as_a_log_is_none(start, kind, tmp_path):
    path = tmp_path / "a.log"
    path.write_bytes(start + bytes(range(256)) * 40)
    with pytest.raises(LogUnreadableError, match=kind):
        open_whole_log(path)


PACK = {"gzip": gzip.compress, "zstd": zstd.compress, "xz": lzma.compress}


def text_of(n_lines, seed=1):
    """Lines that do not pack to nothing."""
    rng = random.Random(seed)
    return b"".join(b"(%d.%06d) can1 120#%016X\n" % (i, i, rng.getrandbits(64)) for i in range(n_lines))


SKIPPABLE = b"\x50\x2a\x4d\x18" + (4).to_bytes(4, "little") + b"size"  # pzstd writes one before every frame
PACKED = {
    **{f"{kind} of any name": pack(GOOD * 7) for kind, pack in PACK.items()},
    **{f"{kind} in two members": pack(GOOD * 3) + pack(GOOD * 4) + bytes(100) for kind, pack in PACK.items()},
    "skippable frames": SKIPPABLE + PACK["zstd"](GOOD * 3) + SKIPPABLE + PACK["zstd"](GOOD * 4),
}


@pytest.mark.parametrize("kind", PACKED)
def test_every_member_of_a_packed_log_is_read(kind, read):
    frames, report = read(PACKED[kind], name="a.log")
    assert (len(frames), report.ended_early) == (7, None)


@pytest.mark.parametrize("kind", PACK)
@pytest.mark.parametrize("share", [0.3, 0.7, 0.999])
def test_a_cut_log_gives_what_was_readable_and_says_so(kind, share, read):
    packed = PACK[kind](text_of(40_000))
    frames, report = read(packed[: int(share * len(packed))])
    assert share * 40_000 - 8000 < len(frames) <= 40_000
    assert report.ended_early == f"the {kind} stream is cut off"


@pytest.mark.parametrize("kind", PACK)
def test_a_log_behind_a_packed_one_is_not_lost_in_silence(kind, read):
    frames, report = read(PACK[kind](GOOD) + GOOD)
    assert (len(frames), report.ended_early) == (1, f"something that is not {kind} follows the packed log")


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
