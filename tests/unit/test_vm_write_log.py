"""The power cuts of the machine's tests: what a disk may lose and what it must keep, from a log of its writes."""

import random
from pathlib import Path

from vm.harness.write_log import HEADER, MAGIC, SECTOR_BYTES, SUPERBLOCK, Flag, cut

N_SECTORS = 8
SEEDS = range(60)


def write(sector: int, letters: str, flags: int = 0) -> bytes:
    """An entry of one sector a letter."""
    content = b"".join(letter.encode() * SECTOR_BYTES for letter in letters)
    return HEADER.pack(sector, len(letters), flags, 0).ljust(SECTOR_BYTES, b"\0") + content


def mark(name: str) -> bytes:
    return (HEADER.pack(0, 0, Flag.MARK, len(name)) + name.encode()).ljust(SECTOR_BYTES, b"\0")


FLUSH = write(0, "", Flag.FLUSH)


def log_of(folder: Path, *entries: bytes) -> Path:
    head = SUPERBLOCK.pack(MAGIC, 1, len(entries), SECTOR_BYTES).ljust(SECTOR_BYTES, b"\0")
    (folder / "log").write_bytes(head + b"".join(entries))
    return folder / "log"


def disks(folder: Path, *entries: bytes) -> set[str]:
    """Every disk, a letter a sector, that cuts after the mark were seen to leave of an empty one."""
    log, disk = log_of(folder, *entries), folder / "disk"
    seen = set()
    for seed in SEEDS:
        disk.write_bytes(b"." * SECTOR_BYTES * N_SECTORS)
        cut(disk, log, "here", random.Random(seed))
        content = disk.read_bytes()
        sectors = [content[i : i + SECTOR_BYTES] for i in range(0, len(content), SECTOR_BYTES)]
        assert all(sector == sector[:1] * SECTOR_BYTES for sector in sectors)
        seen.add(b"".join(sector[:1] for sector in sectors).decode())
    return seen


def test_flushed_writes_stay_and_others_are_kept_lost_or_torn(tmp_path: Path) -> None:
    assert disks(tmp_path, write(0, "ab"), FLUSH, mark("here"), write(4, "cd")) == {
        "ab......",
        "ab..c...",
        "ab...d..",
        "ab..cd..",
    }


def test_a_write_that_bypassed_the_cache_stays(tmp_path: Path) -> None:
    seen = disks(tmp_path, mark("here"), write(0, "a", Flag.FUA), write(1, "b"))
    assert seen == {"a.......", "ab......"}


def test_the_power_goes_at_any_moment_after_the_mark(tmp_path: Path) -> None:
    seen = disks(tmp_path, write(0, "a"), mark("here"), write(1, "b"), FLUSH, write(2, "c"))
    assert {"........", "a.......", "ab......", "abc....."} <= seen
    assert not {disk for disk in seen if disk[2] == "c" and disk[:2] != "ab"}  # not behind what a flush came between


def test_the_superblock_of_ext4_comes_whole_or_not_at_all(tmp_path: Path) -> None:
    seen = disks(tmp_path, mark("here"), write(1, "abcd"))
    assert {disk[1] + disk[4] for disk in seen} == {"..", "a.", ".d", "ad"}
    assert {disk[2:4] for disk in seen} == {"..", "bc"}
