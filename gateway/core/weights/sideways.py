"""What an estimate says of the way across the vehicle."""

import math
from dataclasses import dataclass
from typing import Final

from gateway.estimate import UNKNOWN, Estimate, Quantity


@dataclass(frozen=True, slots=True)
class Sideways:
    """Where the sprung mass lies to the side and how the axles divide its moment; NaN where nothing tells.

    Correlations are of the errors of ``cg_left`` with those of payload and front share.
    """

    cg_left: Quantity = UNKNOWN
    roll_share_front: float = math.nan
    roll_share_front_std: float = math.nan
    payload_correlation: float = math.nan
    front_share_correlation: float = math.nan

    @classmethod
    def of(cls, estimate: Estimate) -> "Sideways":
        """As an estimate has it."""
        return cls(
            estimate.cg_left,
            estimate.roll_share_front,
            estimate.roll_share_front_std,
            estimate.payload_cg_left_correlation,
            estimate.front_share_cg_left_correlation,
        )

    @property
    def is_known(self) -> bool:
        return math.isfinite(self.cg_left.number) and math.isfinite(self.roll_share_front)


NOWHERE: Final = Sideways()
