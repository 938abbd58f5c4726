"""The vehicle that follows from what a fitter typed."""

from pydantic import ValidationError

from gateway.calibration.axle_weights import AxleWeights, sprung_of
from gateway.calibration.campaign import VehicleTable
from gateway.errors import CampaignError
from gateway.stated import VehicleAnswers
from gateway.toml_file import describe_faults


def vehicle_table(said: VehicleAnswers, name: str) -> VehicleTable:
    """[vehicle] of a campaign; ``name`` where none was typed. Raises CampaignError in words for people."""
    if (said.empty_mass_kg is None) != (said.empty_front_share_pct is None):
        raise CampaignError("empty_mass_kg and empty_front_share_pct belong together: give both or neither")
    typed = said.model_dump(exclude_none=True, exclude={"division_kg"})
    weights = AxleWeights(
        said.kerb_front_axle_kg, said.kerb_rear_axle_kg, said.unsprung_front_kg, said.unsprung_rear_kg
    )
    try:
        sprung = sprung_of(weights, said.division_kg)
        return VehicleTable.model_validate(sprung.vehicle_keys() | typed | {"name": said.name.strip() or name})
    except ValidationError as fault:
        raise CampaignError(describe_faults("the vehicle that follows", fault)) from None
