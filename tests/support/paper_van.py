"""Settings of a service that weighs the paper's van on a bus of the test's own."""

from pathlib import Path

from support.configured import service_config
from support.process import TESTS

PAPER_VAN = TESTS.parent / "gateway" / "demo" / "paper_van.json"


def paper_van_config(directory: Path, port: int, more: str = "") -> Path:
    """A configuration file in ``directory``, its calibration beside it; ``more`` is further TOML."""
    return service_config(directory, PAPER_VAN.read_text(), more, web__port=port)
