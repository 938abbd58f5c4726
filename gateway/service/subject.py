"""What a service weighs, and with what."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from gateway.core.calibrated import CalibratedVehicle

SERVICE: Final = "service"  # who did it where nobody asked for it

OnEvent = Callable[[str, Mapping[str, Any]], object]


@dataclass(frozen=True, slots=True)
class Subject:
    """The vehicle, its calibration and the estimator in use."""

    calibrated: CalibratedVehicle | None
    estimator: str
    vehicle_id: str | None

    @property
    def calibration_id(self) -> str | None:
        """Of the calibration in use."""
        return None if self.calibrated is None else self.calibrated.id
