"""What a vehicle may weigh, how probable it is that it weighs more, and when a weight counts as over its limit."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Any, Final, Self

from gateway.core.vehicle import Vehicle

RELEASE_SHARE: Final = 0.03  # of the limit: how far a load must fall below it before a warning ends


@dataclass(frozen=True, slots=True)
class Limits:
    """Permitted weights, by the names that Vehicle has for them; None where nobody said."""

    gross_limit_kg: float | None = None
    front_axle_limit_kg: float | None = None
    rear_axle_limit_kg: float | None = None
    front_wheel_limit_kg: float | None = None
    rear_wheel_limit_kg: float | None = None

    @classmethod
    def of(cls, told: Any) -> Self:
        """As ``told`` has them, by the same names."""
        return cls(**{one.name: getattr(told, one.name) for one in fields(cls)})

    def overridden_by(self, nearer: Self) -> Self:
        """With those that ``nearer`` states in place of these."""
        return replace(self, **nearer.stated())

    def stated(self) -> dict[str, Any]:
        """Those that somebody said, by name."""
        numbers = {one.name: getattr(self, one.name) for one in fields(self)}
        return {name: kg for name, kg in numbers.items() if kg is not None}

    def on(self, vehicle: Vehicle) -> Vehicle:
        """``vehicle`` with these limits; where there is none here it keeps its own."""
        return replace(vehicle, **self.stated())


def over_limit_probability(kg: float, std_kg: float, limit_kg: float | None) -> float:
    """P(weight > limit), 0 to 1, of a weight with a normal error; NaN without a limit or a known weight.

    With Phi the standard normal distribution, P = 1 - Phi((limit - kg) / std) = erfc((limit - kg) / (std sqrt 2)) / 2
    (Abramowitz and Stegun, Handbook of Mathematical Functions, 26.2.29). A weight without any error is over its limit
    or is not.
    """
    if limit_kg is None or math.isnan(kg) or math.isnan(std_kg):
        return math.nan
    if std_kg == 0.0:
        return float(kg > limit_kg)
    return 0.5 * math.erfc((limit_kg - kg) / (std_kg * math.sqrt(2.0)))


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
