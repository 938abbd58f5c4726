"""A history sent as one file while it is read, page by page, in constant memory: CSV or JSON Lines."""

import csv
import io
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping, Sequence
from typing import Any, Final

from starlette.responses import Response, StreamingResponse

from gateway.store.journal import HistoryPage
from gateway.web.schemas import problem_responses

FORMATS: Final[Mapping[str, str]] = {"csv": "text/csv; charset=utf-8", "jsonl": "application/jsonl"}
"""The media type of each ending."""

Rows = Callable[[Sequence[str]], Iterable[Mapping[str, Any]]]
PageBehind = Callable[[str | None], Awaitable[HistoryPage]]


def _encoder(ending: str, columns: Iterable[str], rows_of: Rows) -> Callable[[Sequence[str]], str]:
    """Turns records (their JSON) into the next part of the file; the first part of CSV (RFC 4180) begins with its head.

    A line of JSON Lines is a record as it is; ``rows_of`` gives the cells of records in a table of ``columns``.
    """
    if ending == "jsonl":
        return lambda items: "".join(f"{item}\n" for item in items)
    sink = io.StringIO(newline="")
    writer = csv.DictWriter(sink, tuple(columns), restval="")
    writer.writeheader()

    def lines(items: Sequence[str]) -> str:
        writer.writerows(rows_of(items))
        text = sink.getvalue()
        sink.seek(0)
        sink.truncate()
        return text

    return lines


async def sent_as_file(
    page_behind: PageBehind, name: str, ending: str, columns: Iterable[str], rows_of: Rows
) -> Response:
    """All records from the first page on, each encoded as it is read."""
    encoded = _encoder(ending, columns, rows_of)
    first = await page_behind(None)  # before the answer begins: what goes wrong here is still a problem

    async def pieces() -> AsyncIterator[str]:
        yield encoded(first.items)
        cursor = first.next_cursor
        while cursor is not None:
            page = await page_behind(cursor)
            yield encoded(page.items)
            cursor = page.next_cursor

    named = {"content-disposition": f'attachment; filename="{name}.{ending}"'}
    return StreamingResponse(pieces(), media_type=FORMATS[ending], headers=named)


def file_responses(ending: str, what: str) -> dict[int | str, dict[str, Any]]:
    """The description of the answers of a route that sends a file of this format."""
    content = {FORMATS[ending].partition(";")[0]: {"schema": {"type": "string"}}}
    return {200: {"content": content, "description": what}, **problem_responses(422, 503)}
