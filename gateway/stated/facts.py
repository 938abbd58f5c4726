"""What people state about a vehicle, and the base of all tables that a service keeps or tells."""

from dataclasses import dataclass, field
from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field

from gateway.core.vehicle import Kilograms, Percent, VehicleFields, WeightKg
from gateway.metadata import described

Instant = Annotated[str, Field(json_schema_extra={"format": "date-time"})]

DIVISION_KG: Final = 20.0  # of a weighbridge for trucks; a reading is rounded to it


class Part(BaseModel):
    """A table of a file or of an answer over HTTP: unchangeable, and an unknown key is an error."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        json_schema_serialization_defaults_required=True,  # every key is written
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleAnswers(VehicleFields):
    """The vehicle, empty, driver and tank as in service. Weights are what scales or the papers say of each axle."""

    name: str = field(
        default="",
        metadata=described("what you call it; empty: the vehicle's id", max_length=64, examples=["van 17"]),
    )
    kerb_front_axle_kg: WeightKg = field(
        metadata=described("under the front axle of the empty vehicle: scales or papers", examples=[690.0])
    )
    kerb_rear_axle_kg: WeightKg = field(metadata=described("the same at the rear", examples=[710.0]))
    division_kg: float = field(
        default=DIVISION_KG,
        metadata=described("the step of the scales, or how far the papers may be off", gt=0.0, le=1000.0),
    )
    empty_mass_kg: WeightKg | None = field(
        default=None,
        metadata=described("sprung mass, where somebody knows it better than the axle weights do"),
    )
    empty_front_share_pct: Percent | None = field(default=None, metadata=described("and its share on the front axle"))
    empty_front_share_std_pct: float | None = field(
        default=None, metadata=described("and how sure that is", gt=0.0, le=50.0)
    )
    payload_range_kg: tuple[Kilograms, Kilograms] | None = field(
        default=None, metadata=described("payloads it may carry", examples=[[0.0, 800.0]])
    )
    front_share_range_pct: tuple[Percent, Percent] | None = field(
        default=None, metadata=described("front shares it may have")
    )
