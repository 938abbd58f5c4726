"""The packages that the lock files name: those of a vehicle, of a desk and of a developer."""

import re
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
_PIN: Final = re.compile(r"^([a-z0-9][a-z0-9._-]*)==(\S+)", re.MULTILINE)


def pins(name: str) -> dict[str, str]:
    """Version by package of one lock file, such as ``requirements-dev.txt``."""
    return dict(_PIN.findall((ROOT / name).read_text()))
