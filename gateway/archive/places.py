"""Folders on this computer or in an object store (s3://), through obstore.

place = place_of("s3://fleet/logs")
place.create("a/b.json", b"...")      # False if it exists: the store decides atomically
"""

import functools
import hashlib
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import unquote, urlsplit

import obstore
from obstore.exceptions import AlreadyExistsError, BaseError
from obstore.store import LocalStore, ObjectStore, from_url

from gateway.errors import ConfigurationError, SpringscaleError

SCHEMES: Final = ("file", "s3")
CHUNK_BYTES: Final = 8 << 20  # chosen: of a large object, in memory at a time
_URL: Final = re.compile(r"^[a-z][a-z0-9]+://")


class PlaceError(SpringscaleError):
    """A folder or store cannot be read or written now; the work can be repeated later."""


@dataclass(frozen=True, slots=True)
class Item:
    """A file below a place. ``stamp`` changes with its content, as far as the place can tell."""

    path: str
    size: int
    stamp: str


@dataclass(frozen=True, slots=True)
class Location:
    """A folder by its URL. It has no connection: each process makes and keeps its own."""

    url: str

    def __str__(self) -> str:
        local = self.local("")
        return self.url if local is None else str(local)

    def at(self, path: str) -> "Location":
        here = self.local(path)
        if here is not None:
            return place_of(here)
        return Location(f"{self.url}/{path.strip('/')}") if path.strip("/") else self

    def local(self, path: str) -> Path | None:
        """The path of one of its files on this computer; None if it is elsewhere."""
        parts = urlsplit(self.url)
        return Path(unquote(parts.path)) / path if parts.scheme == "file" else None

    def path(self, name: str) -> Path:
        """The path of one of its files for messages."""
        return self.local(name) or Path(f"{self.url}/{name}")

    def items(self, below: str = "") -> list[Item]:
        """Every file below one of its folders, in order of path; none if the folder is absent."""
        here = self.local("")
        if here is not None and not here.is_dir():
            return []
        with self._faults(below):
            found = [one for page in obstore.list(self._store(), below.strip("/") or None) for one in page]
        items = (Item(one["path"], one["size"], one["e_tag"] or one["last_modified"].isoformat()) for one in found)
        return sorted(items, key=lambda item: item.path)

    def read(self, path: str) -> bytes:
        """The content of a small file. Raises FileNotFoundError, else PlaceError."""
        here = self.local(path)
        if here is not None and not here.is_file():
            raise FileNotFoundError(f"{here}: no such file")
        with self._faults(path):
            return bytes(obstore.get(self._store(), path).bytes())

    def create(self, path: str, content: bytes) -> bool:
        """Write a new file atomically; False if it exists, which is then kept."""
        with self._faults(path):
            try:
                obstore.put(self._store(), path, content, mode="create", use_multipart=False)
            except AlreadyExistsError:
                return False
            self._settle(path)
        return True

    def replace(self, path: str, content: bytes) -> None:
        """Write a file atomically, replacing an existing one."""
        with self._faults(path):
            obstore.put(self._store(), path, content, use_multipart=False)
            self._settle(path)

    def remove(self, path: str) -> None:
        with self._faults(path):
            try:
                obstore.delete(self._store(), path)
            except FileNotFoundError:
                return

    @contextmanager
    def fetched(self, path: str) -> "Iterator[Fetched]":
        """A file of any size on this computer's disk for the duration of the block, and its hash.

        A local one is used in place; another is copied in chunks. Raises FileNotFoundError, else PlaceError.
        """
        here = self.local(path)
        if here is not None:
            yield Fetched(here, _sha256_of(here))
            return
        with tempfile.TemporaryDirectory(prefix="springscale-") as folder:
            copy = Path(folder) / path.rpartition("/")[2]  # its suffixes tell what it is
            digest = hashlib.sha256()
            with self._faults(path), copy.open("wb") as file:
                for chunk in obstore.get(self._store(), path).stream(min_chunk_size=CHUNK_BYTES):
                    digest.update(chunk)
                    file.write(chunk)
            yield Fetched(copy, digest.hexdigest())

    def _settle(self, path: str) -> None:
        """Syncs the file on a local disk, so that a power cut cannot keep later writes and lose this; object stores
        guarantee it.
        """
        here = self.local(path)
        for settled in () if here is None else (here, here.parent):
            handle = os.open(settled, os.O_RDONLY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)

    def _store(self) -> ObjectStore:
        return _store_of(self.url)

    @contextmanager
    def _faults(self, path: str) -> Iterator[None]:
        """Turn the library's exceptions into one line that names the place."""
        where = f"{self}/{path}".rstrip("/")
        try:
            yield
        except FileNotFoundError:
            raise FileNotFoundError(f"{where}: no such file") from None
        except (BaseError, OSError) as fault:
            first_line = str(fault).strip().partition("\n")[0]  # a debug dump follows it
            raise PlaceError(f"{where}: {first_line[:400]}") from None


@dataclass(frozen=True, slots=True)
class Fetched:
    """A file on this computer's disk and its sha256."""

    path: Path
    sha256: str


def place_of(named: str | Path) -> Location:
    """The place of a URL or a folder's path. Raises ConfigurationError for another scheme."""
    text = str(named)
    if not _URL.match(text):
        return Location(Path(os.path.normpath(Path(text).absolute())).as_uri())
    scheme = urlsplit(text).scheme
    if scheme not in SCHEMES:
        raise ConfigurationError(f"{text}: {scheme}:// is not read here; there are {', '.join(SCHEMES)}, and paths")
    return Location(text.rstrip("/"))


@functools.lru_cache(maxsize=64)
def _store_of(url: str) -> ObjectStore:
    """One connection per process and place. Credentials come from the environment, as for the clouds' own tools."""
    parts = urlsplit(url)
    if parts.scheme == "file":
        return LocalStore(unquote(parts.path), mkdir=True)
    return from_url(url)


def _sha256_of(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: no such file") from None
    except OSError as fault:
        raise PlaceError(f"{path}: cannot be read: {fault.strerror or fault}") from None
