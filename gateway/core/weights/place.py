"""Where the payload lies."""

import math
from dataclasses import dataclass, replace

from gateway.core.stated_share import measured
from gateway.core.vehicle import Vehicle
from gateway.core.weights.errors import Errors
from gateway.core.weights.sideways import NOWHERE, Sideways
from gateway.estimate import Z95, Quantity


@dataclass(frozen=True, slots=True)
class Place:
    """Where the payload's centre of gravity is, behind the front axle, and its standard deviation.

    Left of the centre line likewise, NaN where nothing tells; ``correlation`` is of both errors.
    """

    position_m: float
    std_m: float
    left_m: float = math.nan
    left_std_m: float = math.nan
    correlation: float = math.nan


def place_of(
    vehicle: Vehicle,
    payload: Quantity,
    front_share: Quantity,
    correlation: float = 0.0,
    sideways: Sideways = NOWHERE,
) -> Place | None:
    """Where the payload lies; None where there may be none, and so no place to tell.

    With s the share, s0 the empty share, M the empty mass and l the wheelbase, moments about the front axle give

        d = l (1 - F / L),    F = s (M + L) - s0 M,    the part of L that rests on the front axle,

    the inverse of equation (3) of Bottelli et al. With y and y0 the centres of gravity left of the centre line of
    the whole and of the empty vehicle, moments about that line give y_L = ((M + L) y - M y0) / L. Errors are of
    first order in L, s and y, as correlated as the weights on the road have it (on_the_road). What the
    empty share adds to the error of s (core.stated_share) is in s0 too, and drops out.
    """
    if not payload.number > Z95 * payload.std:
        return None
    load_kg, total_kg = payload.number, vehicle.empty_mass_kg + payload.number
    share, empty_share = front_share.number / 100.0, vehicle.empty_front_share
    front_share_of_load = (share * total_kg - empty_share * vehicle.empty_mass_kg) / load_kg
    cg_left_m = sideways.cg_left.number
    left_m = (total_kg * cg_left_m - vehicle.empty_mass_kg * vehicle.empty_cg_left_m) / load_kg
    share_std_pct, correlation = measured(payload, front_share, correlation, vehicle)
    _, with_cg = measured(payload, front_share, sideways.front_share_correlation, vehicle)
    beside_empty = replace(sideways, front_share_correlation=with_cg)
    errors = Errors(payload, replace(front_share, std=share_std_pct), correlation, beside_empty)
    along = [vehicle.wheelbase_m * slope for slope in ((front_share_of_load - share) / load_kg, -total_kg / load_kg)]
    across = [(cg_left_m - left_m) / load_kg, 0.0, total_kg / load_kg]
    std_m, left_std_m = errors.std(along), errors.std(across)
    is_both = std_m * left_std_m > 0.0
    return Place(
        position_m=vehicle.wheelbase_m * (1.0 - front_share_of_load),
        std_m=std_m,
        left_m=left_m,
        left_std_m=left_std_m,
        correlation=errors.covariance(along, across) / (std_m * left_std_m) if is_both else math.nan,
    )
