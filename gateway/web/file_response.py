"""A history sent as one file while it is read, page by page, in constant memory."""

import csv
import io
import json
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping, Sequence
from typing import Any, Final

from starlette.responses import Response, StreamingResponse

from gateway.history import HistoryPage
from gateway.web.schemas import problem_responses

CSV: Final = "text/csv; charset=utf-8"
JSON_LINES: Final = "application/jsonl"

Encoder = Callable[[Sequence[str]], str | bytes]
PageBehind = Callable[[str | None], Awaitable[HistoryPage]]


def json_lines(items: Sequence[str]) -> str:
    """Each text on a line of its own."""
    return "".join(f"{item}\n" for item in items)


def csv_lines(columns: Iterable[str], cells_of: Callable[[Any], Mapping[str, Any]]) -> Encoder:
    """A new encoder for one file: the first call begins with the head line."""
    pending = io.StringIO()
    writer = csv.DictWriter(pending, tuple(columns), restval="")
    writer.writeheader()

    def encode(items: Sequence[str]) -> str:
        writer.writerows(cells_of(json.loads(item)) for item in items)
        lines = pending.getvalue()
        pending.seek(0)
        pending.truncate()
        return lines

    return encode


async def sent_as_file(
    page_behind: PageBehind, encode: Encoder, media_type: str, name: str, end: Callable[[], bytes] | None = None
) -> Response:
    """All records from the first page on, each encoded as it is read; ``end`` follows the last."""
    first = await page_behind(None)  # before the answer begins: what goes wrong here is still a problem

    async def pieces() -> AsyncIterator[str | bytes]:
        yield encode(first.items)
        cursor = first.next_cursor
        while cursor is not None:
            page = await page_behind(cursor)
            yield encode(page.items)
            cursor = page.next_cursor
        if end is not None:
            yield end()

    named = {"content-disposition": f'attachment; filename="{name}"'}
    return StreamingResponse(pieces(), media_type=media_type, headers=named)


def file_responses(media_type: str, what: str) -> dict[int | str, dict[str, Any]]:
    """The description of a route's answers."""
    content = {media_type: {"schema": {"type": "string"}}}
    return {200: {"content": content, "description": what}, **problem_responses(422, 503)}
