"""What springs do not carry: axles, wheels and brakes, as stated, from kerb weights, or as calibration found it."""

import math
from dataclasses import dataclass
from typing import Final

from gateway.core.vehicle import Vehicle
from gateway.estimate import UNKNOWN, Quantity


@dataclass(frozen=True, slots=True)
class Unsprung:
    """Unsprung masses of both axles in kg; ``correlation`` is of their errors. One that was stated has no error."""

    front: Quantity = UNKNOWN
    rear: Quantity = UNKNOWN
    correlation: float = 0.0

    @property
    def both(self) -> Quantity:
        """Their sum."""
        one, other = self.front.std, self.rear.std
        variance = one**2 + other**2 + 2.0 * self.correlation * one * other
        return Quantity(self.front.number + self.rear.number, math.sqrt(max(0.0, variance)))

    @property
    def is_estimated(self) -> bool:
        """True where either axle's was not stated."""
        return self.front.std > 0.0 or self.rear.std > 0.0

    def unless_stated(self, vehicle: Vehicle) -> "Unsprung":
        """What the fitter of ``vehicle`` stated, and these where nothing was."""
        front_kg, rear_kg = unsprung_kg(vehicle)
        return Unsprung(
            self.front if math.isnan(front_kg) else Quantity(front_kg, 0.0),
            self.rear if math.isnan(rear_kg) else Quantity(rear_kg, 0.0),
            self.correlation,
        )


NOT_CALIBRATED: Final = Unsprung()


def unsprung_kg(vehicle: Vehicle) -> tuple[float, float]:
    """Unsprung mass at the front and the rear axle; NaN where neither it nor the kerb weight is stated."""
    share = vehicle.empty_front_share
    return (
        _unsprung(vehicle.unsprung_front_kg, vehicle.kerb_front_axle_kg, share * vehicle.empty_mass_kg),
        _unsprung(vehicle.unsprung_rear_kg, vehicle.kerb_rear_axle_kg, (1.0 - share) * vehicle.empty_mass_kg),
    )


def _unsprung(stated_kg: float | None, kerb_kg: float | None, sprung_kg: float) -> float:
    if stated_kg is not None:
        return stated_kg
    return math.nan if kerb_kg is None else kerb_kg - sprung_kg
