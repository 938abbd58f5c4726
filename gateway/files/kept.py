"""Files in the service's own directory, accessed through its file descriptor without following links.

The service account may be compromised, and root works in the directory too (`sudo springscale token create`). So a
link, a pipe or a device is never opened, new files are created exclusively, and root first becomes the owner.
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
from typing import BinaryIO, Final

MOST_BYTES: Final = 16_000_000  # chosen: many times a file of known weights or a campaign
LOCK_TIMEOUT_S: Final = 10.0  # chosen: many times what a writer holds it
_LOCK_POLL_S: Final = 0.02  # chosen: unnoticed by people


class KeptFiles:
    """Files by name in one directory. All methods raise OSError."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory

    def read(self, name: str) -> bytes:
        """The content of a plain file. Raises FileNotFoundError if there is none."""
        with opened_folder(self.directory) as folder, open_plain(folder, name) as opened:
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
            with create_plain(folder, fresh, 0o600) as file:
                if os.geteuid() == 0:  # the file is new, so nobody else owns it
                    owner = os.fstat(folder)
                    os.fchown(file.fileno(), owner.st_uid, owner.st_gid)
                write_all(file, content)
                os.fsync(file.fileno())
            os.rename(fresh, name, src_dir_fd=folder, dst_dir_fd=folder)
            os.fsync(folder)  # so that the new name survives a power cut

    def set_aside(self, name: str) -> str:
        """Rename whatever is at ``name`` -> the new name."""
        with opened_folder(self.directory) as folder:
            stem = f"{name}.broken-{datetime.now(UTC):%Y%m%dT%H%M%S}"
            taken = _names(folder)
            aside = next(one for n in itertools.count() if (one := f"{stem}-{n}" if n else stem) not in taken)
            os.rename(name, aside, src_dir_fd=folder, dst_dir_fd=folder)
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
    """File descriptor of a directory, independent of later changes to its path. Raises OSError."""
    folder = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield folder
    finally:
        os.close(folder)


def open_plain(folder: int, name: str) -> BinaryIO:
    """A plain file in an open directory; no link is followed. Raises OSError, FileNotFoundError if there is none."""
    file = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=folder)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise OSError(errno.EINVAL, "is no plain file", name)
    return os.fdopen(file, "rb")


def create_plain(folder: int, name: str, mode: int) -> BinaryIO:
    """A new file in an open directory, unbuffered. Raises OSError, also if the name exists already."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    return os.fdopen(os.open(name, flags, mode, dir_fd=folder), "wb", buffering=0)


def write_all(file: BinaryIO, content: bytes) -> None:
    """Write the whole content, since an unbuffered file may write less at a time. Raises OSError."""
    rest = memoryview(content)
    while rest:
        rest = rest[file.write(rest) :]


def _names(folder: int) -> set[str]:
    with os.scandir(folder) as entries:
        return {entry.name for entry in entries}


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


class BrokenFile:
    """Sets an invalid file at ``path`` aside instead of overwriting it. Not thread-safe."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._is_in_the_way = False

    def set_aside(self) -> str:
        """Rename the file -> what became of it, as a clause for people."""
        self._is_in_the_way = True
        try:
            return f"is set aside as {self._moved()}"
        except OSError as refusal:
            return f"cannot be set aside: {refusal}"

    def make_way(self) -> None:
        """Call before writing to ``path``: moves the invalid file if that failed before. Raises OSError."""
        if self._is_in_the_way:
            self._moved()

    def _moved(self) -> str:
        name = KeptFiles(self._path.parent).set_aside(self._path.name)
        self._is_in_the_way = False
        return name
