"""The vehicle that a service weighs, with its calibration and estimator."""

from dataclasses import dataclass

from gateway.core.calibrated import CalibratedVehicle


@dataclass(frozen=True, slots=True)
class Subject:
    """The vehicle, its calibration and the estimator in use."""

    calibrated: CalibratedVehicle | None
    estimator: str
    vehicle_id: str | None

    @property
    def calibration_id(self) -> str | None:
        """Identifier of the calibration in use; None without one."""
        return None if self.calibrated is None else self.calibrated.id
