"""The writes that device-mapper's log-writes target recorded, and the disk as a power cut might leave it.

The target writes down every write once it is known to be stable: the writes that a flush covers, then that flush; a
write that bypasses the disk's cache (FUA) as soon as it is done. What stands behind the last flush was still in the
cache of the disk, which may keep, lose or tear it. Layout: drivers/md/dm-log-writes.c of the Linux kernel.
"""

import random
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntFlag
from pathlib import Path
from typing import BinaryIO, Final

SECTOR_BYTES: Final = 512
MAGIC: Final = 0x6A73_6677_7368_72
SUPERBLOCK: Final = struct.Struct("<QQQI")  # magic, version, number of entries, bytes in a sector
HEADER: Final = struct.Struct("<QQQQ")  # first sector, number of sectors, flags, bytes of a mark's name
# ext4 refuses to mount where one of these two sectors is new and the other old, before it looks into its journal: it
# counts on a disk that writes its superblock whole, as one with physical sectors of 4096 bytes does.
EXT4_SUPERBLOCK: Final = range(2, 4)


class Flag(IntFlag):
    """Kinds of entries."""

    FLUSH = 1
    FUA = 2
    DISCARD = 4
    MARK = 8
    METADATA = 16


@dataclass(frozen=True, slots=True)
class Entry:
    """One entry; its content lies at ``content_at`` in the log."""

    sector: int
    n_sectors: int
    flags: Flag
    content_at: int
    mark: str = ""


@dataclass(frozen=True, slots=True)
class Damage:
    """The damage that a power cut did to the writes that no flush had covered, in sectors."""

    n_lost: int
    n_kept: int


def entries_of(log: Path) -> list[Entry]:
    """Every entry that the log's first sector vouches for; none before the target has begun."""
    found: list[Entry] = []
    with log.open("rb") as file:
        magic, _, n_entries, sector_bytes = SUPERBLOCK.unpack(file.read(SUPERBLOCK.size).ljust(SUPERBLOCK.size, b"\0"))
        if magic != MAGIC:
            return found
        assert sector_bytes == SECTOR_BYTES, f"{log} has sectors of {sector_bytes} bytes"
        at = SECTOR_BYTES
        for _ in range(n_entries):
            file.seek(at)
            sector, n_sectors, flags, name_bytes = HEADER.unpack(file.read(HEADER.size))
            mark = file.read(name_bytes).rstrip(b"\0").decode() if flags & Flag.MARK else ""
            found.append(Entry(sector, n_sectors, Flag(flags), at + SECTOR_BYTES, mark))
            at += SECTOR_BYTES * (1 + (0 if flags & Flag.DISCARD else n_sectors))
    return found


def cut(disk: Path, log: Path, since: str, moments: random.Random) -> Damage:
    """Make ``disk``, as it was when the log began, what a power cut after the mark ``since`` leaves of it.

    The moment is any at which writes wait for their flush. All before the last flush is on the disk; of what waits,
    each write is kept, lost or torn between its sectors.
    """
    entries = entries_of(log)
    found = _moments(entries, since)
    assert found, f"nothing was written after {since}"
    moment = moments.choice(found)
    n_flushed = _n_flushed(entries, moment)
    n_lost = n_kept = 0
    with disk.open("r+b") as target, log.open("rb") as source:
        for i, entry in enumerate(entries[:moment]):
            waits = i >= n_flushed and not entry.flags & Flag.FUA
            arrived = _surviving(entry, moments) if waits else range(entry.n_sectors)
            _write(entry, arrived, source, target)
            n_lost += (entry.n_sectors - len(arrived)) * waits
            n_kept += len(arrived) * waits
    return Damage(n_lost, n_kept)


def has_moments(log: Path, since: str) -> bool:
    """Whether the power could have gone, since the mark, while a write waited for its flush."""
    return bool(_moments(entries_of(log), since))


def _moments(entries: Sequence[Entry], since: str) -> list[int]:
    """Numbers of entries done when the power may go: behind the mark, with a write that waits for its flush."""
    marked = next(i for i, entry in enumerate(entries) if entry.mark == since)
    return [n for n in range(marked + 1, len(entries) + 1) if _is_waiting(entries[_n_flushed(entries, n) : n])]


def _n_flushed(entries: Sequence[Entry], moment: int) -> int:
    """The number of entries among the first ``moment`` that a flush covers."""
    return max((i + 1 for i, entry in enumerate(entries[:moment]) if entry.flags & Flag.FLUSH), default=0)


def _is_waiting(entries: Sequence[Entry]) -> bool:
    return any(entry.n_sectors and not entry.flags & (Flag.FUA | Flag.DISCARD) for entry in entries)


def _surviving(entry: Entry, moments: random.Random) -> Sequence[int]:
    """Which sectors of a write arrive: all, none, or any of them, but the superblock as one."""
    fate = moments.choice(("kept", "lost", "torn"))
    if fate != "torn":
        return range(entry.n_sectors if fate == "kept" else 0)
    superblock_arrives = moments.random() < 0.5
    return [
        i
        for i, sector in enumerate(range(entry.sector, entry.sector + entry.n_sectors))
        if (superblock_arrives if sector in EXT4_SUPERBLOCK else moments.random() < 0.5)
    ]


def _write(entry: Entry, arrived: Sequence[int], source: BinaryIO, target: BinaryIO) -> None:
    if entry.flags & (Flag.DISCARD | Flag.MARK):
        return
    for i in arrived:
        source.seek(entry.content_at + i * SECTOR_BYTES)
        target.seek((entry.sector + i) * SECTOR_BYTES)
        target.write(source.read(SECTOR_BYTES))
