"""A weight as a request states it: gross, by axle, or a known payload and its position."""

import time
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from gateway.records import iso_utc
from gateway.stated_weight import Drive, StatedWeight
from gateway.web.schemas import Instant

_LAST_NS: Final = 9_223_372_036_000_000_000
Kilograms = Annotated[float, Field(ge=0.0, le=100_000.0, allow_inf_nan=False)]


class _When(BaseModel):
    """The time at which the weight was known, and the drive that carried it."""

    model_config = ConfigDict(extra="forbid")

    at: Instant | None = Field(None, description="time of the weighing [default: now]")
    drive: Drive | None = Field(
        None, description="the drive before or after `at` carried it [default: whichever was weighed, if only one was]"
    )

    std_kg: float | None = Field(
        None,
        gt=0.0,
        le=10_000.0,
        allow_inf_nan=False,
        description="standard deviation of each number that is stated [default: as usual for its kind]",
    )

    def at_text(self) -> str:
        """RFC 3339; a time beyond the range of time stamps is moved to its edge."""
        at_ns = time.time_ns() if self.at is None else self.at
        return iso_utc(min(max(at_ns, 0), _LAST_NS))

    def stated(self) -> StatedWeight:
        """The weight in the service's terms: the fields have the same names."""
        return StatedWeight(self.at_text(), **self.model_dump(exclude={"by", "at"}))


class GrossWeight(_When):
    """The whole vehicle on scales."""

    by: Literal["gross"]
    gross_kg: Kilograms = Field(examples=[1890.0])


class AxleWeights(_When):
    """Each axle on scales."""

    by: Literal["axles"]
    front_axle_kg: Kilograms = Field(examples=[850.0])
    rear_axle_kg: Kilograms = Field(examples=[1040.0])


class KnownPayload(_When):
    """The load aboard, from papers or from scales."""

    by: Literal["payload"]
    payload_kg: Kilograms = Field(examples=[270.0])
    position_m: float | None = Field(
        None, ge=-10.0, le=20.0, allow_inf_nan=False, description="its centre of gravity behind the front axle"
    )


Stated = Annotated[GrossWeight | AxleWeights | KnownPayload, Field(discriminator="by")]
