"""/api/v1/cab: everything that the cab page shows, in one small answer."""

import asyncio
import json
import math
from collections.abc import Callable
from enum import StrEnum
from typing import Final, Literal, get_args

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.core.alarms.rules import as_of_load
from gateway.core.events.entry import EntryKind
from gateway.core.weights.limits import Light, Room, nearness, rooms_of
from gateway.estimate import Estimate, Lack, Quantity
from gateway.reasons import EXPLANATIONS, Cause
from gateway.records import Why, iso_utc, rounded
from gateway.status import OwnReading, State, Status
from gateway.store import StoreReader
from gateway.web.live.board import Board
from gateway.web.routes.weights import Scales
from gateway.web.schemas import problem_responses

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
    alarms: tuple[str, ...] = Field(description="active alarms by name, the oldest first; see /api/v1/alarms")
    rejected: list[str] = Field(
        description="why the last whole batch was refused; empty: it was not, or there was none"
    )
    last_event: CabEvent | None
    own_readings: tuple[OwnReading, ...] = Field(description="of the vehicle's own load sensors, not weighed here")


_DOUBTING: Final = {Cause.SENSORS, Cause.ANSWER}  # roads and driving say nothing against an earlier weight
_EVENTS: Final = 20  # chosen: looked through; a corrected one comes again behind newer ones


def cab_router(board: Board, reader: StoreReader, status: Callable[[], Status], scales: Scales) -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["vehicle"])

    @router.get("/cab", responses=problem_responses(503))
    async def cab() -> Cab:
        """How much can still be loaded, whether it is too much, how old that is, and what was loaded last."""
        now, shown = status(), board.shown()
        load = None if shown.estimate is None else as_of_load(shown.estimate)
        weights = scales.weigh(load)
        near = nearness(weights)
        rejected = _rejected(board.heard(), shown.estimate)
        is_doubted = near.light is not Light.OVER and any(EXPLANATIONS[why].cause in _DOUBTING for why in rejected)
        return Cab(
            vehicle_id=now.vehicle_id,
            state=now.state,
            load=_known(load, now),
            stood_s=rounded(now.standing.stood_s, 1),
            t_end=None if load is None else iso_utc(load.t_end_ns),
            age_s=shown.age_s,
            is_stale=shown.is_stale,
            is_early=load is not None and load.is_provisional,
            light=Light.UNKNOWN if is_doubted else near.light,
            light_about=[] if is_doubted else list(near.places()),
            over_limit_probability=rounded(max(near.probabilities.values(), default=None), 4),
            room=[] if is_doubted else [_room(room) for room in rooms_of(weights)],
            is_doubted=is_doubted,
            has_limits=any(getattr(weights, place).limit_kg is not None for place in get_args(RoomPlace)),
            lacks=weights.gross.lacks,
            payload_kg=None if load is None else rounded(load.payload.number, 1),
            payload_interval95_kg=None if load is None else _interval(load.payload),
            alarms=now.alarms.active,
            rejected=[str(why) for why in rejected],
            last_event=await asyncio.to_thread(_last_event, reader),
            own_readings=now.own_readings,
        )

    return router


def _known(load: Estimate | None, now: Status) -> LoadKnown:
    if load is None:
        return LoadKnown.NEVER_WEIGHED
    if now.standing.stood_s is not None:
        return LoadKnown.STANDING
    return LoadKnown.WEIGHED if now.standing.is_load_weighed else LoadKnown.NOT_WEIGHED_YET


def _room(room: Room) -> RoomLeft:
    return RoomLeft(
        place=room.place,
        kg=round(room.left.number, 1),
        std_kg=rounded(room.left.std, 1),
        interval95_kg=_interval(room.left),
        limit_kg=room.limit_kg,
    )


def _rejected(heard: Estimate | None, shown: Estimate | None) -> tuple[Why, ...]:
    """Of the last whole batch, if none was weighed since. A provisional estimate does not replace a refused batch."""
    if heard is None:
        return ()
    is_weighed_since = shown is not None and not shown.is_provisional and shown.t_end_ns >= heard.t_end_ns
    return () if is_weighed_since else heard.rejected


def _last_event(reader: StoreReader) -> CabEvent | None:
    """The latest load event that is not withdrawn."""
    page = reader.page((EntryKind.EVENT,), limit=_EVENTS, newest_first=True)
    told = (one for one in reader.understood(page.items, _cab_event) if one is not None)
    return max(told, key=lambda one: one.t_end, default=None)


def _cab_event(text: str) -> CabEvent | None:
    """None for one that was withdrawn."""
    told = json.loads(text)
    return None if told["is_withdrawn"] else CabEvent(**told | {"payload_kg": told["after"]["payload_kg"]})


def _interval(quantity: Quantity) -> list[float] | None:
    """The fused estimate of a load has no interval of its own (Epoch): then that of its standard deviation."""
    has_own = math.isfinite(quantity.interval95[0])
    low, high = (quantity if has_own else Quantity.normal(quantity.number, quantity.std)).interval95
    return [round(low, 1), round(high, 1)] if math.isfinite(low) and math.isfinite(high) else None
