"""What a vehicle weighs as a whole and on each axle, from its payload estimate and its empty figures."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from gateway.core.stated_share import measured
from gateway.core.vehicle import Vehicle
from gateway.estimate import Z95, Quantity

RELEASE_SHARE: Final = 0.03  # of the limit: how far a load must fall below it before a warning ends


@dataclass(frozen=True, slots=True)
class Weight:
    """A weight and its standard deviation. NaN where the vehicle's figures do not suffice."""

    kg: float = math.nan
    std_kg: float = math.nan

    @property
    def is_known(self) -> bool:
        return math.isfinite(self.kg)


@dataclass(frozen=True, slots=True)
class Weights:
    """Static weights of the standing vehicle, unsprung masses included."""

    gross: Weight
    front_axle: Weight
    rear_axle: Weight


def weights_of(vehicle: Vehicle, payload: Quantity, front_share: Quantity, correlation: float = 0.0) -> Weights:
    """Gross weight and axle loads of ``vehicle`` with a payload aboard.

    On an axle rests its share D of the sprung mass M + L and its unsprung mass u:

        F_front = D/100 (M + L) + u_front,    F_rear = (1 - D/100) (M + L) + u_rear,    G = F_front + F_rear

    Standard deviations are of first order in L and D, whose errors have this ``correlation``; where it is NaN they
    count as independent, and the empty figures count as exact. An unsprung mass that was not stated follows from the
    kerb weight of its axle; without either, that axle's load (and the gross weight) are unknown.
    """
    sprung_kg = vehicle.empty_mass_kg + payload.number
    share = front_share.number / 100.0
    by_share_kg = sprung_kg * front_share.std / 100.0
    front_kg, rear_kg = unsprung_kg(vehicle)
    return Weights(
        gross=_weight(sprung_kg + front_kg + rear_kg, payload.std),
        front_axle=_weight(share * sprung_kg + front_kg, _together(share * payload.std, by_share_kg, correlation)),
        rear_axle=_weight(
            (1.0 - share) * sprung_kg + rear_kg, _together((1.0 - share) * payload.std, -by_share_kg, correlation)
        ),
    )


def _together(one: float, other: float, correlation: float) -> float:
    """Standard deviation of a sum of two errors (signed standard deviations) with this correlation."""
    common = 0.0 if math.isnan(correlation) else 2.0 * correlation * one * other
    return math.sqrt(max(0.0, one**2 + other**2 + common)) if not math.isnan(one + other) else math.nan


@dataclass(frozen=True, slots=True)
class Place:
    """Where the payload's centre of gravity is, behind the front axle, and its standard deviation."""

    position_m: float
    std_m: float


def place_of(vehicle: Vehicle, payload: Quantity, front_share: Quantity, correlation: float = 0.0) -> Place | None:
    """Where the payload lies; None where there may be none, and so no place to tell.

    With s the share, s0 the empty share, M the empty mass and l the wheelbase, moments about the front axle give

        d = l (1 - F / L),    F = s (M + L) - s0 M,    the part of L that rests on the front axle,

    the inverse of equation (3) of Bottelli et al. The deviation is of first order in L and s, whose errors have this
    ``correlation``; what the empty share adds to that of s (core.stated_share) is in s0 too, and drops out.
    """
    if not payload.number > Z95 * payload.std:
        return None
    share, empty_share = front_share.number / 100.0, vehicle.empty_front_share
    total_kg = vehicle.empty_mass_kg + payload.number
    front_share_of_load = (share * total_kg - empty_share * vehicle.empty_mass_kg) / payload.number
    by_payload = (share - front_share_of_load) / payload.number * payload.std
    share_std_pct, correlation = measured(payload, front_share, correlation, vehicle)
    by_share = total_kg / payload.number * share_std_pct / 100.0
    position = 1.0 - front_share_of_load  # in wheelbases
    return Place(vehicle.wheelbase_m * position, vehicle.wheelbase_m * _together(by_payload, by_share, correlation))


def unsprung_kg(vehicle: Vehicle) -> tuple[float, float]:
    """Unsprung mass at the front and the rear axle; NaN where neither it nor the kerb weight is stated."""
    share = vehicle.empty_front_share
    return (
        _unsprung(vehicle.unsprung_front_kg, vehicle.kerb_front_axle_kg, share * vehicle.empty_mass_kg),
        _unsprung(vehicle.unsprung_rear_kg, vehicle.kerb_rear_axle_kg, (1.0 - share) * vehicle.empty_mass_kg),
    )


def is_over_limit(weights_kg: Iterable[float], limit_kg: float | None) -> bool:
    """Whether the last of a series of weights counts as over the limit, with hysteresis.

    A warning begins above the limit and ends 3 % below it, so that an estimate that wavers about the
    limit does not make it flicker. No limit, or no known weight: no warning.
    """
    is_over = False
    for weight_kg in weights_kg:
        if limit_kg is None or math.isnan(weight_kg):
            continue
        is_over = weight_kg > limit_kg * (1.0 - RELEASE_SHARE if is_over else 1.0)
    return is_over


def _unsprung(stated_kg: float | None, kerb_kg: float | None, sprung_kg: float) -> float:
    if stated_kg is not None:
        return stated_kg
    return math.nan if kerb_kg is None else kerb_kg - sprung_kg


def _weight(kg: float, std_kg: float) -> Weight:
    return Weight(kg, std_kg) if math.isfinite(kg) else Weight()
