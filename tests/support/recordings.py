"""Where recorded drives lie on a machine that has them."""

import os
from pathlib import Path

import pytest

FOLDER = Path(os.environ.get("SPRINGSCALE_DATA", Path(__file__).parents[3] / "shared" / "data"))


def recordings() -> Path:
    """The folder; skips the test where it is absent."""
    if not FOLDER.is_dir():
        pytest.skip(f"the recorded drives are not at {FOLDER} (set SPRINGSCALE_DATA)")
    return FOLDER
