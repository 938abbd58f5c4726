"""/api/v1: the latest estimate, the status, the stream, and the history as pages and as files."""

import asyncio
import json
import re
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import replace
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Header, HTTPException, Query, Request
from fastapi.exceptions import RequestValidationError
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic.json_schema import SkipJsonSchema
from starlette.responses import Response, StreamingResponse

from gateway.core.events import entry as table
from gateway.core.events.entry import EntryKind
from gateway.estimates.as_json import COLUMNS, csv_cells
from gateway.records import json_line
from gateway.status import Status
from gateway.store import StoreReader
from gateway.store.journal import BATCHES, HistoryPage
from gateway.web.file_response import FORMATS, file_responses, sent_as_file
from gateway.web.live.board import Board, LatestResponse
from gateway.web.live.stream import EVENT_SCHEMA, TooManyStreamsError
from gateway.web.routes.service_calls import AsShown, Shown
from gateway.web.schemas import EstimatesPage, Instant, Latest, problem_responses

JSON: Final = "application/json"
PAGE_LIMIT: Final = 1000  # chosen: records in one answer; part of the described API, therefore no setting
BATCHES_AT_A_TIME: Final = 10  # chosen: in memory for each answer that is being sent: with spectra they are large
ENTRIES_AT_A_TIME: Final = 100  # chosen: likewise of load events and trips, which are small
_CURSOR: Final = r"^[0-9a-z]{1,32}-[0-9]{1,18}$"


def _as_it_was_given(text: str) -> str:
    if re.fullmatch(_CURSOR, text, re.ASCII) is None:
        raise ValueError("send a next_cursor or last_cursor of an earlier answer, or an id of the stream, unchanged")
    return text


Cursor = Annotated[
    str,
    AfterValidator(_as_it_was_given),
    Field(json_schema_extra={"pattern": _CURSOR}, examples=["3f2a9c1e-1048577"]),
]


class TimeSpan(BaseModel):
    """Which part of the history."""

    model_config = ConfigDict(extra="forbid")

    since: Instant | SkipJsonSchema[None] = Field(None, description="those that end at or after this")
    until: Instant | SkipJsonSchema[None] = Field(None, description="those that end before this")

    def question(self) -> dict[str, Any]:
        """The arguments of ``StoreReader.page``, without the place in the history."""
        return {"since_ns": self.since, "until_ns": self.until}


class SpanWithSpectra(TimeSpan):
    """Which part of the history, and whether with spectra."""

    spectra: bool = Field(False, description="true sends the spectra too")


class HistoryQuery(TimeSpan):
    """Which part of the history, how much of it, and in which order."""

    limit: int = Field(100, ge=1, le=PAGE_LIMIT)
    cursor: Cursor | SkipJsonSchema[None] = Field(None, description="next_cursor or last_cursor of an earlier answer")
    order: Literal["oldest_first", "newest_first"] = Field(
        "oldest_first", description="oldest_first to follow new records, newest_first for the last ones"
    )

    def question(self) -> dict[str, Any]:
        return super().question() | {"newest_first": self.order == "newest_first"}


class EstimatesQuery(HistoryQuery):
    """Which part of the history, and whether with spectra."""

    spectra: bool = Field(True, description="false leaves the spectra out")

    def question(self) -> dict[str, Any]:
        return super().question() | {"with_spectra": self.spectra}


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


_ENTRIES: Final = {
    EntryKind.EVENT: (
        "events",
        EventsPage,
        "Loading and unloading. A revised event comes again, behind all earlier ones: follow next_cursor.",
    ),
    EntryKind.TRIP: (
        "trips",
        TripsPage,
        "Every drive with its load and tonne-kilometres. A revised trip comes again: follow next_cursor.",
    ),
}


def api_router(board: Board, reader: StoreReader, status: Callable[[], Status]) -> APIRouter:
    """The latest estimate, the history of estimates, the status and the stream."""
    router = APIRouter(prefix="/api/v1", tags=["api"])

    @router.get(
        "/estimates/latest", response_model=Latest, responses={304: {"description": "nothing but the age has changed"}}
    )
    async def latest(request: Request, shown: AsShown) -> Response:
        """The last good estimate and its age. Its ETag changes with all but the age."""
        return LatestResponse(board, request.scope, shown)

    @router.get("/estimates", response_model=EstimatesPage, responses=problem_responses(422, 503))
    async def estimates(query: Annotated[EstimatesQuery, Query()], shown: AsShown) -> Response:
        """Estimates and rejections in the order they were made. Follow next_cursor: nothing is missed or repeated."""
        first = await history_page(reader, BATCHES, query, min(query.limit, BATCHES_AT_A_TIME), query.cursor, shown)
        if len(first.items) == query.limit or first.next_cursor is None:
            return Response(f'{{"items":[{",".join(first.items)}{_end(first, first.last_cursor)}', media_type=JSON)
        return StreamingResponse(_page_by_page(reader, query, first, shown), media_type=JSON)

    @router.get("/status", response_model=Status)
    async def status_now() -> Status:
        """The state of the service, as a sentence and as numbers."""
        return status()

    async def joined(
        request: Request,
        shown: AsShown,
        last_event_id: Annotated[Cursor | SkipJsonSchema[None], Header()] = None,
    ) -> AsyncIterator[Any]:
        address = request.client.host if request.client else ""
        whose = f"{address} {getattr(request.state, 'token_name', '')}"
        try:
            with board.fanout.joined(reader, last_event_id, shown, whose) as subscription:
                yield subscription
        except TooManyStreamsError as refusal:
            raise HTTPException(503, str(refusal)) from None

    @router.get(
        "/stream",
        response_class=EventSourceResponse,
        responses={
            200: {"content": {EventSourceResponse.media_type: {"itemSchema": EVENT_SCHEMA}}},
            **problem_responses(422, 503),
        },
    )
    async def stream(subscription: Annotated[Any, Depends(joined)]) -> AsyncIterator[ServerSentEvent]:
        """Server-sent events: estimate, rejection, provisional; data is the estimate object.

        With Last-Event-ID, missed events come first. 503: this client, or all together, have too many streams open.
        """
        async for event in subscription.events():
            yield event

    return router


def export_router(reader: StoreReader) -> APIRouter:
    """All estimates as a file."""
    router = APIRouter(prefix="/api/v1", tags=["export"])

    def rows_of(items: Sequence[str]) -> list[dict[str, Any]]:
        return reader.understood(items, lambda item: csv_cells(json.loads(item)))

    def sent(span: TimeSpan, ending: str, shown: Shown, *, with_spectra: bool) -> Awaitable[Response]:
        def page(cursor: str | None) -> Awaitable[HistoryPage]:
            return history_page(reader, BATCHES, span, BATCHES_AT_A_TIME, cursor, shown, with_spectra=with_spectra)

        return sent_as_file(page, "springscale", ending, COLUMNS, rows_of)

    @router.get("/export.csv", response_class=Response, responses=file_responses("csv", "the file"))
    async def export_csv(span: Annotated[TimeSpan, Query()], shown: AsShown) -> Response:
        """Comma-separated values (RFC 4180), one batch a line, several reasons of rejection joined by a space."""
        return await sent(span, "csv", shown, with_spectra=False)

    @router.get("/export.jsonl", response_class=Response, responses=file_responses("jsonl", "the file"))
    async def export_jsonl(span: Annotated[SpanWithSpectra, Query()], shown: AsShown) -> Response:
        """JSON Lines, one estimate object a line."""
        return await sent(span, "jsonl", shown, with_spectra=span.spectra)

    return router


def events_router(reader: StoreReader) -> APIRouter:
    """Load events and trips, as pages and as files."""
    router = APIRouter(prefix="/api/v1", tags=["events"])
    for kind, (path, page, words) in _ENTRIES.items():
        router.add_api_route(
            f"/{path}",
            _entries(reader, kind),
            name=path,
            description=words,
            response_model=page,
            responses=problem_responses(422, 503),
        )
    for kind, (path, _, _) in _ENTRIES.items():
        for ending in FORMATS:
            router.add_api_route(
                f"/{path}.{ending}",
                _whole(reader, kind, f"springscale-{path}", ending),
                name=f"{path}_{ending}",
                description=f"All {path} as one file, each in its last revision.",
                response_class=Response,
                responses=file_responses(ending, f"the {path}"),
            )
    return router


def _entries(reader: StoreReader, kind: EntryKind) -> Callable[..., Any]:
    async def page(query: Annotated[HistoryQuery, Query()], shown: AsShown) -> Response:
        return Response("{" + await entries_of(reader, kind, query, shown), media_type=JSON)

    return page


def _whole(reader: StoreReader, kind: EntryKind, name: str, ending: str) -> Callable[..., Any]:
    def rows_of(items: Sequence[str]) -> list[dict[str, Any]]:
        return reader.understood(items, lambda item: table.cells_of(kind, json.loads(item)))

    async def whole(span: Annotated[TimeSpan, Query()], shown: AsShown) -> Response:
        def page(cursor: str | None) -> Awaitable[HistoryPage]:
            return history_page(reader, (kind,), span, ENTRIES_AT_A_TIME, cursor, shown)

        return await sent_as_file(page, name, ending, table.COLUMNS[kind], rows_of)

    return whole


async def entries_of(reader: StoreReader, kind: str, query: HistoryQuery, shown: Shown = str) -> str:
    """One page of entries as the rest of a JSON object. Raises RequestValidationError for an invalid cursor."""
    page = await history_page(reader, (kind,), query, query.limit, query.cursor, shown)
    return f'"items":[{",".join(page.items)}{_end(page, page.last_cursor)}'


async def history_page(
    reader: StoreReader,
    kinds: Sequence[str],
    span: TimeSpan,
    limit: int,
    cursor: str | None,
    shown: Shown,
    **more: Any,
) -> HistoryPage:
    """A page of the history as the client may see it; an invalid cursor is the client's fault."""
    try:
        page = await asyncio.to_thread(reader.page, kinds, limit=limit, cursor=cursor, **span.question(), **more)
    except ValueError as error:
        raise RequestValidationError([{"loc": ("query", "cursor"), "msg": str(error)}]) from None
    return replace(page, items=tuple(map(shown, page.items)))


async def _page_by_page(
    reader: StoreReader, query: EstimatesQuery, first: HistoryPage, shown: Shown
) -> AsyncIterator[str]:
    """A long answer, read from the store as fast as the client reads it."""
    page, n_left = first, query.limit - len(first.items)
    newest = first.last_cursor
    yield '{"items":[' + ",".join(first.items)
    while n_left > 0 and page.next_cursor is not None:
        page = await history_page(reader, BATCHES, query, min(n_left, BATCHES_AT_A_TIME), page.next_cursor, shown)
        n_left -= len(page.items)
        if page.items:
            yield "," + ",".join(page.items)
            newest = newest if query.order == "newest_first" else page.last_cursor
    yield _end(page, newest)


def _end(page: HistoryPage, newest: str | None) -> str:
    """The end of the JSON of an answer whose last page this is."""
    return "]," + json_line({"next_cursor": page.next_cursor, "last_cursor": newest})[1:]
