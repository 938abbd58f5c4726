"""The recorded history: pages to follow by a cursor, and all of it as one file; routes of the estimates."""

import asyncio
import csv
import io
import json
import re
from collections.abc import AsyncIterator, Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Query
from fastapi.exceptions import RequestValidationError
from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic.json_schema import SkipJsonSchema
from starlette.responses import Response, StreamingResponse

from gateway.estimates.as_json import COLUMNS, csv_cells
from gateway.records import json_line
from gateway.store import StoreReader
from gateway.store.journal import BATCHES, HistoryPage
from gateway.web.routes.service_calls import AsShown, Shown
from gateway.web.schemas import EstimatesPage, Instant, problem_responses

JSON: Final = "application/json"
CSV: Final = "text/csv; charset=utf-8"
PAGE_LIMIT: Final = 1000  # chosen: records in one answer; part of the described API, therefore no setting
BATCHES_AT_A_TIME: Final = 10  # chosen: in memory for each answer that is being sent: with spectra they are large
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


FILE: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {"text/csv": {"schema": {"type": "string"}}}, "description": "the file"},
    **problem_responses(422, 503),
}
"""The answers of a route that sends a file, for the API's description."""


def estimates_router(reader: StoreReader) -> APIRouter:
    """The history of estimates, in pages and as a file."""
    router = APIRouter(prefix="/api/v1", tags=["api"])

    @router.get("/estimates", response_model=EstimatesPage, responses=problem_responses(422, 503))
    async def estimates(query: Annotated[EstimatesQuery, Query()], shown: AsShown) -> Response:
        """Estimates and rejections in the order they were made. Follow next_cursor: nothing is missed or repeated."""
        first = await history_page(reader, BATCHES, query, min(query.limit, BATCHES_AT_A_TIME), query.cursor, shown)
        if len(first.items) == query.limit or first.next_cursor is None:
            return Response("{" + rest_of_page(first), media_type=JSON)
        return StreamingResponse(_page_by_page(reader, query, first, shown), media_type=JSON)

    @router.get("/export.csv", response_class=Response, responses=FILE)
    async def export_csv(span: Annotated[TimeSpan, Query()], shown: AsShown) -> Response:
        """Comma-separated values (RFC 4180), one batch a line, several reasons of rejection joined by a space."""
        file = CsvFile("springscale", COLUMNS, csv_cells, BATCHES_AT_A_TIME)
        return await file.sent(reader, BATCHES, span, shown, with_spectra=False)

    return router


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


def rest_of_page(page: HistoryPage) -> str:
    """The JSON object of a page behind its opening brace."""
    return f'"items":[{",".join(page.items)}{_end(page, page.last_cursor)}'


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


@dataclass(frozen=True, slots=True)
class CsvFile:
    """A table of records (RFC 4180) of this name. ``cells`` gives the known cells of a record's JSON object.

    It is sent while it is read, ``at_a_time`` records at once, so that it takes constant memory.
    """

    name: str
    columns: Collection[str]
    cells: Callable[[Mapping[str, Any]], Mapping[str, Any]]
    at_a_time: int

    async def sent(
        self, reader: StoreReader, kinds: Sequence[str], span: TimeSpan, shown: Shown, **more: Any
    ) -> Response:
        """The answer with all records of these kinds in the span, as far as this program understands them."""
        sink = io.StringIO(newline="")
        writer = csv.DictWriter(sink, tuple(self.columns), restval="")
        writer.writeheader()

        async def page_behind(cursor: str | None) -> HistoryPage:
            return await history_page(reader, kinds, span, self.at_a_time, cursor, shown, **more)

        def lines(page: HistoryPage) -> str:
            writer.writerows(reader.understood(page.items, lambda item: self.cells(json.loads(item))))
            text = sink.getvalue()
            sink.seek(0)
            sink.truncate()
            return text

        first = await page_behind(None)  # before the answer begins: what goes wrong here is still a problem

        async def pieces() -> AsyncIterator[str]:
            page = first
            yield lines(page)
            while page.next_cursor is not None:
                page = await page_behind(page.next_cursor)
                yield lines(page)

        named = {"content-disposition": f'attachment; filename="{self.name}.csv"'}
        return StreamingResponse(pieces(), media_type=CSV, headers=named)
