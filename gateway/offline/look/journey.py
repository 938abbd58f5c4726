"""Where the vehicle is and how far it came: told by the names of signals, held against what they read.

Doors and ignitions are not looked for: a state has no unit, and its name is anybody's.
"""

import re
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from gateway.offline.look.readings import Reading
from gateway.offline.look.roles import Found
from gateway.records import F64, Signal

_NO_POSITION: Final = re.compile(r"accura|error|std|dev|valid|ref|dest", re.IGNORECASE)
_STEP_M: Final = 2000.0  # between two frames; an odometer that leaps further counts something else

_LOOKED_FOR: Final[tuple[tuple[Signal, str, re.Pattern[str], Callable[[F64], bool]], ...]] = (
    (Signal.LATITUDE, "angle", re.compile(r"latitude|(?:^|_)lat(?:_|$)", re.IGNORECASE), lambda x: _is_angle(x, 90.0)),
    (
        Signal.LONGITUDE,
        "angle",
        re.compile(r"longitude|(?:^|_)lon(?:g)?(?:_|$)", re.IGNORECASE),
        lambda x: _is_angle(x, 180.0),
    ),
    (
        Signal.ODOMETER,
        "distance",
        re.compile(r"odo|mileage|(?:vehicle|total|trip)_?distance|distance_?(?:total|trip)", re.IGNORECASE),
        lambda x: bool(np.all(np.diff(x) >= 0.0) and np.all(np.diff(x) < _STEP_M)),
    ),
)


def journey_of(readings: Sequence[Reading]) -> tuple[Found, ...]:
    """Latitude, longitude and odometer where a signal has the name and reads like one; the finest of them."""
    found = []
    for role, quantity, name, fits in _LOOKED_FOR:
        named = [
            r for r in readings
            if r.quantity == quantity and name.search(r.signal.name) and not _NO_POSITION.search(r.signal.name)
        ]  # fmt: skip
        good = [r for r in named if len(r.x) > 1 and fits(r.x)]
        if good:
            finest = min(good, key=lambda r: (abs(r.signal.field.scale), -r.rate_hz))
            found.append(Found(role, finest, 1, "its name says so, and it reads like one"))
    return tuple(found)


def _is_angle(x: F64, most_deg: float) -> bool:
    """A receiver without a fix mostly sends 0, or what lies outside."""
    return bool(np.all(np.abs(x) <= most_deg) and np.any(x != 0.0))
