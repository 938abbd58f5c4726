"""Which code weighs: the version, and a hash of every file that a result hangs on.

A version alone would call two days of development the same, and keep what the older one found.
"""

import functools
import hashlib
from importlib.metadata import version
from pathlib import Path
from typing import Final

WEIGHING: Final = (
    "archive/dataset.py",
    "archive/drives.py",
    "bus/frames.py",
    "bus/logs",
    "bus/messages.py",
    "bus/signals",
    "core",
    "estimate.py",
    "estimate_json",
    "records.py",
    "units.py",
)
"""Of the package: files and folders between a log's bytes and a row."""


@functools.cache
def software() -> str:
    """springscale 1.2.3 code 0123456789ab."""
    return f"springscale {version('springscale')} code {code_id()}"


def code_id() -> str:
    """Hash of those files as they are installed."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(found for named in WEIGHING for found in _sources(package / named)):
        digest.update(f"{path.relative_to(package).as_posix()}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _sources(path: Path) -> list[Path]:
    return [path] if path.is_file() else list(path.rglob("*.py"))
