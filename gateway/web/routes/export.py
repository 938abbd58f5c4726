"""/api/v1/export.*: the whole history as a file, sent while it is read, in constant memory."""

import asyncio
import csv
import io
import json
from collections.abc import AsyncIterator, Callable, Sequence
from typing import Annotated, Any, Final

from fastapi import APIRouter, Query
from pydantic import BaseModel, ConfigDict, Field
from pydantic.json_schema import SkipJsonSchema
from starlette.responses import Response, StreamingResponse

from gateway.estimate_json import COLUMNS, csv_cells
from gateway.history import Page
from gateway.web.instant import Instant
from gateway.web.reader import Reader
from gateway.web.schemas import problem_responses

_PAGE: Final = 10  # records in memory at a time, for each file that is being sent

Encoder = Callable[[Sequence[str]], str]


class Span(BaseModel):
    """Which part of the history."""

    model_config = ConfigDict(extra="forbid")

    since: Instant | SkipJsonSchema[None] = Field(None, description="batches that end at or after this")
    until: Instant | SkipJsonSchema[None] = Field(None, description="batches that end before this")


class SpanWithSpectra(Span):
    """Which part of the history, and whether with spectra."""

    spectra: bool = Field(False, description="true sends the spectra too")


def export_router(reader: Reader) -> APIRouter:
    """The routes that send the history as a file."""
    router = APIRouter(prefix="/api/v1", tags=["export"])

    @router.get("/export.csv", response_class=Response, responses=_file("text/csv"))
    async def export_csv(span: Annotated[Span, Query()]) -> Response:
        """Comma-separated values (RFC 4180), one batch a line, several reasons of rejection joined by a space."""
        return await _sent(reader, span, "text/csv; charset=utf-8", "csv", csv_lines(), with_spectra=False)

    @router.get("/export.jsonl", response_class=Response, responses=_file("application/jsonl"))
    async def export_jsonl(span: Annotated[SpanWithSpectra, Query()]) -> Response:
        """JSON Lines, one estimate object a line."""
        return await _sent(reader, span, "application/jsonl", "jsonl", json_lines, with_spectra=span.spectra)

    return router


def json_lines(items: Sequence[str]) -> str:
    """Each text on a line of its own."""
    return "".join(f"{item}\n" for item in items)


def csv_lines() -> Encoder:
    """An encoder of its own for one file: the first call begins with the head line."""
    pending = io.StringIO()
    writer = csv.DictWriter(pending, COLUMNS, restval="")
    writer.writeheader()

    def encode(items: Sequence[str]) -> str:
        writer.writerows(csv_cells(json.loads(item)) for item in items)
        lines = pending.getvalue()
        pending.seek(0)
        pending.truncate()
        return lines

    return encode


async def _sent(
    reader: Reader, span: Span, media_type: str, ending: str, encode: Encoder, *, with_spectra: bool
) -> Response:
    async def page_behind(cursor: str | None) -> Page:
        return await asyncio.to_thread(
            reader.estimates,
            since_ns=span.since,
            until_ns=span.until,
            limit=_PAGE,
            cursor=cursor,
            with_spectra=with_spectra,
        )

    first = await page_behind(None)  # before the answer begins: what goes wrong here is still a problem

    async def pieces() -> AsyncIterator[str]:
        yield encode(first.items)
        cursor = first.next_cursor
        while cursor is not None:
            page = await page_behind(cursor)
            yield encode(page.items)
            cursor = page.next_cursor

    named = {"content-disposition": f'attachment; filename="springscale.{ending}"'}
    return StreamingResponse(pieces(), media_type=media_type, headers=named)


def _file(media_type: str) -> dict[int | str, dict[str, Any]]:
    content = {media_type: {"schema": {"type": "string"}}}
    return {200: {"content": content, "description": "the file"}, **problem_responses(422, 503)}
