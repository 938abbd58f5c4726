"""/api/v1/export.*: the whole history as a file, sent while it is read, in constant memory."""

from typing import Annotated, Final

from fastapi import APIRouter, Query
from pydantic import Field
from starlette.responses import Response

from gateway.estimate_json import COLUMNS, csv_cells
from gateway.history import BATCHES, HistoryPage
from gateway.store import StoreReader
from gateway.web.file_response import CSV, JSON_LINES, Encoder, csv_lines, file_responses, json_lines, sent_as_file
from gateway.web.routes.estimates import TimeSpan, history_page

_PAGE: Final = 10  # records in memory at a time, for each file that is being sent


class SpanWithSpectra(TimeSpan):
    """Which part of the history, and whether with spectra."""

    spectra: bool = Field(False, description="true sends the spectra too")


def export_router(reader: StoreReader) -> APIRouter:
    """The routes that send the history as a file."""
    router = APIRouter(prefix="/api/v1", tags=["export"])

    @router.get("/export.csv", response_class=Response, responses=file_responses("text/csv", "the file"))
    async def export_csv(span: Annotated[TimeSpan, Query()]) -> Response:
        """Comma-separated values (RFC 4180), one batch a line, several reasons of rejection joined by a space."""
        return await _sent(reader, span, CSV, "csv", csv_lines(COLUMNS, csv_cells), with_spectra=False)

    @router.get("/export.jsonl", response_class=Response, responses=file_responses(JSON_LINES, "the file"))
    async def export_jsonl(span: Annotated[SpanWithSpectra, Query()]) -> Response:
        """JSON Lines, one estimate object a line."""
        return await _sent(reader, span, JSON_LINES, "jsonl", json_lines, with_spectra=span.spectra)

    return router


async def _sent(
    reader: StoreReader, span: TimeSpan, media_type: str, ending: str, encode: Encoder, *, with_spectra: bool
) -> Response:
    async def page_behind(cursor: str | None) -> HistoryPage:
        return await history_page(
            reader,
            BATCHES,
            since_ns=span.since,
            until_ns=span.until,
            limit=_PAGE,
            cursor=cursor,
            with_spectra=with_spectra,
        )

    return await sent_as_file(page_behind, encode, media_type, f"springscale.{ending}")
