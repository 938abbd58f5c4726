"""Writes the drawings in docs/images (`make docs`); with --check only says whether they are up to date.

Each is drawn by a module of docs/drawings: the rooms from the code's imports, the spectra from a simulated drive.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from drawings.half_car import half_car
from drawings.mounting import mounting
from drawings.rooms import rooms
from drawings.service import service
from drawings.spectra import spectra

TOLERANCE_PX: Final = 1.0  # chosen: of the spectra, which machines round differently
IMAGES: Final = Path(__file__).with_name("images")
DRAWINGS: Final[Mapping[str, Callable[[], str]]] = {
    "half-car.svg": half_car,
    "mounting.svg": mounting,
    "rooms.svg": rooms,
    "service.svg": service,
    "spectra.svg": spectra,
}
