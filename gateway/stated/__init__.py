"""What people state of a vehicle and of a load, as the web takes and shows it and calibration uses it."""

from gateway.stated.known_weight import Confirmation, Ending, KnownWeightFields
from gateway.stated.vehicle import DIVISION_KG, VehicleAnswers

__all__ = ["DIVISION_KG", "Confirmation", "Ending", "KnownWeightFields", "VehicleAnswers"]
