"""Payload and front share of the sprung mass from a stated weight."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final

from gateway.core.known_weights import KnownWeightKind
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.core.weights.on_the_road import Unsprung
from gateway.errors import RefusedError
from gateway.stated.facts import StatedWeight

LEAST_PAYLOAD_SHARE: Final = -0.1  # chosen: of the empty mass; less means another vehicle or another unit
MOST_PAYLOAD_SHARE: Final = 3.0  # chosen: of the empty mass; more means another unit
SHARES_PCT: Final = (
    5.0,
    95.0,
)  # chosen: on the front axle; beyond, the ticket is another vehicle's or the axles are exchanged


STD_KG: Final[Mapping[KnownWeightKind, float]] = MappingProxyType(
    {
        KnownWeightKind.EMPTY: 10.0,  # a tank of 60 l anywhere between a quarter and full
        KnownWeightKind.TICKET: 5.0,  # a weighbridge that shows steps of 10 kg (class III, OIML R 76)
        KnownWeightKind.AXLE_PADS: 10.0,  # portable pads, 1 % of an axle of a ton
        KnownWeightKind.DELIVERY_NOTE: 10.0,  # packing and other items on board
    }
)
"""Chosen: default standard deviation of each weighed number."""
PLACE_STD_M: Final = 0.1  # chosen: of a load's stated place


class WeightRefusal(StrEnum):
    """Why a stated weight cannot be used. docs/known-weights.md says what to do about each."""

    NO_CALIBRATION = "no_calibration"
    NO_UNSPRUNG_MASS = "no_unsprung_mass"
    IMPOSSIBLE_WEIGHT = "impossible_weight"
    NO_EPOCH = "no_epoch"
    AMBIGUOUS_EPOCH = "ambiguous_epoch"
    OTHER_CALIBRATION = "other_calibration"
    NO_COUNTED_BATCH = "no_counted_batch"
    LOAD_MAY_HAVE_CHANGED = "load_may_have_changed"
    STALE = "stale"
    ALREADY_KNOWN = "already_known"
    NO_SUCH_WEIGHT = "no_such_weight"
    NOT_HELD = "not_held"
    NOT_STORED = "not_stored"


@dataclass(frozen=True, slots=True)
class StatedLoad:
    """A load in a calibration's terms; ``front_share_pct`` is None if no place was stated.

    ``gross_kg`` and the axles' weights are those on the road, None without unsprung masses. The ``_std`` fields are the
    standard deviations of the stated numbers. ``is_share_weighed`` is false if the front share follows from the empty
    vehicle's, whose error it then shares with every estimate.
    """

    payload_kg: float
    front_share_pct: float | None
    gross_kg: float | None
    front_axle_kg: float | None
    rear_axle_kg: float | None
    payload_std_kg: float
    front_share_std_pct: float | None
    is_share_weighed: bool


def load_of(
    stated: StatedWeight, vehicle: Vehicle, unsprung: Unsprung, kind: KnownWeightKind = KnownWeightKind.TICKET
) -> StatedLoad:
    """Statics: an axle carries its share of the sprung mass M + L and its unsprung mass u.

        L = G - M - u_front - u_rear,    D = (F_front - u_front) / (M + L)

    ``unsprung`` is used where no unsprung mass was stated. Raises RefusedError.
    """
    below = unsprung.unless_stated(vehicle)
    front_u, rear_u = below.front.number, below.rear.number
    std_kg = STD_KG[kind] if stated.std_kg is None else stated.std_kg
    payload_std_kg = std_kg
    share_pct: float | None
    if stated.payload_kg is not None:
        payload_kg = stated.payload_kg
        is_placed = stated.position_m is not None or payload_kg == 0.0
        share_pct = front_share_pct(vehicle, payload_kg, stated.position_m) if is_placed else None
    else:
        _require_unsprung(front_u, rear_u)
        gross_kg = _gross_kg(stated)
        payload_kg = gross_kg - vehicle.empty_mass_kg - front_u - rear_u
        front_kg = stated.front_axle_kg
        share_pct = None if front_kg is None else 100.0 * (front_kg - front_u) / (vehicle.empty_mass_kg + payload_kg)
        if front_kg is not None:
            payload_std_kg = math.sqrt(2.0) * std_kg  # two axles, each with the scale's error
    _require_possible(payload_kg, share_pct, vehicle)
    sprung_kg = vehicle.empty_mass_kg + payload_kg
    return StatedLoad(
        payload_kg=payload_kg,
        front_share_pct=share_pct,
        gross_kg=_known(sprung_kg + front_u + rear_u),
        front_axle_kg=None if share_pct is None else _known(share_pct / 100.0 * sprung_kg + front_u),
        rear_axle_kg=None if share_pct is None else _known((1.0 - share_pct / 100.0) * sprung_kg + rear_u),
        payload_std_kg=payload_std_kg,
        front_share_std_pct=_share_std_pct(stated, share_pct, sprung_kg, std_kg, vehicle),
        is_share_weighed=stated.front_axle_kg is not None,
    )


def _share_std_pct(
    stated: StatedWeight, share_pct: float | None, sprung_kg: float, std_kg: float, vehicle: Vehicle
) -> float | None:
    """To first order: from two weighed axles, or from a payload and its place."""
    if share_pct is None:
        return None
    share = share_pct / 100.0
    if stated.front_axle_kg is not None:
        return 100.0 * std_kg * math.hypot(1.0 - share, share) / sprung_kg
    position_m = stated.position_m if stated.payload_kg else None
    # without a stated place an empty vehicle's tank and tools may be anywhere between the axles, at worst over one
    by_weight = 0.5 if position_m is None else 1.0 - position_m / vehicle.wheelbase_m - share
    by_place = (stated.payload_kg or 0.0) * PLACE_STD_M / vehicle.wheelbase_m
    return 100.0 * math.hypot(by_weight * std_kg, by_place) / sprung_kg


def _gross_kg(stated: StatedWeight) -> float:
    if stated.gross_kg is not None:
        return stated.gross_kg
    return (stated.front_axle_kg or 0.0) + (stated.rear_axle_kg or 0.0)


def _require_unsprung(front_kg: float, rear_kg: float) -> None:
    if math.isnan(front_kg + rear_kg):
        raise RefusedError(
            WeightRefusal.NO_UNSPRUNG_MASS,
            "no payload follows from a weight on the road: the campaign's [vehicle] states neither unsprung masses nor "
            "kerb axle weights, and calibration found none; state the payload instead",
        )


def _require_possible(payload_kg: float, share_pct: float | None, vehicle: Vehicle) -> None:
    low_kg, high_kg = (share * vehicle.empty_mass_kg for share in (LEAST_PAYLOAD_SHARE, MOST_PAYLOAD_SHARE))
    if not low_kg <= payload_kg <= high_kg:
        raise RefusedError(
            WeightRefusal.IMPOSSIBLE_WEIGHT,
            f"that would be a payload of {payload_kg:.0f} kg; for this vehicle ({vehicle.empty_mass_kg:.0f} kg sprung, "
            f"empty) {low_kg:.0f} to {high_kg:.0f} kg are possible: is it another vehicle's, or another unit?",
        )
    if share_pct is not None and not SHARES_PCT[0] <= share_pct <= SHARES_PCT[1]:
        raise RefusedError(
            WeightRefusal.IMPOSSIBLE_WEIGHT,
            f"that would be {share_pct:.0f} % of the sprung mass on the front axle: are axles or place mixed up?",
        )


def _known(kg: float) -> float | None:
    return kg if math.isfinite(kg) else None
