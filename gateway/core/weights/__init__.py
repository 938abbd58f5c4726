"""The weights of a vehicle on the road: gross, per axle and per wheel, and the place of its payload.

weighed(estimate, vehicle, unsprung)    # the estimate as published; ``unsprung`` comes from calibration
"""

from gateway.core.weights.limits import (
    RELEASE_SHARE,
    Light,
    Limits,
    Nearness,
    Room,
    is_over_limit,
    nearness,
    over_limit_probability,
    rooms_of,
)
from gateway.core.weights.on_the_road import (
    NOT_CALIBRATED,
    PayloadPlace,
    Unsprung,
    place_of,
    unsprung_kg,
    weighed,
    weights_of,
)

__all__ = [
    "NOT_CALIBRATED",
    "RELEASE_SHARE",
    "Light",
    "Limits",
    "Nearness",
    "PayloadPlace",
    "Room",
    "Unsprung",
    "is_over_limit",
    "nearness",
    "over_limit_probability",
    "place_of",
    "rooms_of",
    "unsprung_kg",
    "weighed",
    "weights_of",
]
