"""A log that was copied counts once, whatever its name, folder and packing; the copies are named."""

import gzip
import lzma
from collections.abc import Callable
from pathlib import Path

import pytest
from support.archive import MIDNIGHT_NS, Here, tables_of, write_drive, write_manifest

from gateway.archive import place_of
from gateway.archive.manifest import load_manifest
from gateway.archive.reprocessing import Summary, reprocess
from gateway.bus.logs.packed import zstd
from gateway.cli.reprocess import summary_in_words
from gateway.units import NS_PER_S

Write = Callable[[Path, bytes], object]


def weighed(folder: Path, output: str) -> Summary:
    return reprocess(load_manifest(str(folder / "archive.toml")), place_of(folder / output), Here())


COPIES: dict[str, tuple[str, Write]] = {
    "another name": ("van-1/2.log", Path.write_bytes),
    "another folder of the vehicle": ("van-1/backup/1.log", Path.write_bytes),
    "gzip": ("van-1/1.log.gz", lambda path, content: path.write_bytes(gzip.compress(content))),
    "zstd": ("van-1/1.log.zst", lambda path, content: path.write_bytes(zstd.compress(content))),
    "xz": ("van-1/1.log.xz", lambda path, content: path.write_bytes(lzma.compress(content))),
}


@pytest.mark.parametrize("kind", COPIES)
def test_a_copy_is_left_out_and_named(kind: str, tmp_path: Path) -> None:
    name, write = COPIES[kind]
    write_drive(tmp_path / "van-1" / "1.log", MIDNIGHT_NS, 21.0)
    write_manifest(tmp_path, "van-1")
    alone = weighed(tmp_path, "alone")
    (tmp_path / name).parent.mkdir(exist_ok=True)
    write(tmp_path / name, (tmp_path / "van-1" / "1.log").read_bytes())
    both = weighed(tmp_path, "both")
    assert both.is_good
    assert both.copies == {name: "van-1/1.log"}
    assert alone.copies == {}
    assert (both.n_logs, both.to_json()["n_batches"]) == (2, alone.to_json()["n_batches"])
    assert tables_of(place_of(tmp_path / "both")) == tables_of(place_of(tmp_path / "alone"))
    assert f"left out, copies of other logs: 1 log:\n  {name}: has the content of van-1/1.log" in summary_in_words(
        both, "both"
    )
    assert weighed(tmp_path, "both").copies == both.copies  # from the facts of the first run


OVERLAPS: dict[str, Callable[[list[bytes]], list[bytes]]] = {
    "other ends of lines": lambda lines: [line.replace(b"\n", b"\r\n") for line in lines],
    "another channel": lambda lines: [line.replace(b"can0", b"can1") for line in lines],
    "a part of it": lambda lines: lines[: len(lines) // 2],
    "one that goes on": lambda lines: lines[len(lines) // 2 :],
}


@pytest.mark.parametrize("kind", OVERLAPS)
def test_another_log_of_the_same_time_is_named(kind: str, tmp_path: Path) -> None:
    write_drive(tmp_path / "van-1" / "1.log", MIDNIGHT_NS, 21.0)
    write_drive(tmp_path / "van-1" / "3.log", MIDNIGHT_NS + 22 * NS_PER_S, 5.0)
    write_manifest(tmp_path, "van-1")
    assert weighed(tmp_path, "alone").to_json()["overlaps"] == []
    lines = (tmp_path / "van-1" / "1.log").read_bytes().splitlines(keepends=True)
    (tmp_path / "van-1" / "2.log").write_bytes(b"".join(OVERLAPS[kind](lines)))
    both = weighed(tmp_path, "both")
    assert both.copies == {}
    assert both.to_json()["overlaps"] == ["van-1/2.log: begins before van-1/1.log ends"]
    assert "van-1/2.log: begins before van-1/1.log ends" in summary_in_words(both, "both")


def test_similar_logs_are_no_copies(tmp_path: Path) -> None:
    """A cut copy, empty files, and one log in the folders of two vehicles."""
    write_drive(tmp_path / "van-1" / "1.log", MIDNIGHT_NS, 21.0)
    content = (tmp_path / "van-1" / "1.log").read_bytes()
    (tmp_path / "van-1" / "cut.log.gz").write_bytes(gzip.compress(content)[:-9])
    (tmp_path / "van-1" / "empty.log").write_bytes(b"")
    (tmp_path / "van-1" / "empty too.log").write_bytes(b"")
    (tmp_path / "van-2").mkdir()
    (tmp_path / "van-2" / "1.log").write_bytes(content)
    write_manifest(tmp_path, "van-1", "van-2")
    summary = weighed(tmp_path, "out")
    assert summary.copies == {}
    assert summary.of_others == {"van-2/1.log of van-2": "van-1/1.log of van-1"}
    assert "van-2/1.log of van-2: has the content of van-1/1.log of van-1" in summary_in_words(summary, "out")
    assert summary.n_failed_logs == 2
