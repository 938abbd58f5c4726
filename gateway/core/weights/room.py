"""How much more a vehicle may carry, and how near it is to too much."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from gateway.core.weights.limits import over_limit_probability
from gateway.estimate import Quantity, Weights

LOADED_PLACES: Final = ("gross", "front_axle", "rear_axle")  # what a load wherever it is put comes to rest on
NEAR_PROBABILITY: Final = 0.025  # of too much: the limit lies within the weight's 95 % interval
OVER_PROBABILITY: Final = 0.5  # rather too much than not


class Light(StrEnum):
    """What a driver has to know at a glance."""

    GO = "go"
    NEAR = "near"
    OVER = "over"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Room:
    """What may still go aboard before ``place`` bears its limit, in kg; negative where it bears more already."""

    place: str
    limit_kg: float
    left: Quantity

    @property
    def surely_kg(self) -> float:
        """The lower end of the 95 % interval; the number itself where nobody knows how sure it is."""
        low_kg = self.left.interval95[0]
        return self.left.number if math.isnan(low_kg) else low_kg


def rooms_of(weights: Weights) -> tuple[Room, ...]:
    """Of the whole and of each axle that has a limit and is known, the tightest first.

    With F what a place bears and F_max its limit, it takes F_max - F, with F's standard deviation. An axle takes as
    much where all of it comes to rest on this axle; put between the axles it may be more. So the least of them is what
    may go in wherever between the axles it is put. Limits of wheels say how a load lies, more than how much there may
    be of it: they are no part of this.
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
    """How probable too much is, of every place that has a limit and is known, wheels too."""

    probabilities: dict[str, float]

    @property
    def light(self) -> Light:
        """By the place where too much is most probable."""
        most = max(self.probabilities.values(), default=math.nan)
        if math.isnan(most):
            return Light.UNKNOWN
        if most >= OVER_PROBABILITY:
            return Light.OVER
        return Light.NEAR if most > NEAR_PROBABILITY else Light.GO

    def places(self) -> tuple[str, ...]:
        """Those that the light is about, the worst first."""
        least = {Light.OVER: OVER_PROBABILITY, Light.NEAR: NEAR_PROBABILITY}.get(self.light, math.inf)
        told = [place for place, probability in self.probabilities.items() if probability >= least]
        return tuple(sorted(told, key=lambda place: -self.probabilities[place]))


def nearness(weights: Weights) -> Nearness:
    """Of these weights."""
    found = {
        place: over_limit_probability(weight.kg, weight.std_kg, weight.limit_kg) for place, weight in weights.items()
    }
    return Nearness({place: probability for place, probability in found.items() if not math.isnan(probability)})
