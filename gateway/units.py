"""The one border where foreign units become SI."""

import math
from typing import Final
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from gateway.errors import SignalMapError

STANDARD_GRAVITY_MPS2: Final = 9.80665  # CGPM 1901

NS_PER_S: Final = 1_000_000_000  # SI
S_PER_DAY: Final = 86_400  # SI
NS_PER_DAY: Final = S_PER_DAY * NS_PER_S
BYTES_PER_MB: Final = 1_000_000  # SI

TO_SI: Final[dict[str, dict[str, float]]] = {
    "acceleration": {
        "m/s^2": 1.0,
        "m/s2": 1.0,
        "m/s²": 1.0,
        "m/s/s": 1.0,
        "g": STANDARD_GRAVITY_MPS2,
        "mg": STANDARD_GRAVITY_MPS2 / 1000.0,
    },
    "angular_rate": {
        "rad/s": 1.0,
        "deg/s": math.pi / 180.0,
        "deg/sec": math.pi / 180.0,
        "degrees/s": math.pi / 180.0,
        "°/s": math.pi / 180.0,
        "º/s": math.pi / 180.0,  # the Spanish ordinal: some databases have it in place of the degree sign
        "dps": math.pi / 180.0,
        "mrad/s": 1e-3,
    },
    "speed": {
        "m/s": 1.0,
        "km/h": 1.0 / 3.6,
        "kph": 1.0 / 3.6,
        "kmh": 1.0 / 3.6,
        "mph": 0.44704,
        "kn": 1852.0 / 3600.0,
        "knots": 1852.0 / 3600.0,
    },
    "angle": {"deg": 1.0, "°": 1.0, "degree": 1.0, "degrees": 1.0, "rad": 180.0 / math.pi},
    "distance": {"m": 1.0, "km": 1000.0, "mi": 1609.344, "mm": 1e-3, "cm": 0.01},
    "pressure": {"pa": 1.0, "kpa": 1e3, "mpa": 1e6, "hpa": 100.0, "mbar": 100.0, "bar": 1e5, "psi": 6894.757293168},
    "mass": {"kg": 1.0, "t": 1000.0},
    "temperature": {"degc": 1.0, "°c": 1.0, "deg c": 1.0, "c": 1.0},
    "state": {"": 1.0, "1": 1.0, "bit": 1.0},
}


_NO_ZONES: Final = ("localtime", "posixrules", "Factory")  # names that mean another zone on every computer


def zone_of(name: str) -> ZoneInfo:
    """The time zone of this name (IANA). Raises ValueError for a name that this computer does not know, and for one
    that means another zone elsewhere.
    """
    if name in _NO_ZONES:
        raise ValueError(f"{name} is another zone on every computer; write one as Europe/Berlin, or UTC")
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError):
        raise ValueError(f"no zone is called {name!r} on this computer; write one as Europe/Berlin, or UTC") from None


def si_factor(quantity: str, unit: str | None) -> float:
    """Factor that turns a number in ``unit`` into the SI unit of ``quantity``.

    ``quantity`` is one of acceleration (m/s2), angular_rate (rad/s), speed (m/s), angle (a position's, in degrees as
    WGS 84 and VSS have it), distance (m), pressure (Pa), mass (kg), temperature (degC) or state (1).
    Raises SignalMapError for a unit that is missing or unknown.
    """
    known = TO_SI[quantity]
    key = (unit or "").strip().lower()
    if key in known:
        return known[key]
    said = f"unit {unit!r} is not known" if key else "the DBC gives no unit"
    raise SignalMapError(f"{said} for a {quantity} signal: set unit = one of {', '.join(u for u in known if u)}")
