"""Programs of others that tests run where they are found: on the path, or where an environment variable says.

Nothing is installed by a test. SPRINGSCALE_HASS=/opt/ha/bin/hass names Home Assistant's, and so on.
"""

import os
import shutil
from pathlib import Path

import pytest

PATHS = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/usr/local/sbin", "/usr/bin", "/usr/local/bin"])


def found(program: str) -> str | None:
    """Where a program is; None where it is not here."""
    named = os.environ.get(variable(program))
    if named:
        return named if Path(named).is_file() else None
    return shutil.which(program, path=PATHS)


def variable(program: str) -> str:
    return f"SPRINGSCALE_{program.upper().replace('-', '_')}"


def needs(program: str) -> pytest.MarkDecorator:
    """Skip where the program is not here, naming what would bring it in."""
    reason = f"{program} is not on the path, and {variable(program)} does not name it"
    return pytest.mark.skipif(found(program) is None, reason=reason)
