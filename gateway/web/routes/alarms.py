"""/api/v1/alarms: active and past alarms, and since when."""

import asyncio
from collections.abc import Callable
from typing import Annotated, Literal

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field
from starlette.responses import Response

from gateway.stated.facts import Instant
from gateway.store import StoreReader
from gateway.store.journal import ALARM
from gateway.web.routes.history import HistoryQuery, entries_of
from gateway.web.schemas import problem_responses


class Alarm(BaseModel):
    """One alarm in its last revision. Numbers are what raised it; null is unknown, or not applicable."""

    id: str = Field(examples=["alarm-1790000300000000000-9f86d081884c"])
    revision: int = Field(description="1: it was raised; 2: it ended")
    vehicle_id: str | None
    kind: Literal["overload", "sensor_fault"]
    where: str = Field(description="on the vehicle, or `silent` or `refused`", examples=["rear_axle"])
    is_active: bool
    t_start: Instant
    t_end: str | None = Field(description="null: it is active")
    sentence: str = Field(examples=["The vehicle weighs 2561 +- 28 kg, limit 2500 kg"])
    probability: float | None = Field(description="that the limit is passed, 0 to 1", examples=[0.971])
    found_kg: float | None = Field(examples=[2561.3])
    std_kg: float | None = Field(examples=[14.2])
    limit_kg: float | None = Field(examples=[2500.0])
    detail: str | None = Field(description="which sensors are silent, or why batches are refused")


class AlarmsPage(BaseModel):
    """The active alarms, the oldest first, and a piece of the history in the order of last revisions."""

    active: list[Alarm]
    items: list[Alarm]
    next_cursor: str | None
    last_cursor: str | None


def alarms_router(reader: StoreReader, standing: Callable[[], str]) -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["alarms"])

    @router.get("/alarms", response_model=AlarmsPage, responses=problem_responses(422, 503))
    async def alarms(query: Annotated[HistoryQuery, Query()]) -> Response:
        """Active and past alarms. A changed alarm comes again, behind all earlier ones: follow next_cursor."""
        history = await entries_of(reader, ALARM, query)
        active = await asyncio.to_thread(standing)
        return Response(f'{{"active":{active},{history}', media_type="application/json")

    return router
