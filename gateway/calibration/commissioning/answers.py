"""The vehicle from the fitter's answers, and from the figures common to its line."""

from collections.abc import Mapping
from dataclasses import asdict
from types import MappingProxyType
from typing import Any, Final

from pydantic import TypeAdapter, ValidationError

from gateway.calibration.axle_weights import AxleWeights, sprung_of
from gateway.core.vehicle import Vehicle
from gateway.errors import CampaignError
from gateway.stated import VehicleAnswers
from gateway.toml_file import describe_faults

OF_THE_LINE: Final = (
    "track_width_m",
    "payload_range_kg",
    "front_share_range_pct",
    "gross_limit_kg",
    "front_axle_limit_kg",
    "rear_axle_limit_kg",
    "front_wheel_limit_kg",
    "rear_wheel_limit_kg",
)
"""Figures common to a line besides what a fit inherits: used unless others are stated."""

_VEHICLE: Final = TypeAdapter(Vehicle)

NO_LINE: Final[Mapping[str, Any]] = MappingProxyType({})


def vehicle_table(said: VehicleAnswers, name: str, of_the_line: Mapping[str, Any] = NO_LINE) -> Vehicle:
    """[vehicle] of a campaign; ``name`` if none was typed. Raises CampaignError in words for people."""
    if (said.empty_mass_kg is None) != (said.empty_front_share_pct is None):
        raise CampaignError("empty_mass_kg and empty_front_share_pct belong together: give both or neither")
    typed = {name: answer for name, answer in asdict(said).items() if answer is not None and name != "division_kg"}
    weights = AxleWeights(
        said.kerb_front_axle_kg, said.kerb_rear_axle_kg, said.unsprung_front_kg, said.unsprung_rear_kg
    )
    try:
        sprung = sprung_of(weights, said.division_kg)
        named = {"name": said.name.strip() or name}
        return _VEHICLE.validate_python(sprung.vehicle_keys() | dict(of_the_line) | typed | named)
    except ValidationError as fault:
        raise CampaignError(describe_faults("the vehicle that follows", fault, Vehicle)) from None
