"""What is read of the vehicles' records, and one vehicle as a line of the fleet's table."""

from collections.abc import Iterable
from typing import Annotated

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, StringConstraints

RecordId = Annotated[str, StringConstraints(pattern=r"^[ -~]{1,200}$")]
Revision = Annotated[int, Field(ge=0, lt=2**31)]
Number = Annotated[int, Field(ge=0, lt=2**63)]


class Told(BaseModel):
    """Part of a vehicle's record; fields that nobody needs here are ignored."""

    model_config = ConfigDict(allow_inf_nan=False)


class StatusRecord(Told):
    """A vehicle's birth message, or its will."""

    state: str
    vin: str | None = None


class WeightRecord(Told):
    """A weight of an estimate."""

    kg: float | None = None
    limit_kg: float | None = None
    is_over_limit: bool | None = None


class Sequence(Told):
    """The place of a record in the vehicle's stream: docs/uplink.md."""

    stream: RecordId
    number: Number
    previous: Number


class EstimateRecord(Told):
    """A batch, weighed or not."""

    id: RecordId
    t_end: AwareDatetime
    rejected: list[str]
    vin: str | None = None
    payload_kg: float | None = None
    payload_std_kg: float | None = None
    weights: dict[str, WeightRecord | None] | None = None
    sequence: Sequence | None = None


class EntryRecord(Told):
    """A load event or a trip in one of its revisions."""

    id: RecordId
    revision: Revision


class LineAlarm(Told):
    """An active alarm."""

    kind: str = Field(examples=["overload"])
    where: str = Field(examples=["rear_axle"])
    t_start: str


class AlarmRecord(EntryRecord, LineAlarm):
    """An alarm in one of its revisions."""

    is_active: bool


class Line(Told):
    """A vehicle by the last batch that was weighed. Unknown is null."""

    vehicle_id: str
    vin: str | None
    state: str | None = Field(description="online or offline, as it last reported", examples=["online"])
    t_end: AwareDatetime | None = Field(description="end of the last batch that was weighed, UTC")
    age_s: float | None = Field(description="of that batch, by the subscriber's clock")
    payload_kg: float | None
    payload_std_kg: float | None
    gross_kg: float | None
    gross_limit_kg: float | None
    used_share: float | None = Field(
        description="payload of what can be carried up to the gross limit; above 1: over; null also if too heavy empty"
    )
    over: list[str] = Field(description="places over their limit", examples=[["rear_axle"]])
    alarms: list[LineAlarm]


def line_of(
    vehicle_id: str,
    status: StatusRecord | None,
    estimate: EstimateRecord | None,
    alarms: Iterable[LineAlarm],
    now_s: float,
) -> Line:
    """A vehicle's line from its last status, the last estimate with an answer, and the active alarms.

    ``now_s`` is POSIX time.
    """
    weights = (estimate and estimate.weights) or {}
    gross = weights.get("gross") or WeightRecord()
    payload_kg = estimate.payload_kg if estimate else None
    return Line(
        vehicle_id=vehicle_id,
        vin=(status and status.vin) or (estimate.vin if estimate else None),
        state=status.state if status else None,
        t_end=estimate.t_end if estimate else None,
        age_s=max(0.0, now_s - estimate.t_end.timestamp()) if estimate else None,
        payload_kg=payload_kg,
        payload_std_kg=estimate.payload_std_kg if estimate else None,
        gross_kg=gross.kg,
        gross_limit_kg=gross.limit_kg,
        used_share=_used(payload_kg, gross.kg, gross.limit_kg),
        over=[place for place, weight in weights.items() if weight and weight.is_over_limit],
        alarms=list(alarms),
    )


def _used(payload_kg: float | None, gross_kg: float | None, limit_kg: float | None) -> float | None:
    """Used share of the capacity: p / (p + F_max - F). None if the vehicle may carry nothing."""
    if payload_kg is None or gross_kg is None or limit_kg is None:
        return None
    capacity_kg = payload_kg + limit_kg - gross_kg
    return max(0.0, payload_kg / capacity_kg) if capacity_kg > 0.0 else None
