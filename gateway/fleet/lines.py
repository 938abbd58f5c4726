"""One vehicle of the fleet as a line of a table, independent of the database."""

from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class LineAlarm(BaseModel):
    """An alarm that stands."""

    kind: str = Field(examples=["overload"])
    where: str = Field(examples=["rear_axle"])
    t_start: str


class Line(BaseModel):
    """A vehicle by the last batch that was weighed. Unknown is null."""

    model_config = ConfigDict(allow_inf_nan=False)

    vehicle_id: str
    vin: str | None
    state: str | None = Field(description="online or offline, as it last reported", examples=["online"])
    t_end: str | None = Field(description="end of the last batch that was weighed, UTC")
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
    status: Mapping[str, Any] | None,
    estimate: Mapping[str, Any] | None,
    alarms: Iterable[Mapping[str, Any]],
    now_s: float,
) -> Line:
    """A vehicle's line from its last status, the last estimate with an answer, and alarms in their last revision.

    ``now_s`` is POSIX time. Raises ValueError or LookupError for a record of another program.
    """
    weighed = estimate or {}
    weights: Mapping[str, Mapping[str, Any]] = weighed.get("weights") or {}
    gross = weights.get("gross") or {}
    t_end = weighed.get("t_end")
    payload_kg, gross_kg, limit_kg = weighed.get("payload_kg"), gross.get("kg"), gross.get("limit_kg")
    return Line(
        vehicle_id=vehicle_id,
        vin=(status or {}).get("vin") or weighed.get("vin"),
        state=(status or {}).get("state"),
        t_end=t_end,
        age_s=None if t_end is None else max(0.0, now_s - datetime.fromisoformat(t_end).timestamp()),
        payload_kg=payload_kg,
        payload_std_kg=weighed.get("payload_std_kg"),
        gross_kg=gross_kg,
        gross_limit_kg=limit_kg,
        used_share=_used(payload_kg, gross_kg, limit_kg),
        over=[place for place, weight in weights.items() if weight and weight.get("is_over_limit")],
        alarms=[LineAlarm.model_validate(one) for one in alarms if one.get("is_active")],
    )


def _used(payload_kg: float | None, gross_kg: float | None, limit_kg: float | None) -> float | None:
    """Used share of the capacity: p / (p + F_max - F). None if the vehicle may carry nothing."""
    if payload_kg is None or gross_kg is None or limit_kg is None:
        return None
    capacity_kg = payload_kg + limit_kg - gross_kg
    return max(0.0, payload_kg / capacity_kg) if capacity_kg > 0.0 else None
