"""Permitted weights, the probability of exceeding them, and when a weight counts as over its limit."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Any, Final, Self

from gateway.core.vehicle import Vehicle

RELEASE_SHARE: Final = 0.03  # chosen: of the limit; a warning ends below this margin


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


def is_over_limit(weights_kg: Iterable[float], limit_kg: float | None) -> bool:
    """Whether the last of a series of weights counts as over the limit, with hysteresis.

    A warning begins above the limit and ends 3 % below it, so that it does not flicker near the limit. No limit, or no
    known weight: no warning.
    """
    is_over = False
    for weight_kg in weights_kg:
        if limit_kg is None or math.isnan(weight_kg):
            continue
        is_over = weight_kg > limit_kg * (1.0 - RELEASE_SHARE if is_over else 1.0)
    return is_over
