"""/api/v1: the latest estimate, the history, the stream, the status."""

import asyncio
import re
from collections.abc import AsyncIterator, Callable, Sequence
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Header, Query, Request
from fastapi.exceptions import RequestValidationError
from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic.json_schema import SkipJsonSchema
from starlette.exceptions import HTTPException
from starlette.responses import Response, StreamingResponse

from gateway.history import BATCHES, HistoryPage
from gateway.records import json_line
from gateway.status import Status
from gateway.store import StoreReader
from gateway.web.live.board import Board
from gateway.web.live.latest import LatestResponse
from gateway.web.live.stream import EVENT_SCHEMA, EventStream
from gateway.web.schemas import EstimatesPage, Instant, Latest, problem_responses

PREFIX: Final = "/api/v1"
JSON: Final = "application/json"
PAGE_LIMIT: Final = 1000  # records in one answer; part of the described API, therefore no setting
_AT_A_TIME: Final = 10  # records in memory for each answer that is being sent
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


class HistoryQuery(TimeSpan):
    """Which part of the history, how much of it, and in which order."""

    limit: int = Field(100, ge=1, le=PAGE_LIMIT)
    cursor: Cursor | SkipJsonSchema[None] = Field(None, description="next_cursor or last_cursor of an earlier answer")
    order: Literal["oldest_first", "newest_first"] = Field(
        "oldest_first", description="oldest_first to follow new records, newest_first for the last ones"
    )


class EstimatesQuery(HistoryQuery):
    """Which part of the history, and whether with spectra."""

    spectra: bool = Field(True, description="false leaves the spectra out")


def api_router(
    board: Board, reader: StoreReader, status: Callable[[], Status], keep_alive_s: float, n_streams_max: int
) -> APIRouter:
    """The routes under /api/v1."""
    router = APIRouter(prefix=PREFIX, tags=["api"])

    @router.get(
        "/estimates/latest", response_model=Latest, responses={304: {"description": "nothing but the age has changed"}}
    )
    async def latest(request: Request) -> Response:
        """The last good estimate and its age. Its ETag changes with all but the age."""
        return LatestResponse(board, request.scope)

    @router.get("/estimates", response_model=EstimatesPage, responses=problem_responses(422, 503))
    async def estimates(query: Annotated[EstimatesQuery, Query()]) -> Response:
        """Estimates and rejections in the order they were made. Follow next_cursor: nothing is missed or repeated."""
        first = await history_page(reader, BATCHES, **_question(query, query.limit, query.cursor))
        if len(first.items) == query.limit or first.next_cursor is None:
            return Response(_page_json(first), media_type=JSON)
        return StreamingResponse(_page_by_page(reader, query, first), media_type=JSON)

    @router.get("/status", response_model=Status)
    async def status_now() -> Status:
        """The state of the service, as a sentence and as numbers."""
        return status()

    @router.get(
        "/stream",
        response_class=Response,
        responses={
            200: {"content": {EventStream.media_type: {"schema": EVENT_SCHEMA}}},
            **problem_responses(422, 503),
        },
    )
    async def stream(last_event_id: Annotated[Cursor | SkipJsonSchema[None], Header()] = None) -> Response:
        """Server-sent events: estimate, rejection, provisional; data is the estimate object.

        With Last-Event-ID, missed events come first.
        """
        if board.fanout.n_subscribers >= n_streams_max:
            raise HTTPException(503, f"{n_streams_max} streams are open already: close one")
        return EventStream(board.fanout, reader, last_event_id, keep_alive_s)

    return router


async def history_page(reader: StoreReader, kinds: Sequence[str], **question: Any) -> HistoryPage:
    """A page of the history; an invalid cursor is the client's fault."""
    try:
        return await asyncio.to_thread(reader.page, kinds, **question)
    except ValueError as error:
        raise RequestValidationError([{"loc": ("query", "cursor"), "msg": str(error)}]) from None


def _question(query: EstimatesQuery, n_left: int, cursor: str | None) -> dict[str, Any]:
    """The store query for the next records of an answer."""
    return {
        "since_ns": query.since,
        "until_ns": query.until,
        "limit": min(n_left, _AT_A_TIME),
        "cursor": cursor,
        "newest_first": query.order == "newest_first",
        "with_spectra": query.spectra,
    }


async def _page_by_page(reader: StoreReader, query: EstimatesQuery, first: HistoryPage) -> AsyncIterator[bytes]:
    """A long answer, read from the store as fast as the client reads it."""
    page, n_left = first, query.limit - len(first.items)
    newest = first.last_cursor
    yield b'{"items":[' + ",".join(first.items).encode()
    while n_left > 0 and page.next_cursor is not None:
        page = await history_page(reader, BATCHES, **_question(query, n_left, page.next_cursor))
        n_left -= len(page.items)
        if page.items:
            yield ("," + ",".join(page.items)).encode()
            newest = newest if query.order == "newest_first" else page.last_cursor
    yield _tail(page.next_cursor, newest)


def _page_json(page: HistoryPage) -> bytes:
    return b'{"items":[' + ",".join(page.items).encode() + _tail(page.next_cursor, page.last_cursor)


def _tail(next_cursor: str | None, last_cursor: str | None) -> bytes:
    return b"]," + json_line({"next_cursor": next_cursor, "last_cursor": last_cursor})[1:].encode()
