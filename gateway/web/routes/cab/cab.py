"""/api/v1/cab: everything that the cab page shows, in one small answer."""

import asyncio
import json
import math
from collections.abc import Callable
from typing import Any, Final

from fastapi import APIRouter

from gateway.core.alarms.weighing import as_of_load
from gateway.core.events import EntryKind
from gateway.core.weights import Light, Room, nearness, rooms_of
from gateway.estimate import Estimate, Quantity, Weights
from gateway.reasons import EXPLANATIONS, Cause
from gateway.records import Why, iso_utc
from gateway.status import Status
from gateway.store import StoreReader
from gateway.web.live.board import Board
from gateway.web.routes.cab.shapes import Cab, CabEvent, LoadKnown, RoomLeft
from gateway.web.routes.weights import Scales
from gateway.web.schemas import problem_responses

_DOUBTING: Final = {Cause.SENSORS, Cause.ANSWER}  # roads and driving say nothing against an earlier weight
_EVENTS: Final = 20  # a corrected one comes again behind newer ones


def cab_router(board: Board, reader: StoreReader, status: Callable[[], Status], scales: Scales) -> APIRouter:
    """The route for the driver."""
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
            stood_s=_or_none(now.standing.stood_s, 1),
            t_end=None if load is None else iso_utc(load.t_end_ns),
            age_s=shown.age_s,
            is_stale=shown.is_stale,
            is_early=load is not None and load.is_provisional,
            light=Light.UNKNOWN if is_doubted else near.light,
            light_about=[] if is_doubted else list(near.places()),
            over_limit_probability=_or_none(max(near.probabilities.values(), default=None), 4),
            room=[] if is_doubted else [_room(room) for room in rooms_of(weights)],
            is_doubted=is_doubted,
            has_limits=_has_limits(weights),
            lacks=weights.gross.lacks,
            payload_kg=None if load is None else _or_none(load.payload.number, 1),
            payload_interval95_kg=None if load is None else _interval(load.payload),
            alarms=now.alarms.standing,
            rejected=[str(why) for why in rejected],
            last_event=_newest(await asyncio.to_thread(_events, reader)),
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
        std_kg=_or_none(room.left.std, 1),
        interval95_kg=_interval(room.left),
        limit_kg=room.limit_kg,
    )


def _has_limits(weights: Weights) -> bool:
    return any(one.limit_kg is not None for one in (weights.gross, weights.front_axle, weights.rear_axle))


def _rejected(heard: Estimate | None, shown: Estimate | None) -> tuple[Why, ...]:
    """Of the last whole batch, if none was weighed since. A provisional estimate does not replace a refused batch."""
    if heard is None:
        return ()
    is_weighed_since = shown is not None and not shown.is_provisional and shown.t_end_ns >= heard.t_end_ns
    return () if is_weighed_since else heard.rejected


def _events(reader: StoreReader) -> tuple[str, ...]:
    return tuple(reader.page((EntryKind.EVENT,), limit=_EVENTS, newest_first=True).items)


def _newest(texts: tuple[str, ...]) -> CabEvent | None:
    """The latest of the active ones."""
    told: list[dict[str, Any]] = [json.loads(text) for text in texts]
    standing = [one for one in told if not one["is_withdrawn"]]
    if not standing:
        return None
    last = max(standing, key=lambda one: str(one["t_end"]))
    return CabEvent(**last | {"payload_kg": last["after"]["payload_kg"]})


def _interval(quantity: Quantity) -> list[float] | None:
    low, high = quantity.interval95 if math.isfinite(quantity.interval95[0]) else _of_std(quantity)
    return [round(low, 1), round(high, 1)] if math.isfinite(low) and math.isfinite(high) else None


def _of_std(quantity: Quantity) -> tuple[float, float]:
    """The fused estimate of a load has no interval of its own (Epoch)."""
    return Quantity.normal(quantity.number, quantity.std).interval95


def _or_none(x: float | None, digits: int) -> float | None:
    return None if x is None or not math.isfinite(x) else round(x, digits)
