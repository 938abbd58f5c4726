"""Logs that no recorder writes: each is counted or refused in words, at once; none is read for ever."""

import re
import struct
import time
from collections.abc import Callable
from pathlib import Path

import can
import pytest

from gateway.bus.frames import join
from gateway.bus.logs import open_whole_log
from gateway.bus.logs.log_report import LogReport
from gateway.errors import LogUnreadableError
from gateway.records import Frames

ASC = "date 2023-03-10 15:06:12\nbase hex  timestamps absolute\ninternal events logged\n"
SOUND = {
    ".log": "(1790000000.5) can0 123#0102\n",
    ".asc": "   0.500000 1  123             Rx   d 2 01 02\n",
    ".trc": "     1)      500.0  Rx  0123  2  01 02\n",
}
HEADS = {".asc": ASC, ".trc": ";$FILEVERSION=1.1\n", ".log": ""}


def read(path: Path) -> tuple[Frames, LogReport]:
    chunks, report = open_whole_log(path)
    return join(list(chunks), 64), report


LINES = {
    "an identifier of 33 bits": (".asc", "   0.6 1  1FFFFFFFF             Rx   d 2 01 02\n", "bad id"),
    "an identifier of 12 bits": (".asc", "   0.6 1  1234             Rx   d 2 01 02\n", "bad id"),
    "an identifier of a hundred digits": (".asc", f"   0.6 1  {'1' * 100}x             Rx   d 2 01 02\n", "bad id"),
    "a stamp beyond 64 bits": (".asc", "99999999999.6 1  123             Rx   d 2 01 02\n", "bad time"),
    "a line of letters": (".trc", "a" * 60_000 + "\n", "no frame"),
    "a line of digits": (".trc", "1" * 60_000 + "\n", "no frame"),
}


@pytest.mark.parametrize("kind", LINES)
def test_a_line_that_holds_no_frame_is_counted_with_its_reason(kind: str, tmp_path: Path) -> None:
    suffix, line, said = LINES[kind]
    path = tmp_path / f"a{suffix}"
    path.write_text(HEADS[suffix] + SOUND[suffix] + line + SOUND[suffix])
    begun_s = time.process_time()
    frames, report = read(path)
    assert time.process_time() - begun_s < 2.0
    assert (len(frames), report.n_rejected, report.frames, report.other_identifiers) == (2, 1, 3, 0)
    (remark,) = (remark for remark in report.remarks() if f"left out, {said}" in remark)
    assert len(remark) < 400


def test_error_frames_of_classes_that_do_not_exist_are_error_frames(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_text(SOUND[".log"] + "(1790000000.6) can0 2FFFFFFF#0000000000000000\n")
    _, report = read(tmp_path / "a.log")
    assert (report.frames, report.wanted, report.error_frames, report.other_identifiers) == (1, 1, 1, 0)


@pytest.mark.parametrize("date", ["A" * 60_000, "1" * 60_000, "1:" * 30_000, "jan " * 15_000])
def test_a_date_of_any_length_is_looked_at_once(date: str, tmp_path: Path) -> None:
    (tmp_path / "a.asc").write_text(f"date {date}\n{ASC.partition(chr(10))[2]}{SOUND['.asc']}")
    begun_s = time.process_time()
    frames, report = read(tmp_path / "a.asc")
    assert time.process_time() - begun_s < 2.0
    assert len(frames) == 1
    assert not report.is_dated


def blf(path: Path) -> bytearray:
    """Two frames in one container that is not compressed."""
    with can.BLFWriter(path, compression_level=0) as writer:
        for n in range(2):
            writer.on_message_received(can.Message(timestamp=1_790_000_000.0 + n, arbitration_id=0x123, data=b"12"))
    return bytearray(path.read_bytes())


def of_no_length(content: bytearray) -> None:
    at = content.rindex(b"LOBJ")
    content[at + 8 : at + 12] = bytes(4)


def of_all_lengths(content: bytearray) -> None:
    at = content.index(b"LOBJ")
    content[at + 8 : at + 12] = struct.pack("<L", 3)


def packed_otherwise(content: bytearray) -> None:
    content[content.index(b"LOBJ") + 16] = 7


@pytest.mark.parametrize(
    ("spoil", "said"),
    [(of_no_length, "absurd length"), (of_all_lengths, "no beginning"), (packed_otherwise, "unknown method 7")],
)
def test_an_absurd_object_ends_a_blf(spoil: Callable[[bytearray], None], said: str, tmp_path: Path) -> None:
    content = blf(tmp_path / "a.blf")
    assert len(read(tmp_path / "a.blf")[0]) == 2
    spoil(content)
    (tmp_path / "a.blf").write_bytes(content)
    with pytest.raises(LogUnreadableError, match=said):
        read(tmp_path / "a.blf")


def other_versions(content: bytearray) -> None:
    """Writes other version numbers into both headers; python-can ignores them."""
    first, second = (found.start() for found in re.finditer(b"LOBJ", content) if found.start() > 150)
    content[first + 6], content[second + 6] = 3, 0


def without_details(content: bytearray) -> None:
    """The second frame becomes an error frame of the old kind."""
    at = content.rindex(b"LOBJ")
    content[at + 12] = 2


@pytest.mark.parametrize(
    ("spoil", "n_frames", "left_out", "said"),
    [
        (other_versions, 0, {"unknown_version": 2}, "unknown version: 2: 'header of version 3'"),
        (without_details, 1, {"error_frames": 1}, None),
    ],
)
def test_no_frame_of_a_blf_is_passed_over_without_a_count(
    spoil: Callable[[bytearray], None], n_frames: int, left_out: dict[str, int], said: str | None, tmp_path: Path
) -> None:
    content = blf(tmp_path / "a.blf")
    spoil(content)
    (tmp_path / "a.blf").write_bytes(content)
    frames, report = read(tmp_path / "a.blf")
    assert (len(frames), report.left_out) == (n_frames, left_out)
    assert said is None or any(said in remark for remark in report.remarks())
