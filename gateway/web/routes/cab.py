"""/api/v1/cab: everything that the cab page shows, in one small answer."""

import asyncio
import json
import math
from collections.abc import Callable
from enum import StrEnum
from typing import Final, Literal, get_args

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.core.events.entry import EntryKind
from gateway.core.vehicle import Vehicle
from gateway.core.weights.limits import Room, rooms_of
from gateway.core.weights.room import Halves, room_of
from gateway.estimates.batch_estimate import Estimate, Lack, Quantity, Weights
from gateway.estimates.quantity import half_width
from gateway.records import iso_utc, rounded
from gateway.status import OwnReading, State, Status
from gateway.store import StoreReader
from gateway.web.live.board import Board
from gateway.web.routes.present_load import Scales, VerdictTold
from gateway.web.schemas import problem_responses

RoomPlace = Literal["gross", "front_axle", "rear_axle"]


class LoadKnown(StrEnum):
    """Whether the weighed load is still aboard."""

    WEIGHED = "weighed"
    STANDING = "standing"
    NOT_WEIGHED_YET = "not_weighed_yet"
    NEVER_WEIGHED = "never_weighed"


class HalvesTold(BaseModel):
    """A load in the front half of the loading area and one in its rear half."""

    front_half_kg: float = Field(examples=[65.0])
    rear_half_kg: float = Field(examples=[185.0])


class RoomTold(BaseModel):
    """The payload that may still go in so that neither gross weight nor an axle passes its limit, and its place."""

    kg: float = Field(description="best estimate; negative: too heavy", examples=[262.0])
    plus_minus_kg: float = Field(description="half its 95 % interval", examples=[12.0])
    safe: HalvesTold = Field(
        description="holds at the unfavourable ends of all intervals, wherever in its half each load lies"
    )
    is_anywhere: bool = Field(description="`safe` may lie anywhere in the loading area, all in one place")
    take_out: HalvesTold | None = Field(
        description="what must come out so that surely no limit is passed; null: unloading alone does not help"
    )


class SpareLeft(BaseModel):
    """The weight that one place may still bear before it reaches its limit; negative: it bears too much."""

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


class Cab(VerdictTold):
    """The present load, weighed by all its batches together. Unknown is null."""

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
    room: RoomTold | None = Field(description="null: no limit is known, or a weight is not known, doubted or vague")
    spare: list[SpareLeft] = Field(description="of each place with a limit, the tightest first; empty as `room`")
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


_EVENTS: Final = 20  # chosen: looked through; a corrected one comes again behind newer ones


def cab_router(board: Board, reader: StoreReader, status: Callable[[], Status], scales: Scales) -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["vehicle"])

    @router.get("/cab", responses=problem_responses(503))
    async def cab() -> Cab:
        """The payload that can still be loaded, the verdict on the load, its age, and the last load event."""
        now, shown = status(), board.shown()
        found = scales.present_load(board, now)
        load, weights = found.load, found.weights
        is_known = not (found.is_doubted or found.is_vague)
        return Cab(
            vehicle_id=now.vehicle_id,
            state=now.state,
            load=_known(load, now),
            stood_s=rounded(now.standing.stood_s, 1),
            t_end=None if load is None else iso_utc(load.t_end_ns),
            age_s=shown.age_s,
            is_stale=shown.is_stale,
            is_early=load is not None and load.is_provisional,
            **found.told().model_dump(),
            room=_room(weights, scales.vehicle) if is_known else None,
            spare=[_spare(room) for room in rooms_of(weights)] if is_known else [],
            is_doubted=found.is_doubted,
            has_limits=any(getattr(weights, place).limit_kg is not None for place in get_args(RoomPlace)),
            lacks=weights.gross.lacks,
            payload_kg=None if load is None else rounded(load.payload.number, 1),
            payload_interval95_kg=None if load is None else _interval(load.payload),
            alarms=now.alarms.active,
            rejected=[str(why) for why in found.rejected],
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


def _room(weights: Weights, vehicle: Vehicle | None) -> RoomTold | None:
    room = None if vehicle is None else room_of(weights, vehicle)
    if room is None:
        return None
    return RoomTold(
        kg=round(room.most.number, 1),
        plus_minus_kg=round(half_width(room.most.interval95), 1),
        safe=_halves(room.safe),
        is_anywhere=room.is_anywhere,
        take_out=None if room.take_out is None else _halves(room.take_out),
    )


def _halves(halves: Halves) -> HalvesTold:
    return HalvesTold(front_half_kg=round(halves.front_kg, 1), rear_half_kg=round(halves.rear_kg, 1))


def _spare(room: Room) -> SpareLeft:
    return SpareLeft(
        place=room.place,
        kg=round(room.left.number, 1),
        std_kg=rounded(room.left.std, 1),
        interval95_kg=_interval(room.left),
        limit_kg=room.limit_kg,
    )


def _last_event(reader: StoreReader) -> CabEvent | None:
    """The latest load event that is not withdrawn."""
    page = reader.page((EntryKind.EVENT,), limit=_EVENTS, newest_first=True)
    told = (one for one in reader.understood(page.items, _cab_event) if one is not None)
    return max(told, key=lambda one: one.t_end, default=None)


def _cab_event(text: str) -> CabEvent | None:
    """The load event for the cab; None for one that was withdrawn."""
    told = json.loads(text)
    return None if told["is_withdrawn"] else CabEvent(**told | {"payload_kg": told["after"]["payload_kg"]})


def _interval(quantity: Quantity) -> list[float] | None:
    """The fused estimate of a load has no interval of its own (Epoch): then that of its standard deviation."""
    has_own = math.isfinite(quantity.interval95[0])
    low, high = (quantity if has_own else Quantity.normal(quantity.number, quantity.std)).interval95
    return [round(low, 1), round(high, 1)] if math.isfinite(low) and math.isfinite(high) else None
