"""The shapes of /api/v1/cab."""

from enum import StrEnum
from typing import Literal

from pydantic import BaseModel, Field

from gateway.core.weights import Light
from gateway.estimate import Lack
from gateway.status import OwnReading, State

RoomPlace = Literal["gross", "front_axle", "rear_axle"]


class LoadKnown(StrEnum):
    """Whether the weighed load is still aboard."""

    WEIGHED = "weighed"
    STANDING = "standing"
    NOT_WEIGHED_YET = "not_weighed_yet"
    NEVER_WEIGHED = "never_weighed"


class RoomLeft(BaseModel):
    """The load that can still go aboard before one place reaches its limit, all of it resting there; negative: too
    heavy.
    """

    place: RoomPlace
    kg: float = Field(examples=[288.7])
    std_kg: float | None = Field(examples=[6.1])
    interval95_kg: list[float] | None = Field(examples=[[276.7, 300.7]])
    limit_kg: float = Field(examples=[2000.0])


class CabEvent(BaseModel):
    """The last load event: see /api/v1/events."""

    id: str
    t_start: str
    t_end: str
    change_kg: float = Field(description="positive: loaded")
    change_interval95_kg: list[float]
    probability: float = Field(description="that the load changed at all, 0 to 1")
    payload_kg: float = Field(description="aboard after it")


class Cab(BaseModel):
    """By all batches of the present load together. Unknown is null."""

    vehicle_id: str | None
    state: State
    load: LoadKnown = Field(
        description="weighed: by the drive since the last stop; standing: what is loaded now is not measured; "
        "not_weighed_yet: it has driven on since a stop, and the numbers are of before that stop"
    )
    stood_s: float | None = Field(description="standstill so far; null: it drives")
    t_end: str | None = Field(description="end of the last batch in it, UTC")
    age_s: float | None
    is_stale: bool
    is_early: bool = Field(description="true: an early look, not a whole batch yet")
    light: Light = Field(
        description="near: a limit lies within the 95 % interval; over: too much is more probable than not; unknown: "
        "no limit or no weight is known, or it is doubted"
    )
    light_about: list[str] = Field(description="places the light is about, the worst first", examples=[["rear_axle"]])
    over_limit_probability: float | None = Field(description="of the worst place, 0 to 1", examples=[0.02])
    room: list[RoomLeft] = Field(description="the tightest first; empty: unknown, as the light is")
    is_doubted: bool = Field(
        description="the last whole batch was refused because of the sensors or the answer, so the earlier weight may "
        "no longer be valid; never if that was too heavy"
    )
    has_limits: bool = Field(description="whether a gross or an axle limit is known at all")
    lacks: Lack | None = Field(description="facts that are missing for the gross weight")
    payload_kg: float | None
    payload_interval95_kg: list[float] | None
    alarms: dict[str, str] = Field(description="active alarms, by name: early or final; see /api/v1/alarms")
    rejected: list[str] = Field(
        description="why the last whole batch was refused; empty: it was not, or there was none"
    )
    last_event: CabEvent | None
    own_readings: tuple[OwnReading, ...] = Field(description="of the vehicle's own load sensors, not weighed here")
