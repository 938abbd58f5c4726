"""How much more a vehicle may carry, and how close it is to its limits."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from gateway.core.weights.limits import over_limit_probability
from gateway.estimate import Quantity, Weights

LOADED_PLACES: Final = ("gross", "front_axle", "rear_axle")  # the places that any additional load affects
NEAR_PROBABILITY: Final = 0.025  # of overload: the limit is within the weight's 95 % interval
OVER_PROBABILITY: Final = 0.5  # overload is more likely than not


class Light(StrEnum):
    """The traffic light for the driver."""

    GO = "go"
    NEAR = "near"
    OVER = "over"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Room:
    """The payload (kg) that may still be added before ``place`` reaches its limit; negative if it is above already."""

    place: str
    limit_kg: float
    left: Quantity

    @property
    def surely_kg(self) -> float:
        """The lower end of the 95 % interval; the number itself if its error is unknown."""
        low_kg = self.left.interval95[0]
        return self.left.number if math.isnan(low_kg) else low_kg


def rooms_of(weights: Weights) -> tuple[Room, ...]:
    """The room of the vehicle and of each axle with a limit and a known weight, the tightest first.

    With F the weight of a place and F_max its limit, the room is F_max - F, with F's standard deviation. An axle's room
    holds if all of the added load acts on it; between the axles more is possible. So the least room holds for any place
    between the axles. Limits of wheels concern the place of a load more than its size, and are left out.
    """
    return tuple(sorted(_rooms(weights), key=lambda room: room.surely_kg))


def _rooms(weights: Weights) -> Iterator[Room]:
    for place, weight in weights.items():
        if place in LOADED_PLACES and weight.limit_kg is not None and weight.is_known:
            low_kg, high_kg = weight.interval95_kg
            left_kg = (weight.limit_kg - high_kg, weight.limit_kg - low_kg)
            yield Room(place, weight.limit_kg, Quantity(weight.limit_kg - weight.kg, weight.std_kg, left_kg))


@dataclass(frozen=True, slots=True)
class Nearness:
    """The probability of overload of every place with a limit and a known weight, wheels included."""

    probabilities: dict[str, float]

    @property
    def light(self) -> Light:
        """The light for the most probable overload."""
        most = max(self.probabilities.values(), default=math.nan)
        if math.isnan(most):
            return Light.UNKNOWN
        if most >= OVER_PROBABILITY:
            return Light.OVER
        return Light.NEAR if most > NEAR_PROBABILITY else Light.GO

    def places(self) -> tuple[str, ...]:
        """The places that cause the light, the worst first."""
        least = {Light.OVER: OVER_PROBABILITY, Light.NEAR: NEAR_PROBABILITY}.get(self.light, math.inf)
        told = [place for place, probability in self.probabilities.items() if probability >= least]
        return tuple(sorted(told, key=lambda place: -self.probabilities[place]))


def nearness(weights: Weights) -> Nearness:
    """The nearness of these weights."""
    found = {
        place: over_limit_probability(weight.kg, weight.std_kg, weight.limit_kg) for place, weight in weights.items()
    }
    return Nearness({place: probability for place, probability in found.items() if not math.isnan(probability)})
