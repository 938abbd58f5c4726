"""One directory of the service, worked in by its handle: no name in it is followed elsewhere.

Its owner may have been broken into, and root works in it too (`sudo springscale token create`). So a link, a pipe or a
device is never opened, new files are made where nothing was, and root becomes the owner before it does anything.
"""

import errno
import fcntl
import itertools
import os
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

MOST_BYTES: Final = 16_000_000
LOCK_TIMEOUT_S: Final = 10.0
_LOCK_POLL_S: Final = 0.02


class KeptFiles:
    """Files by name in one directory. All methods raise OSError."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory

    def read(self, name: str) -> bytes:
        """What a plain file holds. FileNotFoundError where there is none."""
        with opened_folder(self.directory) as folder:
            file = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=folder)
            if not stat.S_ISREG(os.fstat(file).st_mode):
                os.close(file)
                raise OSError(errno.EINVAL, "is no plain file", name)
            with os.fdopen(file, "rb") as opened:
                content = opened.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise OSError(errno.EFBIG, f"is longer than {MOST_BYTES} bytes", name)
        return content

    def write(self, name: str, content: bytes) -> None:
        """Replace the file in one step, readable by its owner alone; on disk when this returns."""
        self.directory.mkdir(parents=True, exist_ok=True)
        fresh = f".{name}.new"
        with opened_folder(self.directory) as folder:
            with suppress(FileNotFoundError):  # left by a kill
                os.unlink(fresh, dir_fd=folder)
            flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
            with os.fdopen(os.open(fresh, flags, 0o600, dir_fd=folder), "wb") as file:
                if os.geteuid() == 0:  # made just now, and so no other's
                    owner = os.fstat(folder)
                    os.fchown(file.fileno(), owner.st_uid, owner.st_gid)
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.rename(fresh, name, src_dir_fd=folder, dst_dir_fd=folder)
            os.fsync(folder)  # the new name, too, outlives a power cut

    def set_aside(self, name: str) -> str:
        """Rename what lies under ``name`` out of the way, whatever it is -> the new name."""
        with opened_folder(self.directory) as folder:
            stem = f"{name}.broken-{datetime.now(UTC):%Y%m%dT%H%M%S}"
            taken = _names(folder)
            aside = next(one for n in itertools.count() if (one := f"{stem}-{n}" if n else stem) not in taken)
            os.rename(name, aside, src_dir_fd=folder, dst_dir_fd=folder)
            return aside

    def set_aside_earlier(self, name: str) -> list[str]:
        """What was set aside under this name and still lies there, oldest first."""
        try:
            with opened_folder(self.directory) as folder:
                return sorted(other for other in _names(folder) if other.startswith(f"{name}.broken-"))
        except FileNotFoundError:
            return []

    def stamp(self, name: str) -> tuple[int, int, int] | None:
        """Another one whenever the file is another; None where there is none."""
        try:
            status = (self.directory / name).lstat()
        except OSError:
            return None
        return status.st_ino, status.st_mtime_ns, status.st_size

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Alone among all processes that lock this directory. TimeoutError where another does not let go."""
        self.directory.mkdir(parents=True, exist_ok=True)
        end_s = time.monotonic() + LOCK_TIMEOUT_S
        with opened_folder(self.directory) as folder:
            while True:
                try:
                    fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    break
                except BlockingIOError:
                    if time.monotonic() > end_s:
                        raise TimeoutError(f"{self.directory} is locked by another process") from None
                    time.sleep(_LOCK_POLL_S)
            yield


@contextmanager
def opened_folder(directory: Path) -> Iterator[int]:
    """A directory's handle, to work in it whatever its path leads to meanwhile. Raises OSError."""
    folder = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield folder
    finally:
        os.close(folder)


def _names(folder: int) -> set[str]:
    with os.scandir(folder) as entries:
        return {entry.name for entry in entries}


def become_owner_of(directory: Path) -> None:
    """Where root asks, give up its rights for good and go on as the directory's owner."""
    if os.geteuid() != 0:
        return
    try:
        owner = directory.stat()
    except OSError:
        return
    if owner.st_uid != 0:
        os.setgroups([])
        os.setgid(owner.st_gid)
        os.setuid(owner.st_uid)
