"""A known weight as its file keeps it and the web shows it: each field once, with its words."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from gateway.core.known_weights import KnownWeightKind
from gateway.stated_weight import StatedWeight

Finite = Annotated[float, Field(allow_inf_nan=False)]
Instant = Annotated[str, Field(json_schema_extra={"format": "date-time"})]


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", json_schema_serialization_defaults_required=True)


class Ending(_Record):
    """When, by whom and why a known weight was taken back."""

    at: Instant
    by: str
    why: Literal["withdrawn", "back_to_factory"] = "withdrawn"


class Confirmation(_Record):
    """Who confirmed a known weight that its estimate contradicted, and when."""

    at: Instant
    by: str


class KnownWeightFields(_Record):
    """One known weight: what was stated, the load it is of, and what was estimated of that load without it."""

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
