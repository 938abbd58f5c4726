"""Files in the service's own directory: whole or not at all, and no link, pipe or device in place of one.

The service account may be compromised, and root works in the directory too (`sudo springscale token create`): root
first becomes the owner of the directory.
"""

import errno
import fcntl
import itertools
import os
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

MOST_BYTES: Final = 16_000_000  # chosen: many times a campaign file
LOCK_TIMEOUT_S: Final = 10.0  # chosen: many times what a writer holds it
_LOCK_POLL_S: Final = 0.02  # chosen: unnoticed by people


class KeptFiles:
    """Files by name in one directory. All methods raise OSError."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory

    def read(self, name: str) -> bytes:
        """The content of a plain file. Raises FileNotFoundError if there is none."""
        flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
        try:
            opened = os.open(self.directory / name, flags)
        except OSError as fault:
            raise type(fault)(fault.errno, fault.strerror, name) from None
        if not stat.S_ISREG(os.fstat(opened).st_mode):
            os.close(opened)
            raise OSError(errno.EINVAL, "is no plain file", name)
        with os.fdopen(opened, "rb") as file:
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise OSError(errno.EFBIG, f"is longer than {MOST_BYTES} bytes", name)
        return content

    def write(self, name: str, content: bytes) -> None:
        """Replace the file in one step, readable by its owner alone; on disk when this returns."""
        self.directory.mkdir(parents=True, exist_ok=True)
        fresh = self.directory / f".{name}.new"
        fresh.unlink(missing_ok=True)  # left by a kill
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        with os.fdopen(os.open(fresh, flags, 0o600), "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        fresh.rename(self.directory / name)
        with _opened(self.directory) as folder:
            os.fsync(folder)  # so that the new name survives a power cut

    def set_aside(self, name: str) -> str:
        """Rename whatever is at ``name`` -> the new name."""
        stem = f"{name}.broken-{datetime.now(UTC):%Y%m%dT%H%M%S}"
        names = (f"{stem}-{n}" if n else stem for n in itertools.count())
        aside = next(one for one in names if not os.path.lexists(self.directory / one))
        (self.directory / name).rename(self.directory / aside)
        return aside

    def stamp(self, name: str) -> tuple[int, int, int] | None:
        """Inode, time and size of the file, which change with its content; None if there is no file."""
        try:
            status = (self.directory / name).lstat()
        except OSError:
            return None
        return status.st_ino, status.st_mtime_ns, status.st_size

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the lock of this directory among processes. Raises TimeoutError if another process keeps it."""
        self.directory.mkdir(parents=True, exist_ok=True)
        end_s = time.monotonic() + LOCK_TIMEOUT_S
        with _opened(self.directory) as folder:
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
def _opened(directory: Path) -> Iterator[int]:
    """The file descriptor of a directory. Raises OSError."""
    folder = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield folder
    finally:
        os.close(folder)


def become_owner_of(directory: Path) -> None:
    """If root calls, drop its rights permanently and continue as the owner of the directory."""
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
