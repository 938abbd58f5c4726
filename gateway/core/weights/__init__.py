"""What a vehicle weighs on the road, as a whole and on each axle and wheel, and where its payload lies.

weighed(estimate, vehicle, unsprung)    # as it leaves; ``unsprung`` is what calibration found
"""

from gateway.core.weights.limits import RELEASE_SHARE, Limits, is_over_limit, over_limit_probability
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Place, Unsprung, place_of, unsprung_kg, weighed, weights_of
from gateway.core.weights.room import Light, Nearness, Room, nearness, rooms_of

__all__ = [
    "NOT_CALIBRATED",
    "RELEASE_SHARE",
    "Light",
    "Limits",
    "Nearness",
    "Place",
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
