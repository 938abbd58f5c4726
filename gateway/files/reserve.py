"""Room that is kept on the disk for what was accepted, and given up when the disk is full."""

import errno
import os
from contextlib import suppress
from pathlib import Path
from typing import Final

FILE_NAME: Final = "springscale.reserve"
RESERVE_BYTES: Final = 4 << 20  # chosen: some hundred batches
LEAST_FREE_BYTES: Final = 4 * RESERVE_BYTES  # chosen: with less nothing is written that can be done without


def free_bytes(directory: Path) -> int:
    """Room for this process. Raises OSError."""
    found = os.statvfs(directory)
    return found.f_bavail * found.f_frsize


def require_room(directory: Path, n_bytes: int) -> None:
    """Raise OSError if a file of this size, which can be done without, would leave the disk short of room."""
    there = next(path for path in (directory, *directory.parents) if path.exists())
    if free_bytes(there) < n_bytes + LEAST_FREE_BYTES:
        raise OSError(errno.ENOSPC, f"less than {LEAST_FREE_BYTES >> 20} MB would be left on the disk")


class Reserve:
    """A file in ``directory`` that holds room. Not thread-safe."""

    def __init__(self, directory: Path) -> None:
        self._path = directory / FILE_NAME
        self.is_in_use = False  # given up, and not yet made again

    def keep(self) -> None:
        """Make the file if it is missing and the disk has room; a disk that refuses is tried again the next time."""
        with suppress(OSError):
            if not self._is_whole() and free_bytes(self._path.parent) >= LEAST_FREE_BYTES:
                file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
                try:
                    os.posix_fallocate(file, 0, RESERVE_BYTES)
                finally:
                    os.close(file)
            self.is_in_use &= not self._is_whole()

    def _is_whole(self) -> bool:
        """Whether the file holds all its room; a kill or a refusal while it was made leaves less."""
        with suppress(FileNotFoundError):
            return self._path.stat(follow_symlinks=False).st_size >= RESERVE_BYTES
        return False

    def give_up(self) -> bool:
        """Remove the file if the disk is short of room -> whether there is more room now."""
        try:
            if free_bytes(self._path.parent) >= RESERVE_BYTES:
                return False
            self._path.unlink()
        except OSError:
            return False
        self.is_in_use = True
        return True
