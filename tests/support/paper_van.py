"""Settings of a service that weighs the paper's van on a bus of the test's own."""

import shutil
from pathlib import Path

from support.process import TESTS

PAPER_VAN = TESTS.parent / "gateway" / "demo" / "paper_van.json"


def paper_van_config(directory: Path, port: int, more: str = "") -> Path:
    """A configuration file in ``directory``, its calibration beside it; ``more`` is further TOML."""
    shutil.copy(PAPER_VAN, directory / "vehicle.json")
    path = directory / "springscale.toml"
    path.write_text(
        f"""
        signals = "springscale:reference"
        calibration = "vehicle.json"
        [bus]
        interface = "virtual"
        channel = "{directory.name}"
        [web]
        port = {port}
        [store]
        directory = "state"
        {more}
        """
    )
    return path
