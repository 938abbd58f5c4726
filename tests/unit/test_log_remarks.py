"""What `springscale estimate` says of a log that is not quite sound, beside what it weighs by it."""

import pytest
from click.testing import CliRunner

from gateway.bus.logs import open_whole_log
from gateway.bus.logs.packed import zstd
from gateway.cli import springscale

LINE = "({:.6f}) {} 120#0011223344556677\n"


@pytest.fixture
def log(tmp_path):
    def log(*lines):
        (tmp_path / "a.log").write_text("".join(lines))
        return tmp_path / "a.log"

    return log


def remarks(path, channel=None):
    chunks, report = open_whole_log(path, channel)
    for _ in chunks:
        pass
    return list(report.remarks())


def test_nothing_is_said_of_a_sound_log(log):
    assert remarks(log(*(LINE.format(i, "can0") for i in range(9)))) == []


def test_lines_left_out_are_counted_by_reason(log):
    path = log(LINE.format(1, "can0"), "(2.0) can0 120#011\n", "nonsense\n", "nonsense\n")
    assert set(remarks(path)) == {
        f"{path}: left out, half byte: 1, first in line 2",
        f"{path}: left out, no frame: 2, first in line 3",
    }


def test_frames_of_several_channels_are_told_unless_one_is_named(log):
    path = log(LINE.format(1, "can0"), LINE.format(1, "can1"))
    assert remarks(path) == [
        f"{path}: mapped frames are on can0, can1; if these are one bus twice, name one in the map"
    ]
    assert remarks(path, "can0") == []


def test_estimate_tells_them_on_standard_error(tmp_path):
    packed = zstd.compress("".join(LINE.format(i / 100, "can0") for i in range(20_000)).encode())
    (tmp_path / "a.log.zst").write_bytes(packed[: len(packed) // 2])
    ran = CliRunner().invoke(
        springscale, ["estimate", str(tmp_path / "a.log.zst"), "--signals", "springscale:reference"]
    )
    assert ran.exit_code == 0
    assert ran.stderr.startswith(f"{tmp_path / 'a.log.zst'}: the zstd stream is cut off; everything before was read\n")
