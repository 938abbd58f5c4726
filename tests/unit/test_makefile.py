"""What `make` would do, asked of make itself."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def planned(*arguments: str) -> str:
    """The commands of a set-up from nothing, not run."""
    if shutil.which("make") is None:
        pytest.skip("needs make")
    asked = ["make", "--no-print-directory", "--dry-run", "--always-make", *arguments]
    return subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=True).stdout


def test_the_demonstration_takes_a_port() -> None:
    assert "springscale demo --port 8123" in planned("demo", "PORT=8123")
    assert "springscale demo --port 8000" in planned("demo")


def test_an_installation_tells_how_far_it_is() -> None:
    commands = planned("test")
    assert commands.startswith('echo "Setting up .venv')
    assert commands.count("pip install") + commands.count("pip --disable-pip-version-check install") >= 4
    assert "--quiet" not in commands
