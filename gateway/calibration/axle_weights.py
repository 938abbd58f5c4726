"""From a weighbridge to the sprung mass and its front share, for a campaign's [vehicle].

sprung = sprung_of(AxleWeights(690.0, 710.0))            # unsprung masses unknown: estimated
sprung.vehicle_keys()                                    # the keys of the campaign file
"""

import math
from dataclasses import dataclass
from typing import Final

from gateway.errors import CampaignError
from gateway.stated.facts import DIVISION_KG

UNSPRUNG_SHARE: Final = 0.065  # of the empty sprung mass, per axle; docs/campaign.md compares it with measured cars
ESTIMATED_UNSPRUNG_STD: Final = 0.3  # chosen: of an unsprung mass that is estimated
WEIGHED_STD: Final = 0.1  # chosen: of one that the campaign states


@dataclass(frozen=True, slots=True)
class AxleWeights:
    """The scales' readings under each axle of the empty vehicle, and the unsprung masses as far as they are known."""

    front_kg: float
    rear_kg: float
    unsprung_front_kg: float | None = None
    unsprung_rear_kg: float | None = None


@dataclass(frozen=True, slots=True)
class Sprung:
    """The sprung mass, its share on the front axle, and their standard deviations."""

    weights: AxleWeights
    mass_kg: float
    mass_std_kg: float
    front_share_pct: float
    front_share_std_pct: float
    unsprung_front_kg: float
    unsprung_rear_kg: float

    def vehicle_keys(self) -> dict[str, float]:
        """The keys of [vehicle] that follow. An unsprung mass that is only estimated is left to calibration."""
        keys = {
            "empty_mass_kg": round(self.mass_kg, 1),
            "empty_front_share_pct": round(self.front_share_pct, 2),
            "empty_front_share_std_pct": max(0.01, round(self.front_share_std_pct, 2)),
            "kerb_front_axle_kg": self.weights.front_kg,
            "kerb_rear_axle_kg": self.weights.rear_kg,
        }
        given = {
            "unsprung_front_kg": self.weights.unsprung_front_kg,
            "unsprung_rear_kg": self.weights.unsprung_rear_kg,
        }
        return keys | {name: kg for name, kg in given.items() if kg is not None}


def sprung_of(weights: AxleWeights, division_kg: float = DIVISION_KG) -> Sprung:
    """The sprung mass M and its front share s from the axle weights F and R and the unsprung masses u.

    Static equilibrium of each axle, F = s M + u_f and R = (1 - s) M + u_r, gives

        M = F + R - u_f - u_r,    s = (F - u_f) / M

    An unknown u is taken as k M with k = UNSPRUNG_SHARE, so that M = (F + R - known u) / (1 + k n), n of them unknown.
    Standard deviations are of first order with independent errors: of a reading rounded to ``division_kg``, division /
    sqrt(12); of an unsprung mass 10 % if it is given, 30 % if not.
    Raises CampaignError for weights that leave no body to carry.
    """
    given = (weights.unsprung_front_kg, weights.unsprung_rear_kg)
    total_kg = weights.front_kg + weights.rear_kg - sum(kg for kg in given if kg is not None)
    mass_kg = total_kg / (1.0 + UNSPRUNG_SHARE * given.count(None))
    front_u, rear_u = (UNSPRUNG_SHARE * mass_kg if kg is None else kg for kg in given)
    if not (weights.front_kg > front_u and weights.rear_kg > rear_u):
        raise CampaignError(
            f"axle weights of {weights.front_kg:g} and {weights.rear_kg:g} kg are no more than the unsprung masses "
            f"{front_u:.0f} and {rear_u:.0f} kg alone: weigh each axle with the body on it"
        )
    share = (weights.front_kg - front_u) / mass_kg
    front_var, rear_var = (
        division_kg**2 / 12.0 + (kg * (ESTIMATED_UNSPRUNG_STD if known is None else WEIGHED_STD)) ** 2
        for kg, known in zip((front_u, rear_u), given, strict=True)
    )
    share_std = math.hypot((1.0 - share) * math.sqrt(front_var), share * math.sqrt(rear_var)) / mass_kg
    return Sprung(
        weights=weights,
        mass_kg=mass_kg,
        mass_std_kg=math.sqrt(front_var + rear_var),
        front_share_pct=100.0 * share,
        front_share_std_pct=100.0 * share_std,
        unsprung_front_kg=front_u,
        unsprung_rear_kg=rear_u,
    )
