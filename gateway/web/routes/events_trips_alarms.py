"""Load events, trips and alarms: records that are revised. Pages of them, and files of the first two.

A changed record comes again, with a higher revision, behind all earlier ones.
"""

import asyncio
from collections.abc import Callable
from functools import partial
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Query
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import Response

from gateway.core.events.entry import COLUMNS, EntryKind, cells_of
from gateway.stated.facts import Instant
from gateway.store import StoreReader
from gateway.store.journal import ALARM
from gateway.web.routes.history import FILE, JSON, CsvFile, HistoryQuery, TimeSpan, history_page, rest_of_page
from gateway.web.routes.service_calls import AsShown, Shown
from gateway.web.schemas import Page, problem_responses

ENTRIES_AT_A_TIME: Final = 100  # chosen: in memory for each file that is being sent


class Place(BaseModel):
    """WGS 84, rounded as the settings say."""

    latitude_deg: float
    longitude_deg: float


class Stop(BaseModel):
    """A standstill at which the load can have changed; null: unknown."""

    t_start: str
    t_end: str
    door_opened: bool | None
    ignition_off: bool | None
    place: Place | None


class CarriedLoad(BaseModel):
    """The load, by all batches of it."""

    payload_kg: float
    payload_std_kg: float
    payload_interval95_kg: list[float]
    front_share_pct: float
    front_share_std_pct: float
    cg_left_m: float | None
    cg_left_std_m: float | None
    n_batches: int


class LoadEvent(BaseModel):
    """The load changed, from t_start to t_end; a higher revision of the same id corrects it."""

    id: str
    revision: int
    vehicle_id: str | None
    t_start: str
    t_end: str
    change_kg: float = Field(description="positive: loaded")
    change_std_kg: float
    change_interval95_kg: list[float]
    probability: float = Field(description="that the load changed at all, 0 to 1")
    is_withdrawn: bool = Field(description="true: later batches say that nothing changed")
    place: Place | None
    stops: list[Stop]
    before: CarriedLoad
    after: CarriedLoad


class Trip(BaseModel):
    """One drive; unknown is null."""

    model_config = ConfigDict(populate_by_name=True)

    id: str
    revision: int
    vehicle_id: str | None
    t_start: str
    t_end: str
    is_over: bool
    from_: Place | None = Field(alias="from")
    to: Place | None
    distance_m: float
    distance_by: Literal["odometer", "speed"]
    unknown_s: float
    moving_s: float
    mean_speed_mps: float | None
    payload_kg: float | None
    payload_std_kg: float | None
    payload_interval95_kg: list[float] | None
    carried_tkm: float | None
    carried_std_tkm: float | None
    carried_interval95_tkm: list[float] | None
    weighed_share: float | None
    empty_share: float | None
    overloaded_share: float | None
    n_weighed: int


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
    interval95_kg: tuple[float, float] | None = Field(examples=[[2533.5, 2589.1]])
    limit_kg: float | None = Field(examples=[2500.0])
    detail: str | None = Field(description="which sensors are silent, or why batches are refused")


class AlarmsPage(Page[Alarm]):
    """The active alarms, the oldest first, and a piece of the history in the order of last revisions."""

    active: list[Alarm]


def events_router(reader: StoreReader) -> APIRouter:
    """Load events and trips, as pages and as files."""
    router = APIRouter(prefix="/api/v1", tags=["events"])

    async def page(kind: EntryKind, query: HistoryQuery, shown: Shown) -> Response:
        found = await history_page(reader, (kind,), query, query.limit, query.cursor, shown)
        return Response("{" + rest_of_page(found), media_type=JSON)

    async def file(kind: EntryKind, name: str, span: TimeSpan, shown: Shown) -> Response:
        table = CsvFile(f"springscale-{name}", COLUMNS[kind], partial(cells_of, kind), ENTRIES_AT_A_TIME)
        return await table.sent(reader, (kind,), span, shown)

    @router.get("/events", response_model=Page[LoadEvent], responses=problem_responses(422, 503))
    async def events(query: Annotated[HistoryQuery, Query()], shown: AsShown) -> Response:
        """Loading and unloading. A revised event comes again, behind all earlier ones: follow next_cursor."""
        return await page(EntryKind.EVENT, query, shown)

    @router.get("/trips", response_model=Page[Trip], responses=problem_responses(422, 503))
    async def trips(query: Annotated[HistoryQuery, Query()], shown: AsShown) -> Response:
        """Every drive with its load and tonne-kilometres. A revised trip comes again: follow next_cursor."""
        return await page(EntryKind.TRIP, query, shown)

    @router.get("/events.csv", response_class=Response, responses=FILE)
    async def events_csv(span: Annotated[TimeSpan, Query()], shown: AsShown) -> Response:
        """All events as one file, each in its last revision."""
        return await file(EntryKind.EVENT, "events", span, shown)

    @router.get("/trips.csv", response_class=Response, responses=FILE)
    async def trips_csv(span: Annotated[TimeSpan, Query()], shown: AsShown) -> Response:
        """All trips as one file, each in its last revision."""
        return await file(EntryKind.TRIP, "trips", span, shown)

    return router


def alarms_router(reader: StoreReader, standing: Callable[[], str]) -> APIRouter:
    """Alarms; ``standing`` gives the JSON of those that are active."""
    router = APIRouter(prefix="/api/v1", tags=["alarms"])

    @router.get("/alarms", response_model=AlarmsPage, responses=problem_responses(422, 503))
    async def alarms(query: Annotated[HistoryQuery, Query()], shown: AsShown) -> Response:
        """Active and past alarms. A changed alarm comes again, behind all earlier ones: follow next_cursor."""
        page = await history_page(reader, (ALARM,), query, query.limit, query.cursor, shown)
        active = await asyncio.to_thread(standing)
        return Response(f'{{"active":{active},{rest_of_page(page)}', media_type=JSON)

    return router
