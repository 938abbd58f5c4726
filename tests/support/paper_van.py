"""The paper's van, and settings of a service that weighs it on a bus of the test's own."""

from pathlib import Path
from typing import Any

from gateway.core.vehicle import Vehicle
from support.configured import service_config
from support.process import TESTS

PAPER_VAN = TESTS.parent / "gateway" / "demo" / "paper_van.json"


def paper_van(**stated: Any) -> Vehicle:
    """The van of the paper with these properties; its sensor is over the front axle unless they say otherwise."""
    return Vehicle(**{"name": "van", "empty_mass_kg": 1240.0, "wheelbase_m": 2.8, "sensor_position_m": 0.0} | stated)


def paper_van_config(directory: Path, port: int, more: str = "") -> Path:
    """A configuration file in ``directory``, its calibration beside it; ``more`` is further TOML."""
    return service_config(directory, PAPER_VAN.read_text(), more, web__port=port)
