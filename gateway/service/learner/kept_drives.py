"""The drives that a service keeps to learn from: files of windows, bounded in size, forgotten by what they teach."""

import re
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gateway.calibration.kept import KeptBatch, packed
from gateway.calibration.learning.spans import ENOUGH_S, worth
from gateway.files.owned import KeptFiles
from gateway.files.reserve import require_room

FOLDER: Final = "drives"
_NAME: Final = re.compile(r"(\d+)-(\d+)-(\d+)-(\d+)\.window")
MS_PER_S: Final = 1000.0


@dataclass(frozen=True, slots=True)
class Window:
    """A kept window, as the name of its file tells it."""

    drive_start_ns: int
    t_start_ns: int
    t_end_ns: int
    usable_s: float
    n_bytes: int
    file_name: str

    @property
    def span(self) -> tuple[int, int, int]:
        """Begin of its drive, its own begin and its end (ns)."""
        return self.drive_start_ns, self.t_start_ns, self.t_end_ns


class DriveFiles:
    """The only writer of its directory. Thread-safe; ``add`` blocks on the disk and raises OSError if it fails."""

    def __init__(self, directory: Path, most_bytes: int) -> None:
        """Reads the directory; files with other names are ignored."""
        self.directory = directory
        self._files = KeptFiles(directory)
        self._most_bytes = most_bytes
        self._lock = threading.Lock()
        self._windows = sorted(_found(directory), key=lambda one: one.t_start_ns)

    def windows(self) -> tuple[Window, ...]:
        """All kept windows, in order of time."""
        with self._lock:
            return tuple(self._windows)

    def path(self, window: Window) -> Path:
        """The file of a window, for another process to read."""
        return self.directory / window.file_name

    @property
    def n_bytes(self) -> int:
        """Size of all files together."""
        return sum(one.n_bytes for one in self.windows())

    def add(self, kept: KeptBatch, is_stated: Callable[[int, int], bool]) -> bool:
        """Store a window, forgetting those that teach least; on disk when this returns. False if it is not kept.

        ``is_stated`` says whether a statement is about this time (begin and end, ns). A drive that has taught enough is
        not kept any further.
        """
        batch = kept.batch
        usable_ms = round(batch.usable_s * MS_PER_S)
        name = f"{batch.drive_start_ns}-{batch.t_start_ns}-{batch.t_end_ns}-{usable_ms}.window"
        content = packed(kept)
        with self._lock:
            if any(one.t_start_ns == batch.t_start_ns for one in self._windows) or len(content) > self._most_bytes:
                return False
            of_drive_s = sum(one.usable_s for one in self._windows if one.drive_start_ns == batch.drive_start_ns)
            if of_drive_s >= ENOUGH_S:
                return False
            if not self._make_room(kept, len(content), is_stated):
                return False
            require_room(self.directory, len(content))
            self._files.write(name, content)
            window = Window(
                batch.drive_start_ns, batch.t_start_ns, batch.t_end_ns, usable_ms / MS_PER_S, len(content), name
            )
            self._windows = sorted([*self._windows, window], key=lambda one: one.t_start_ns)
            return True

    def remove(self, file_name: str) -> None:
        """Forget a window, for its file is damaged."""
        with self._lock:
            self._remove({file_name})

    def _make_room(self, kept: KeptBatch, n_bytes: int, is_stated: Callable[[int, int], bool]) -> bool:
        """Forget the drives that teach least until ``n_bytes`` more fit; the lock is held.

        False, and nothing is forgotten, if all others teach more than the drive under way can.
        """
        own, drives = kept.batch, dict[int, list[Window]]()
        for one in self._windows:
            if one.drive_start_ns != own.drive_start_ns:
                drives.setdefault(one.drive_start_ns, []).append(one)

        def value(windows: list[Window]) -> tuple[bool, float]:
            begin_ns, end_ns = windows[0].t_start_ns, windows[-1].t_end_ns
            usable_s = sum(one.usable_s for one in windows)
            return worth(usable_s, end_ns, own.t_end_ns, is_stated=is_stated(begin_ns, end_ns))

        most = worth(ENOUGH_S, own.t_end_ns, own.t_end_ns, is_stated=is_stated(own.t_start_ns, own.t_end_ns))
        excess = sum(one.n_bytes for one in self._windows) + n_bytes - self._most_bytes
        forgotten: set[str] = set()
        for windows in sorted(drives.values(), key=value):
            if excess <= 0 or value(windows) >= most:
                break
            forgotten |= {one.file_name for one in windows}
            excess -= sum(one.n_bytes for one in windows)
        if excess > 0:
            return False
        self._remove(forgotten)
        return True

    def _remove(self, names: set[str]) -> None:
        for name in names:
            with suppress(FileNotFoundError):
                (self.directory / name).unlink()
        self._windows = [one for one in self._windows if one.file_name not in names]


def _found(directory: Path) -> Iterator[Window]:
    with suppress(OSError):  # a failing disk raises when a window is stored
        for file in directory.iterdir():
            if (name := _NAME.fullmatch(file.name)) is not None and file.is_file() and not file.is_symlink():
                drive_ns, start_ns, end_ns, usable_ms = map(int, name.groups())
                yield Window(drive_ns, start_ns, end_ns, usable_ms / MS_PER_S, file.stat().st_size, file.name)
