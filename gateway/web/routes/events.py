"""/api/v1/events and /api/v1/trips: what was loaded where, and what was carried how far; as pages and as files."""

from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Query
from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import Response

from gateway.core.events import EntryKind
from gateway.core.events.table import COLUMNS, cells_of
from gateway.history import HistoryPage
from gateway.records import json_line
from gateway.store import StoreReader
from gateway.web.file_response import CSV, JSON_LINES, csv_lines, file_responses, json_lines, sent_as_file
from gateway.web.parquet import PARQUET, ParquetFile
from gateway.web.routes.estimates import HistoryQuery, TimeSpan, history_page
from gateway.web.schemas import problem_responses

_PAGE: Final = 100  # entries in memory at a time, for each file that is being sent
_PATHS: Final = {EntryKind.EVENT: "events", EntryKind.TRIP: "trips"}


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


class _EntriesPage(BaseModel):
    next_cursor: str | None
    last_cursor: str | None


class EventsPage(_EntriesPage):
    """Load events in the order in which their last revisions came."""

    items: list[LoadEvent]


class TripsPage(_EntriesPage):
    """Trips in the order in which their last revisions came."""

    items: list[Trip]


def events_router(reader: StoreReader) -> APIRouter:
    """The routes of load events and trips."""
    router = APIRouter(prefix="/api/v1", tags=["events"])

    @router.get("/events", response_model=EventsPage, responses=problem_responses(422, 503))
    async def events(query: Annotated[HistoryQuery, Query()]) -> Response:
        """Loading and unloading. A revised event comes again, behind all earlier ones: follow next_cursor."""
        return await _page(reader, EntryKind.EVENT, query)

    @router.get("/trips", response_model=TripsPage, responses=problem_responses(422, 503))
    async def trips(query: Annotated[HistoryQuery, Query()]) -> Response:
        """Every drive with its load and tonne-kilometres. A revised trip comes again: follow next_cursor."""
        return await _page(reader, EntryKind.TRIP, query)

    for kind, path in _PATHS.items():
        router.add_api_route(f"/{path}.csv", _file_of(reader, kind, "csv"), **_described("text/csv", path))
        router.add_api_route(f"/{path}.jsonl", _file_of(reader, kind, "jsonl"), **_described(JSON_LINES, path))
        described = _described(PARQUET, path)
        described["responses"] |= problem_responses(501)
        router.add_api_route(f"/{path}.parquet", _file_of(reader, kind, "parquet"), **described)
    return router


async def _page(reader: StoreReader, kind: EntryKind, query: HistoryQuery) -> Response:
    return Response("{" + await entries_of(reader, kind, query), media_type="application/json")


async def entries_of(reader: StoreReader, kind: str, query: HistoryQuery) -> str:
    """One page of entries as the rest of a JSON object. Raises RequestValidationError for an invalid cursor."""
    page = await history_page(
        reader,
        (kind,),
        since_ns=query.since,
        until_ns=query.until,
        limit=query.limit,
        cursor=query.cursor,
        newest_first=query.order == "newest_first",
    )
    tail = json_line({"next_cursor": page.next_cursor, "last_cursor": page.last_cursor})[1:]
    return f'"items":[{",".join(page.items)}],{tail}'


def _file_of(reader: StoreReader, kind: EntryKind, ending: str) -> Callable[..., Any]:
    async def whole(span: Annotated[TimeSpan, Query()]) -> Response:
        async def page_behind(cursor: str | None) -> HistoryPage:
            return await history_page(
                reader, (kind,), since_ns=span.since, until_ns=span.until, limit=_PAGE, cursor=cursor
            )

        name = f"springscale-{_PATHS[kind]}.{ending}"
        if ending == "parquet":
            file = ParquetFile(COLUMNS[kind], partial(cells_of, kind))
            return await sent_as_file(page_behind, file.page, PARQUET, name, file.end)
        is_csv = ending == "csv"
        encode = csv_lines(COLUMNS[kind], partial(cells_of, kind)) if is_csv else json_lines
        return await sent_as_file(page_behind, encode, CSV if is_csv else JSON_LINES, name)

    whole.__name__ = f"{_PATHS[kind]}_{ending}"
    whole.__doc__ = f"All {_PATHS[kind]} as one file, each in its last revision."
    return whole


def _described(media_type: str, what: str) -> dict[str, Any]:
    return {"methods": ["GET"], "response_class": Response, "responses": file_responses(media_type, f"the {what}")}
