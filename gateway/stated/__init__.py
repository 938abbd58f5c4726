"""What people state of a vehicle, as the web takes it and calibration uses it."""

from gateway.stated.vehicle import (
    DIVISION_KG,
    CarriesAnswer,
    Kilograms,
    Metres,
    MetresLeft,
    PayloadHeightM,
    PayloadLengthM,
    Percent,
    RoofRack,
    TowBar,
    VehicleAnswers,
)

__all__ = [
    "DIVISION_KG",
    "CarriesAnswer",
    "Kilograms",
    "Metres",
    "MetresLeft",
    "PayloadHeightM",
    "PayloadLengthM",
    "Percent",
    "RoofRack",
    "TowBar",
    "VehicleAnswers",
]
