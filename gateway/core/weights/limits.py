"""Permitted weights: the probability of exceeding them, and how much more a vehicle may carry."""

import math
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from typing import Any, Final, Self

from gateway.core.vehicle import Vehicle
from gateway.estimates.batch_estimate import Quantity, Weights


@dataclass(frozen=True, slots=True)
class Limits:
    """Permitted weights, with Vehicle's names; None if not stated."""

    gross_limit_kg: float | None = None
    front_axle_limit_kg: float | None = None
    rear_axle_limit_kg: float | None = None
    front_wheel_limit_kg: float | None = None
    rear_wheel_limit_kg: float | None = None

    @classmethod
    def of(cls, told: Any) -> Self:
        """The limits that are attributes of ``told``."""
        return cls(**{one.name: getattr(told, one.name) for one in fields(cls)})

    def overridden_by(self, nearer: Self) -> Self:
        """These limits, replaced by those that ``nearer`` states."""
        return replace(self, **nearer.stated())

    def stated(self) -> dict[str, Any]:
        """The stated limits by name."""
        numbers = {one.name: getattr(self, one.name) for one in fields(self)}
        return {name: kg for name, kg in numbers.items() if kg is not None}

    def on(self, vehicle: Vehicle) -> Vehicle:
        """``vehicle`` with these limits; where none is stated it keeps its own."""
        return replace(vehicle, **self.stated())


def over_limit_probability(kg: float, std_kg: float, limit_kg: float | None) -> float:
    """P(weight > limit), 0 to 1, for a weight with a normal error; NaN without a limit or a known weight.

    With Phi the standard normal distribution, P = 1 - Phi((limit - kg) / std) = erfc((limit - kg) / (std sqrt 2)) / 2
    (Abramowitz and Stegun, Handbook of Mathematical Functions, 26.2.29). Without an error P is 0 or 1.
    """
    if limit_kg is None or math.isnan(kg) or math.isnan(std_kg):
        return math.nan
    if std_kg == 0.0:
        return float(kg > limit_kg)
    return 0.5 * math.erfc((limit_kg - kg) / (std_kg * math.sqrt(2.0)))


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
    rooms = []
    for place, weight in weights.items():
        if place in LOADED_PLACES and weight.limit_kg is not None and weight.is_known:
            low_kg, high_kg = weight.interval95_kg
            left_kg = (weight.limit_kg - high_kg, weight.limit_kg - low_kg)
            rooms.append(Room(place, weight.limit_kg, Quantity(weight.limit_kg - weight.kg, weight.std_kg, left_kg)))
    return tuple(sorted(rooms, key=lambda room: room.surely_kg))


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
