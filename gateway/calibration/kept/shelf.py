"""The store of kept batches: one file each in a directory, bounded in count and bytes.

A file is either complete or absent, even after a power failure. Beyond the bounds the oldest batch is removed unless an
owner holds it: batches behind a weighbridge ticket or a commissioning stay until that is settled.
"""

import json
import re
import threading
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gateway.calibration.kept.batch_file import KeptBatch, packed, unpacked
from gateway.errors import KeptBatchError
from gateway.files.kept import MOST_BYTES, KeptFiles
from gateway.files.reserve import require_room
from gateway.units import NS_PER_S

FOLDER: Final = "batches"
HOLDS: Final = "holds.json"
MOST_HELD_SHARE: Final = 0.75  # chosen: of the count and the bytes; the rest is for new batches
_NAME: Final = re.compile(r"(\d{10})-(\d+)-(\d+-[0-9a-f]{12})\.batch")


@dataclass(frozen=True, slots=True)
class ShelfLimits:
    """Limits of the store; ``most_batches`` of 0 keeps nothing."""

    most_batches: int = 256
    most_bytes: int = 128_000_000


@dataclass(frozen=True, slots=True)
class Entry:
    """A stored batch: its id, the size of its file, and its number in order of arrival."""

    id: str
    t_start_ns: int
    n_bytes: int
    number: int

    @property
    def t_end_ns(self) -> int:
        """The end of its window, from its id."""
        return int(self.id.partition("-")[0])

    @property
    def duration_s(self) -> float:
        """The length of its window."""
        return (self.t_end_ns - self.t_start_ns) / NS_PER_S

    @property
    def file_name(self) -> str:
        """The name of its file."""
        return f"{self.number:010d}-{self.t_start_ns}-{self.id}.batch"


class Shelf:
    """The only writer of its directory. Thread-safe; calls block on the disk and raise OSError if it fails."""

    def __init__(self, directory: Path, limits: ShelfLimits) -> None:
        """Reads the directory; files with other names are ignored."""
        self._files = KeptFiles(directory)
        self._limits = limits
        self._lock = threading.Lock()
        self._entries = {entry.id: entry for entry in sorted(_found(directory), key=lambda entry: entry.number)}
        self._holds = self._read_holds()

    def entries(self) -> tuple[Entry, ...]:
        """All stored batches, in order of arrival."""
        with self._lock:
            return tuple(self._entries.values())

    def read(self, batch_id: str) -> KeptBatch:
        """Raises KeyError if it is not stored, and KeptBatchError if its file is damaged, which is then removed."""
        with self._lock:
            entry = self._entries[batch_id]
            try:
                return unpacked(self._files.read(entry.file_name))
            except (FileNotFoundError, KeptBatchError) as fault:
                self._remove(entry)
                raise KeptBatchError(f"{self._files.directory / entry.file_name} {fault}; it is removed") from None

    def add(self, kept: KeptBatch) -> bool:
        """Store a batch, removing the oldest if needed; on disk when this returns. False if it is already there or too
        big.

        Raises OSError if the disk fails or is short of room; the batch is then not stored, but old ones may have been
        removed.
        """
        with self._lock:
            if kept.id in self._entries or self._limits.most_batches < 1:
                return False
            content = packed(kept)
            if len(content) > min(MOST_BYTES, self._limits.most_bytes):
                return False
            number = max((entry.number for entry in self._entries.values()), default=0) + 1
            entry = Entry(kept.id, kept.batch.t_start_ns, len(content), number)
            if not self._make_room(entry.n_bytes):
                return False
            require_room(self._files.directory, entry.n_bytes)
            self._files.write(entry.file_name, content)
            self._entries[entry.id] = entry
            return True

    def path(self, entry: Entry) -> Path:
        """The file of a batch, for another process to read."""
        return self._files.directory / entry.file_name

    def remove(self, batch_id: str) -> None:
        """Remove a batch even if an owner holds it."""
        with self._lock:
            if (entry := self._entries.get(batch_id)) is not None:
                self._remove(entry)

    def hold(self, owner: str, batch_ids: Collection[str]) -> bool:
        """Keep these batches for ``owner``, in place of those it held before, until it releases them; on disk on
        return.

        False, and nothing is held, if they exceed the share that may be held. Missing batches are left out.
        """
        with self._lock:
            held = frozenset(batch_ids) & self._entries.keys()
            holds = {**self._holds, owner: held}
            everything = [self._entries[one] for one in frozenset().union(*holds.values()) if one in self._entries]
            if len(everything) > MOST_HELD_SHARE * self._limits.most_batches or (
                sum(entry.n_bytes for entry in everything) > MOST_HELD_SHARE * self._limits.most_bytes
            ):
                return False
            self._write_holds(holds)
            return True

    def let_go(self, owner: str) -> None:
        """Release the batches of ``owner``; they may be removed when they are the oldest."""
        with self._lock:
            if owner in self._holds:
                self._write_holds({name: held for name, held in self._holds.items() if name != owner})

    @property
    def owners(self) -> frozenset[str]:
        """All owners with held batches."""
        with self._lock:
            return frozenset(self._holds)

    def held_by(self, owner: str) -> frozenset[str]:
        """The owner's batches that are still stored."""
        with self._lock:
            return self._holds.get(owner, frozenset()) & self._entries.keys()

    def _make_room(self, n_bytes: int) -> bool:
        """Remove the oldest batches without an owner until one more fits; False if too much is held."""
        held = frozenset().union(*self._holds.values())
        n, total = len(self._entries), sum(entry.n_bytes for entry in self._entries.values())
        for entry in tuple(self._entries.values()):
            if n < self._limits.most_batches and total + n_bytes <= self._limits.most_bytes:
                return True
            if entry.id not in held:
                self._remove(entry)
                n, total = n - 1, total - entry.n_bytes
        return n < self._limits.most_batches and total + n_bytes <= self._limits.most_bytes

    def _remove(self, entry: Entry) -> None:
        with suppress(FileNotFoundError):
            (self._files.directory / entry.file_name).unlink()
        self._entries.pop(entry.id, None)

    def _read_holds(self) -> dict[str, frozenset[str]]:
        """Empty without a readable file: a hold is a courtesy and not essential."""
        try:
            told = json.loads(self._files.read(HOLDS))
            return {str(owner): frozenset(map(str, held)) for owner, held in told.items()}
        except (OSError, ValueError, TypeError, AttributeError):
            return {}

    def _write_holds(self, holds: dict[str, frozenset[str]]) -> None:
        if holds == self._holds:
            return
        self._files.write(HOLDS, json.dumps({owner: sorted(held) for owner, held in holds.items()}).encode())
        self._holds = holds


def _found(directory: Path) -> Iterator[Entry]:
    with suppress(OSError):  # a failing disk raises when a batch is stored
        for file in directory.iterdir():
            if (name := _NAME.fullmatch(file.name)) is not None and file.is_file() and not file.is_symlink():
                yield Entry(name[3], int(name[2]), file.stat().st_size, int(name[1]))
