"""What people state: a fitter about a vehicle, a person about a weighed load, and the known weights and verifications
that follow.
"""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from gateway.core.known_weights import KnownWeightKind
from gateway.core.vehicle import Kilograms, Percent, VehicleFields, WeightKg
from gateway.schema import described

Finite = Annotated[float, Field(allow_inf_nan=False)]
Instant = Annotated[str, Field(json_schema_extra={"format": "date-time"})]

MOST_LOADS: Final = 10  # chosen: of one verification
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


class Drive(StrEnum):
    """Which drive carried the weight, seen from the time at which it was weighed."""

    BEFORE = "before"
    AFTER = "after"


@dataclass(frozen=True, slots=True)
class StatedWeight:
    """A stated load: the gross weight, or both axle weights, or the payload and, unless it is zero, its position.

    ``at`` is RFC 3339. ``position_m`` is behind the front axle. ``drive`` None: the drive follows from the time.
    ``std_kg`` is the standard deviation of each number; None: the usual one of its kind.
    """

    at: str
    gross_kg: float | None = None
    front_axle_kg: float | None = None
    rear_axle_kg: float | None = None
    payload_kg: float | None = None
    position_m: float | None = None
    drive: Drive | None = None
    std_kg: float | None = field(
        default=None, metadata=described("standard deviation of each number; null: as usual for its kind")
    )


class Ending(Part):
    """When, by whom and why a known weight was taken back."""

    at: Instant
    by: str
    why: Literal["withdrawn", "back_to_factory"] = "withdrawn"


class Confirmation(Part):
    """Who confirmed a known weight that its estimate contradicted, and when."""

    at: Instant
    by: str


class KnownWeightFields(Part):
    """One known weight as its file keeps it and the web shows it: what was stated, the load that it belongs to, and the
    estimate of that load without it.
    """

    id: str = Field(examples=["sha256:9f86d081"])
    kind: KnownWeightKind
    at: Instant = Field(description="when it was stated")
    by: str = Field(description="name of the token; `local` where none are in use", examples=["workshop"])
    note: str | None = None
    vehicle_id: str | None = None
    calibration_id: str = Field(description="it belongs to this calibration")
    estimator: str
    t_start: str = Field(description="of the load's first batch")
    t_end: str = Field(description="of its last batch")
    batch_ids: tuple[str, ...] = Field(min_length=1, description="the newest of the batches it rests on, newest last")
    n_batches: int = Field(ge=1)
    stated: StatedWeight | None = Field(None, description="what the scale or the note said; null: it was empty")
    payload_kg: Finite = Field(examples=[270.0])
    payload_std_kg: Finite = Field(gt=0.0, description="of the scale or the paper", examples=[5.0])
    front_share_pct: Finite | None = Field(None, description="null: nobody stated where the load lies")
    front_share_std_pct: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
    estimated_payload_kg: Finite = Field(
        description="by the calibration and the known weights before this one", examples=[276.0]
    )
    estimated_payload_std_kg: Finite = Field(gt=0.0)
    is_contradicted: bool = Field(description="that estimate speaks against it by more than three standard deviations")
    confirmed: Confirmation | None = None
    ended: Ending | None = None


class Rule(Part):
    """The requirements ([verification] in the settings)."""

    permitted_error_pct: float = Field(description="of the known gross weight")
    permitted_axle_error_pct: float | None = Field(description="of each axle's known weight; null: not judged")
    loads: int


class AxleErrorTold(Part):
    """Weighed less known."""

    known_kg: Finite
    error_kg: Finite
    error_pct: Finite


class LoadTold(Part):
    """One load: stated, weighed, and the errors."""

    stated: StatedWeight
    t_start: str
    t_end: str
    n_batches: int
    batch_ids: tuple[str, ...]
    known_payload_kg: Finite
    known_reference_kg: Finite = Field(description="gross; without unsprung masses the sprung mass alone")
    payload_kg: Finite
    payload_std_kg: Finite
    error_kg: Finite
    error_pct: Finite = Field(description="of known_reference_kg")
    front_axle: AxleErrorTold | None
    rear_axle: AxleErrorTold | None
    is_within: bool


class VerificationRecord(Part):
    """A dated record; it is never changed."""

    id: str = Field(examples=["sha256:9f86d081"])
    at: Instant
    by: str = Field(description="name of the token; `local` if none are in use")
    note: str | None
    vehicle_id: str | None
    calibration_id: str
    estimator: str
    known_weights_id: str | None = Field(description="known weights that the estimate used; null: none")
    rule: Rule
    loads: tuple[LoadTold, ...] = Field(min_length=1, max_length=MOST_LOADS)
    verdict: Literal["passed", "failed"]
