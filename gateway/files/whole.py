"""Atomic output files: a file gets its name when it is complete; an earlier file stays until then."""

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from gateway.errors import SpringscaleError


@contextmanager
def written_whole(output: Path) -> Iterator[BinaryIO]:
    """A file that becomes ``output`` on success. Links are followed; a pipe is written directly. Raises OSError."""
    place = output.resolve()
    if place.exists() and not place.is_file():
        with place.open("wb") as file:
            yield file
        return
    part = place.with_name(f"{place.name}.{secrets.token_hex(4)}.part")  # another command may write the same output
    try:
        with part.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        if place.exists():
            shutil.copymode(place, part)
        part.replace(place)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def refusal_told(output: Path, error: type[SpringscaleError]) -> Iterator[None]:
    """Turn an OSError while writing ``output`` into ``error`` with a message for people."""
    try:
        yield
    except FileExistsError:
        raise error(f"{output}: is there already, and is not written over; name another") from None
    except OSError as fault:
        raise error(f"{output}: cannot be written: {fault.strerror or fault}") from None


def write_whole(output: Path, text: str) -> None:
    """Write ``text`` to ``output`` atomically, as UTF-8. Raises OSError."""
    with written_whole(output) as file:
        file.write(text.encode("utf-8"))
