"""What follows from the empty vehicle's axle weights, as [vehicle] of a campaign states it: the sprung mass and its
front share, and the payload that the gross limit leaves.

sprung_keys(690.0, 710.0)            # unsprung masses unknown: estimated
payload_range_keys(690.0, 710.0, 2000.0)
"""

import math
from typing import Any, Final

from gateway.errors import CampaignError
from gateway.model.table import ESTIMATED_UNSPRUNG_STD, UNSPRUNG_SHARE
from gateway.stated.facts import DIVISION_KG

WEIGHED_STD: Final = 0.1  # chosen: of one that the campaign states


def sprung_keys(
    front_kg: float,
    rear_kg: float,
    unsprung_front_kg: float | None = None,
    unsprung_rear_kg: float | None = None,
    division_kg: float = DIVISION_KG,
) -> dict[str, float]:
    """The keys of [vehicle] that follow from the scales' readings F and R under each axle of the empty vehicle.

    Static equilibrium of each axle, F = s M + u_f and R = (1 - s) M + u_r with the unsprung masses u, gives

        M = F + R - u_f - u_r,    s = (F - u_f) / M

    An unknown u is taken as k M with k = UNSPRUNG_SHARE, so that M = (F + R - known u) / (1 + k n), n of them unknown;
    it is left out of the keys, so that calibration goes on treating it as unknown. The standard deviation of s is of
    first order with independent errors: of a reading rounded to ``division_kg``, division / sqrt(12); of an unsprung
    mass 10 % if it is given, 30 % if not.
    Raises CampaignError for weights that leave no body to carry.
    """
    given = (unsprung_front_kg, unsprung_rear_kg)
    body_kg = front_kg + rear_kg - sum(kg for kg in given if kg is not None)
    mass_kg = body_kg / (1.0 + UNSPRUNG_SHARE * given.count(None))
    front_u, rear_u = (UNSPRUNG_SHARE * mass_kg if kg is None else kg for kg in given)
    if not (front_kg > front_u and rear_kg > rear_u):
        raise CampaignError(
            f"axle weights of {front_kg:g} and {rear_kg:g} kg are no more than the unsprung masses "
            f"{front_u:.0f} and {rear_u:.0f} kg alone: weigh each axle with the body on it"
        )
    share = (front_kg - front_u) / mass_kg
    front_std_kg, rear_std_kg = (
        math.hypot(division_kg / math.sqrt(12.0), kg * (ESTIMATED_UNSPRUNG_STD if known is None else WEIGHED_STD))
        for kg, known in zip((front_u, rear_u), given, strict=True)
    )
    share_std = math.hypot((1.0 - share) * front_std_kg, share * rear_std_kg) / mass_kg
    keys = {
        "empty_mass_kg": round(mass_kg, 1),
        "empty_front_share_pct": round(100.0 * share, 2),
        "empty_front_share_std_pct": max(0.01, round(100.0 * share_std, 2)),
        "kerb_front_axle_kg": front_kg,
        "kerb_rear_axle_kg": rear_kg,
        "unsprung_front_kg": unsprung_front_kg,
        "unsprung_rear_kg": unsprung_rear_kg,
    }
    return {name: number for name, number in keys.items() if number is not None}


def payload_range_keys(front_kg: float, rear_kg: float, gross_limit_kg: float | None) -> dict[str, Any]:
    """The payloads up to the gross limit; nothing without a limit, or with one that leaves no payload."""
    most_kg = (gross_limit_kg or 0.0) - front_kg - rear_kg
    return {"payload_range_kg": (0.0, most_kg)} if most_kg > 0.0 else {}
