"""A vehicle has no numba, matplotlib or plotly: what needs them says where they are, the rest works without."""

import subprocess
import sys

import pytest
from support.patience import PATIENCE_S

WITHOUT = """
import sys
for name in ("numba", "matplotlib", "plotly"):
    sys.modules[name] = None
from gateway.cli import main
main(sys.argv[1:])
"""


def springscale(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The command line of a vehicle."""
    command = [sys.executable, "-c", WITHOUT, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)


def test_a_command_of_the_workbench_names_its_package() -> None:
    asked = springscale("demo", "--once")
    assert asked.returncode == 1
    assert asked.stderr == "springscale: this command needs numba: apt install springscale-workbench\n"


@pytest.mark.parametrize("command", ["run", "check-config", "estimate", "calibrate", "evaluate", "replay", "token"])
def test_what_a_vehicle_does_needs_no_workbench(command: str) -> None:
    assert springscale(command, "--help").returncode == 0
