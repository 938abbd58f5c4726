"""A sister's calibration file as the prior of the next vehicle of her model, so that one empty drive is enough.

By how much vehicles of one model differ is a column of the table of parameters (gateway.model.table).
"""

from typing import Final

from gateway.calibration.file import CalibrationFile
from gateway.core.vehicle import Vehicle
from gateway.errors import NoSisterError
from gateway.model.vehicle_model import VehicleModel

MOST_WHEELBASE_DIFFERENCE: Final = 0.01  # chosen: of the wheelbase; a larger difference is another model
MOST_MASS_DIFFERENCE: Final = 0.25  # chosen: of the sprung mass; a larger difference is another body


def sister_in(file: CalibrationFile) -> VehicleModel:
    """What drives have taught of the vehicle of a calibration file. Raises NoSisterError if only the ratio index is
    calibrated.
    """
    if file.cross_spectrum is None:
        raise NoSisterError(
            f"{file.vehicle.name} ({file.id}): has no cross_spectrum calibration, which a sister needs: "
            "calibrate it again without --estimator ratio_index"
        )
    return file.cross_spectrum


def require_alike(sister: Vehicle, vehicle: Vehicle) -> None:
    """Raises NoSisterError if both cannot be of one model."""
    off_m, off_kg = vehicle.wheelbase_m - sister.wheelbase_m, vehicle.empty_mass_kg - sister.empty_mass_kg
    if abs(off_m) > MOST_WHEELBASE_DIFFERENCE * sister.wheelbase_m:
        raise NoSisterError(
            f"{vehicle.name}: wheelbase {vehicle.wheelbase_m:g} m, its sister's {sister.wheelbase_m:.4g} m: another "
            "model; give the calibration of a vehicle of its own model"
        )
    if abs(off_kg) > MOST_MASS_DIFFERENCE * sister.empty_mass_kg:
        raise NoSisterError(
            f"{vehicle.name}: sprung mass {vehicle.empty_mass_kg:g} kg, its sister's {sister.empty_mass_kg:.4g} kg: "
            "another body; give the calibration of a vehicle like it"
        )
