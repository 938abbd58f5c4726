"""/api/v1/alarms: active and past alarms, since when, and who acknowledged them."""

import asyncio
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Path, Query
from pydantic import BaseModel, Field
from starlette.responses import Response

from gateway.history import ALARM
from gateway.stated.facts import Instant
from gateway.store import StoreReader
from gateway.web.routes.history import HistoryQuery, entries_of
from gateway.web.routes.service_calls import AlarmBackend, By, answered
from gateway.web.schemas import Body, problem_responses


class AlarmStep(BaseModel):
    """When an alarm reached a state, and the cause; null is unknown, or not applicable."""

    state: Literal["early", "final", "cleared"]
    t: Instant
    probability: float | None = Field(description="that the limit is passed, 0 to 1", examples=[0.971])
    found: float | None = Field(examples=[2561.3])
    std: float | None = Field(examples=[14.2])
    limit: float | None = Field(examples=[2500.0])
    unit: str | None = Field(examples=["kg"])
    detail: str | None


class AlarmSeen(BaseModel):
    """Who has seen it."""

    by: str = Field(description="name of the token; `local` if none are in use", examples=["yard"])
    at: Instant
    note: str | None


class Alarm(BaseModel):
    """One alarm in its last revision."""

    id: str = Field(examples=["alarm-1790000300000000000-9f86d081884c"])
    revision: int = Field(description="rises with each step and with the acknowledgement")
    vehicle_id: str | None
    kind: Literal["overload", "imbalance", "sensor_fault", "drift", "no_estimate"]
    where: str | None = Field(description="on the vehicle, or the part concerned", examples=["rear_axle"])
    state: Literal["early", "final", "cleared"]
    is_active: bool
    t_start: Instant
    t_end: str | None = Field(description="null: it stands")
    sentence: str = Field(examples=["The vehicle weighs 2561 +- 28 kg, limit 2500 kg (confirmed)"])
    steps: list[AlarmStep] = Field(description="its steps, oldest first")
    acknowledged: AlarmSeen | None


class AlarmsPage(BaseModel):
    """The active alarms, the worst first, and a piece of the history in the order of last revisions."""

    active: list[Alarm]
    items: list[Alarm]
    next_cursor: str | None
    last_cursor: str | None


class Acknowledgement(Body):
    """A word to it."""

    note: str = Field("", max_length=200, description="kept with the alarm; optional")


AlarmId = Annotated[str, Path(max_length=100, examples=["alarm-1790000300000000000-9f86d081884c"])]
_REFUSALS: Final = problem_responses(400, 404, 409, 422, 503)


def alarms_router(reader: StoreReader, backend: AlarmBackend) -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["alarms"])

    @router.get("/alarms", response_model=AlarmsPage, responses=problem_responses(422, 503))
    async def alarms(query: Annotated[HistoryQuery, Query()]) -> Response:
        """Active and past alarms. A changed alarm comes again, behind all earlier ones: follow next_cursor."""
        history = await entries_of(reader, ALARM, query)
        standing = await asyncio.to_thread(backend.standing)
        return Response(f'{{"active":{standing},{history}', media_type="application/json")

    @router.post("/alarms/{alarm_id}/acknowledgement", response_model=Alarm, responses=_REFUSALS)
    async def acknowledge(by: By, alarm_id: AlarmId, said: Acknowledgement) -> Response:
        """Acknowledge an alarm: the service keeps your token's name and the time, and sends them to everybody who gets
        the alarm.
        """
        return await answered(backend.acknowledge, alarm_id, by, said.note or None)

    return router
