"""The journey part of a batch as JSON: distances, standstills, door and ignition, and positions if they are kept."""

import math
from collections.abc import Mapping
from typing import Any

from gateway.estimate import NOWHERE, UNWATCHED, Place, Stop, Watched, Way
from gateway.estimate_json.kinds import INSTANT, FieldKind

_DIGITS = 9


def way_to_json(way: Way) -> dict[str, Any]:
    """The JSON object of a way; unknown is None."""
    return {
        "distance_m": _number(way.distance_m),
        "known_s": way.known_s,
        "moving_s": way.moving_s,
        "odometer_start_m": _number(way.odometer_start_m),
        "odometer_end_m": _number(way.odometer_end_m),
        "start": place_to_json(way.start),
        "end": place_to_json(way.end),
        "stops": [_stop(stop) for stop in way.stops],
        "before": _watched(way.before),
        "since": None if way.since_ns is None else INSTANT.write(way.since_ns),
    }


def way_from_json(told: Mapping[str, Any]) -> Way:
    """The inverse of :func:`way_to_json`, within its rounding."""
    return Way(
        distance_m=_known(told["distance_m"]),
        known_s=told["known_s"],
        moving_s=told["moving_s"],
        odometer_start_m=_known(told["odometer_start_m"]),
        odometer_end_m=_known(told["odometer_end_m"]),
        start=_place_of(told["start"]),
        end=_place_of(told["end"]),
        stops=tuple(map(_stop_of, told["stops"])),
        before=_watched_of(told["before"]),
        since_ns=None if told["since"] is None else INSTANT.read(told["since"]),
    )


def place_to_json(place: Place) -> dict[str, float] | None:
    """Latitude and longitude in degrees; None if they are unknown or not kept."""
    if not place.is_known:
        return None
    return {"latitude_deg": place.latitude_deg, "longitude_deg": place.longitude_deg}


def _place_of(told: Mapping[str, float] | None) -> Place:
    return NOWHERE if told is None else Place(told["latitude_deg"], told["longitude_deg"])


def _stop(stop: Stop) -> dict[str, Any]:
    return {
        "t_start": INSTANT.write(stop.t_start_ns),
        "t_end": INSTANT.write(stop.t_end_ns),
        **_watched(stop.watched),
        "place": place_to_json(stop.place),
    }


def _stop_of(told: Mapping[str, Any]) -> Stop:
    return Stop(INSTANT.read(told["t_start"]), INSTANT.read(told["t_end"]), _watched_of(told), _place_of(told["place"]))


def _watched(seen: Watched) -> dict[str, bool | None]:
    return {"door_opened": seen.door_opened, "ignition_off": seen.ignition_off}


def _watched_of(told: Mapping[str, Any]) -> Watched:
    seen = Watched(told["door_opened"], told["ignition_off"])
    return UNWATCHED if seen == UNWATCHED else seen


def _number(x: float) -> float | None:
    return float(f"{x:.{_DIGITS}g}") if math.isfinite(x) else None


def _known(told: float | None) -> float:
    return math.nan if told is None else told


WAY = FieldKind(dict[str, Any] | None, lambda way: None if way is None else way_to_json(way), way_from_json)
EXAMPLE = way_to_json(
    Way(3521.4, 299.8, 251.2, 18_204_300.0, 18_207_800.0, stops=(Stop(0, 20_000_000_000, Watched(True, False)),))
)
