"""Where kept batches lie: one file each in a directory of their own, bounded in count and bytes.

A file is there whole or not at all, whenever the power fails. Beyond the bounds the oldest gives way, unless somebody
holds it: what a weighbridge ticket or a commissioning rests on stays until that is settled.
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
from gateway.units import NS_PER_S

FOLDER: Final = "batches"
HOLDS: Final = "holds.json"
MOST_HELD_SHARE: Final = 0.75  # of the count and the bytes; the rest stays for what comes
_NAME: Final = re.compile(r"(\d{10})-(\d+)-(\d+-[0-9a-f]{12})\.batch")


@dataclass(frozen=True, slots=True)
class ShelfLimits:
    """How much is kept at most; no batch at all keeps nothing."""

    most_batches: int = 256
    most_bytes: int = 128_000_000


@dataclass(frozen=True, slots=True)
class Entry:
    """A batch that is kept: which, how big its file is, and its place in the order of arrival."""

    id: str
    t_start_ns: int
    n_bytes: int
    number: int

    @property
    def t_end_ns(self) -> int:
        """As the id begins."""
        return int(self.id.partition("-")[0])

    @property
    def duration_s(self) -> float:
        """Of its window."""
        return (self.t_end_ns - self.t_start_ns) / NS_PER_S

    @property
    def file_name(self) -> str:
        """Its name in the directory."""
        return f"{self.number:010d}-{self.t_start_ns}-{self.id}.batch"


class Shelf:
    """The one owner of its directory. Thread-safe; calls wait for the disk and raise OSError where it refuses."""

    def __init__(self, directory: Path, limits: ShelfLimits) -> None:
        """Looks at what lies there; files that are none of ours are left alone."""
        self._files = KeptFiles(directory)
        self._limits = limits
        self._lock = threading.Lock()
        self._entries = {entry.id: entry for entry in sorted(_found(directory), key=lambda entry: entry.number)}
        self._holds = self._read_holds()

    def entries(self) -> tuple[Entry, ...]:
        """All that is kept, in order of arrival."""
        with self._lock:
            return tuple(self._entries.values())

    def read(self, batch_id: str) -> KeptBatch:
        """Raises KeyError where it is not kept, and KeptBatchError where its file is damaged, which is removed then."""
        with self._lock:
            entry = self._entries[batch_id]
            try:
                return unpacked(self._files.read(entry.file_name))
            except (FileNotFoundError, KeptBatchError) as fault:
                self._remove(entry)
                raise KeptBatchError(f"{self._files.directory / entry.file_name} {fault}; it is removed") from None

    def add(self, kept: KeptBatch) -> bool:
        """Keep it, and let the oldest go; on disk when this returns. False for one that is there, or too big to keep.

        Raises OSError where the disk refuses; then nothing has changed but that old ones may be gone.
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
            self._files.write(entry.file_name, content)
            self._entries[entry.id] = entry
            return True

    def path(self, entry: Entry) -> Path:
        """Its file, for another process to read."""
        return self._files.directory / entry.file_name

    def remove(self, batch_id: str) -> None:
        """Whoever holds it."""
        with self._lock:
            if (entry := self._entries.get(batch_id)) is not None:
                self._remove(entry)

    def hold(self, owner: str, batch_ids: Collection[str]) -> bool:
        """Keep these for ``owner``, in place of what it held before, until it lets go; on disk when this returns.

        False, and nothing is held, where they are more than may be held at a time. Those that are gone are left out.
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
        """What ``owner`` held may go when its turn comes."""
        with self._lock:
            if owner in self._holds:
                self._write_holds({name: held for name, held in self._holds.items() if name != owner})

    @property
    def owners(self) -> frozenset[str]:
        """All who hold something."""
        with self._lock:
            return frozenset(self._holds)

    def held_by(self, owner: str) -> frozenset[str]:
        """Those of its batches that are still there."""
        with self._lock:
            return self._holds.get(owner, frozenset()) & self._entries.keys()

    def _make_room(self, n_bytes: int) -> bool:
        """Remove the oldest that nobody holds until one more fits; False where too much is held."""
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
        """Nothing where there is no file or none that can be read: a hold is a courtesy, not a truth."""
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
    with suppress(OSError):  # a disk that refuses says so when something is to be kept
        for file in directory.iterdir():
            if (name := _NAME.fullmatch(file.name)) is not None and file.is_file() and not file.is_symlink():
                yield Entry(name[3], int(name[2]), file.stat().st_size, int(name[1]))
