"""What is read of the vehicles' records, and one vehicle as a line of the fleet's table. Other fields are ignored."""

from typing import Annotated, Any, Final

from pydantic import AwareDatetime, BaseModel, Field

RecordId = Annotated[str, Field(pattern=r"^[ -~]{1,200}$")]
Number = Annotated[int, Field(ge=0, lt=2**63)]


class Status(BaseModel):
    """A vehicle's birth message, or its will."""

    state: str = Field(examples=["online"])
    vin: str | None = None


class Weight(BaseModel):
    """A weight of an estimate."""

    kg: float | None = None
    limit_kg: float | None = None
    is_over_limit: bool | None = None


class Place(BaseModel):
    """The place of a record in the vehicle's stream: docs/uplink.md."""

    stream: RecordId
    number: Number
    previous: Number


class Estimate(BaseModel):
    """A batch, weighed or not."""

    id: RecordId
    t_end: AwareDatetime
    rejected: list[str]
    vin: str | None = None
    payload_kg: float | None = None
    payload_std_kg: float | None = None
    weights: dict[str, Weight | None] | None = None
    sequence: Place | None = None

    def columns(self) -> dict[str, Any]:
        """What the database finds it by."""
        place = self.sequence.model_dump() if self.sequence else {}
        return {"id": self.id, "t_end_s": self.t_end.timestamp(), "is_weighed": not self.rejected, **place}

    def used_share(self) -> float | None:
        """Payload of what can be carried up to the gross limit; None if unknown, or if it may carry nothing."""
        gross = (self.weights or {}).get("gross")
        if self.payload_kg is None or gross is None or gross.kg is None or gross.limit_kg is None:
            return None
        capacity_kg = self.payload_kg + gross.limit_kg - gross.kg
        return max(0.0, self.payload_kg / capacity_kg) if capacity_kg > 0.0 else None


class Entry(BaseModel):
    """A load event or a trip in one of its revisions."""

    id: RecordId
    revision: Annotated[int, Field(ge=0, lt=2**31)]


class Alarm(Entry):
    """An alarm in one of its revisions."""

    kind: str = Field(examples=["overload"])
    where: str = Field(examples=["rear_axle"])
    t_start: str
    is_active: bool


KINDS: Final[dict[str, type[Status | Estimate | Entry]]] = {
    "status": Status, "estimates": Estimate, "alarms": Alarm, "events": Entry, "trips": Entry
}  # fmt: skip
"""By the level of the topic below the vehicle's name."""


class Line(BaseModel):
    """A vehicle: what it last reported, its last batch that was weighed, and its active alarms. Unknown is null."""

    vehicle_id: str
    status: Status | None
    estimate: Estimate | None
    age_s: float | None = Field(description="of that batch, by the subscriber's clock")
    used_share: float | None = Field(
        description="payload of what can be carried up to the gross limit; above 1: over; null also if too heavy empty"
    )
    alarms: list[Alarm]


class Fleet(BaseModel):
    """Every vehicle that has ever sent a record, by name."""

    items: list[Line]
    n_unreadable: int = Field(description="records that could not be read; the table `unreadable` has them")
