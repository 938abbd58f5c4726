"""What a fitter types of a vehicle: axle weights and a few lengths."""

from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field

from gateway.core.cargo import Carries

# Bounds that no road vehicle reaches, so that a fraction for percent, millimetres or tonnes are named at once
Percent = Annotated[float, Field(ge=1.0, le=99.0)]
Kilograms = Annotated[float, Field(ge=0.0, le=100_000.0)]
WeightKg = Annotated[float, Field(gt=0.0, le=100_000.0)]
Metres = Annotated[float, Field(ge=-10.0, le=30.0)]
MetresLeft = Annotated[float, Field(ge=-2.0, le=2.0)]

# What a fitter says of the loads: their pitch inertia moves the answer as much as their mass does
CarriesAnswer = Annotated[
    Carries | None,
    Field(
        description="what it usually carries: `pallets`, `parcels` (all over the floor), `long_goods`, `tools` (in "
        "racks) or `mixed`; absent: anything, often as compact as the known loads, with intervals that allow for it",
        examples=["parcels"],
    ),
]
PayloadLengthM = Annotated[
    Annotated[float, Field(ge=0.1, le=20.0)] | None,
    Field(
        description="how far along the floor it usually reaches, where you know that better than `carries` says: 1.2 "
        "for a pallet, the floor's length for parcels",
        examples=[2.4],
    ),
]
PayloadHeightM = Annotated[
    Annotated[float, Field(ge=0.05, le=5.0)] | None,
    Field(description="how high above the floor it usually reaches", examples=[1.2]),
]
RoofRack = Annotated[bool, Field(description="part of the load may lie on the roof")]
TowBar = Annotated[bool, Field(description="part of the load may hang on a tow bar: a carrier, a trailer's tongue")]

DIVISION_KG: Final = 20.0  # of a weighbridge for trucks; a reading is rounded to it


class VehicleAnswers(BaseModel):
    """The vehicle, empty, driver and tank as in service. Weights are what scales or the papers say of each axle."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str = Field("", max_length=64, description="what you call it; empty: the vehicle's id", examples=["van 17"])
    kerb_front_axle_kg: WeightKg = Field(
        description="under the front axle of the empty vehicle: scales or papers", examples=[690.0]
    )
    kerb_rear_axle_kg: WeightKg = Field(description="the same at the rear", examples=[710.0])
    wheelbase_m: float = Field(ge=0.8, le=20.0, description="from axle to axle", examples=[2.75])
    sensor_position_m: Metres = Field(
        description="of the sensor, behind the front axle; negative: ahead of it", examples=[1.2]
    )
    division_kg: float = Field(
        DIVISION_KG, gt=0.0, le=1000.0, description="the step of the scales, or how far the papers may be off"
    )
    sensor_position_std_m: float = Field(0.1, gt=0.0, le=10.0, description="how sure that place is")
    sensor_offset_left_m: MetresLeft | None = Field(
        None, description="of the sensor, left of the centre line; negative: right of it; absent: not known"
    )
    sensor_offset_left_std_m: float | None = Field(None, gt=0.0, le=2.0, description="how sure that is")
    track_width_m: float | None = Field(
        None, ge=0.5, le=4.0, description="between the middles of left and right tyres; a roll rate needs it"
    )
    empty_cg_left_m: MetresLeft = Field(0.0, description="centre of gravity of the empty vehicle left of that line")
    unsprung_front_kg: WeightKg | None = Field(None, description="axle, wheels and brakes; absent: estimated")
    unsprung_rear_kg: WeightKg | None = Field(None, description="the same at the rear")
    empty_mass_kg: WeightKg | None = Field(
        None, description="sprung mass, where somebody knows it better than the axle weights do"
    )
    empty_front_share_pct: Percent | None = Field(None, description="and its share on the front axle")
    empty_front_share_std_pct: float | None = Field(None, gt=0.0, le=50.0, description="and how sure that is")
    payload_range_kg: tuple[Kilograms, Kilograms] | None = Field(
        None, description="payloads it may carry", examples=[[0.0, 800.0]]
    )
    front_share_range_pct: tuple[Percent, Percent] | None = Field(None, description="front shares it may have")
    carries: CarriesAnswer = None
    payload_length_m: PayloadLengthM = None
    payload_height_m: PayloadHeightM = None
    roof_rack: RoofRack = False
    tow_bar: TowBar = False
    front_axle_limit_kg: WeightKg | None = Field(None, description="permitted load of the front axle")
    rear_axle_limit_kg: WeightKg | None = Field(None, description="permitted load of the rear axle")
    gross_limit_kg: WeightKg | None = Field(None, description="permitted gross weight")
    front_wheel_limit_kg: WeightKg | None = Field(None, description="permitted load of each front wheel")
    rear_wheel_limit_kg: WeightKg | None = Field(None, description="the same at the rear")
