"""What people state of a vehicle, as the web takes it and calibration uses it."""

from gateway.stated.vehicle import DIVISION_KG, VehicleAnswers

__all__ = ["DIVISION_KG", "VehicleAnswers"]
