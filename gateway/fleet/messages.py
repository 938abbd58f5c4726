"""The border of the fleet: what is read of the vehicles' records, and one vehicle as a line of the fleet's table.

Other fields are ignored. Every type is closed: integers of 64 bits, finite numbers, texts and lists of limited length.
"""

import json
import re
from typing import Annotated, Any, Final, NamedTuple

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from gateway.config import VEHICLE_ID

RecordId = Annotated[str, Field(pattern=r"^[ -~]{1,200}$")]
Number = Annotated[int, Field(ge=0, lt=2**63)]
Text = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]{0,200}$")]


class _Told(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False, frozen=True)


class Status(_Told):
    """A vehicle's birth message, or its will."""

    state: Text = Field(examples=["online"])
    vin: Text | None = None


class Weight(_Told):
    """A weight of an estimate."""

    kg: float | None = None
    limit_kg: float | None = None
    is_over_limit: bool | None = None


class Place(_Told):
    """The place of a record in the vehicle's stream: docs/uplink.md."""

    stream: RecordId
    number: Number
    previous: Number


class Estimate(_Told):
    """A batch, weighed or not."""

    id: RecordId
    t_end: AwareDatetime
    rejected: list[Text] = Field(max_length=100)
    vin: Text | None = None
    payload_kg: float | None = None
    payload_interval95_kg: tuple[float, float] | None = None
    weights: dict[Text, Weight | None] | None = Field(None, max_length=100)
    sequence: Place | None = None

    def columns(self) -> dict[str, Any]:
        """The columns by which the database finds the record."""
        place = self.sequence.model_dump() if self.sequence else {}
        return {"id": self.id, "t_end_s": self.t_end.timestamp(), "is_weighed": not self.rejected, **place}

    def used_share(self) -> float | None:
        """Payload of what can be carried up to the gross limit; None if unknown, or if it may carry nothing."""
        gross = (self.weights or {}).get("gross")
        if self.payload_kg is None or gross is None or gross.kg is None or gross.limit_kg is None:
            return None
        capacity_kg = self.payload_kg + gross.limit_kg - gross.kg
        return max(0.0, self.payload_kg / capacity_kg) if capacity_kg > 0.0 else None


class Entry(_Told):
    """A load event or a trip in one of its revisions."""

    id: RecordId
    revision: Annotated[int, Field(ge=0, lt=2**31)]


class Alarm(Entry):
    """An alarm in one of its revisions."""

    kind: Text = Field(examples=["overload"])
    where: Text = Field(examples=["rear_axle"])
    t_start: Text
    is_active: bool


KINDS: Final[dict[str, type[Status | Estimate | Entry]]] = {
    "status": Status, "estimates": Estimate, "alarms": Alarm, "events": Entry, "trips": Entry
}  # fmt: skip
"""By the level of the topic below the vehicle's name."""


class Arrival(NamedTuple):
    """A record that was read: its vehicle, its kind, and its JSON in ASCII, which no database refuses."""

    vehicle_id: str
    kind: str
    record: Status | Estimate | Entry
    text: str


def read(topic: str, payload: bytes) -> Arrival:
    """Read the record in a message. Malformed content raises exceptions of any kind.

    The vehicle's name is from the topic alone: the broker lets each vehicle write below its own.
    """
    _, vehicle_id, kind, *_ = topic.split("/")
    if not re.fullmatch(VEHICLE_ID, vehicle_id):
        raise ValueError("no name of a vehicle")
    text = json.dumps(json.loads(payload), allow_nan=False)
    return Arrival(vehicle_id, kind, KINDS[kind].model_validate_json(text), text)


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
