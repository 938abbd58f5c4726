"""A history sent as one file while it is read, page by page, in constant memory: CSV, JSON Lines or Parquet.

The library for Parquet is not part of a vehicle's install (extra ``archive``); it loads with the first request for
such a file.
"""

import csv
import io
import json
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping, Sequence
from datetime import datetime
from typing import Any, ClassVar, Final

from starlette.exceptions import HTTPException
from starlette.responses import Response, StreamingResponse

from gateway.history import HistoryPage
from gateway.web.schemas import problem_responses

MISSING: Final = "this install writes no Parquet: pip install 'springscale[archive]', or request .csv or .jsonl"
_TEXT: Final = ("id", "vehicle_id", "distance_by")
_INSTANTS: Final = ("t_start", "t_end")

Cells = Callable[[Any], Mapping[str, Any]]
PageBehind = Callable[[str | None], Awaitable[HistoryPage]]


class JsonLines:
    """One file that grows by pages. Here each record is a line as it is; the other formats are tables.

    A table has ``columns``; ``cells_of`` gives the cells of a record.
    """

    MEDIA_TYPE: ClassVar[str] = "application/jsonl"

    def __init__(self, columns: Iterable[str], cells_of: Cells) -> None:
        self._columns, self._cells_of = tuple(columns), cells_of
        self._sink = io.BytesIO()

    def page(self, items: Sequence[str]) -> bytes:
        """The bytes of these records, with the head of the file on the first call."""
        return "".join(f"{item}\n" for item in items).encode()

    def end(self) -> bytes:
        """The bytes behind the last record."""
        return b""

    def _drained(self) -> bytes:
        piece = self._sink.getvalue()
        self._sink.seek(0)
        self._sink.truncate()
        return piece


class CsvLines(JsonLines):
    """Comma-separated values (RFC 4180) with a head line."""

    MEDIA_TYPE = "text/csv; charset=utf-8"

    def __init__(self, columns: Iterable[str], cells_of: Cells) -> None:
        super().__init__(columns, cells_of)
        lines = io.TextIOWrapper(self._sink, encoding="utf-8", newline="", write_through=True)
        self._writer = csv.DictWriter(lines, self._columns, restval="")
        self._writer.writeheader()

    def page(self, items: Sequence[str]) -> bytes:
        self._writer.writerows(self._cells_of(json.loads(item)) for item in items)
        return self._drained()


class ParquetFile(JsonLines):
    """A row group for each page. Raises HTTPException 501 if the library is missing."""

    MEDIA_TYPE = "application/vnd.apache.parquet"  # as registered with IANA

    def __init__(self, columns: Iterable[str], cells_of: Cells) -> None:
        super().__init__(columns, cells_of)
        try:
            import pyarrow  # noqa: PLC0415 - an extra, see above
            import pyarrow.parquet  # noqa: PLC0415
        except ModuleNotFoundError:
            raise HTTPException(501, MISSING) from None
        self._table = pyarrow.Table
        kinds = {
            "text": pyarrow.string(),
            "instant": pyarrow.timestamp("us", tz="UTC"),
            "truth": pyarrow.bool_(),
            "whole": pyarrow.int64(),
            "number": pyarrow.float64(),
        }
        self._schema = pyarrow.schema([(name, kinds[kind_of(name)]) for name in self._columns])
        self._writer = pyarrow.parquet.ParquetWriter(self._sink, self._schema, compression="zstd")

    def page(self, items: Sequence[str]) -> bytes:
        if items:
            rows = [self._row(json.loads(item)) for item in items]
            self._writer.write_table(self._table.from_pylist(rows, schema=self._schema))
        return self._drained()

    def end(self) -> bytes:
        self._writer.close()
        return self._drained()

    def _row(self, record: Any) -> dict[str, Any]:
        cells = self._cells_of(record)
        return {**cells, **{name: datetime.fromisoformat(cells[name]) for name in _INSTANTS if name in cells}}


FORMATS: Final[Mapping[str, type[JsonLines]]] = {"csv": CsvLines, "jsonl": JsonLines, "parquet": ParquetFile}


def kind_of(name: str) -> str:
    """The type of a column of the table of events or trips: text, instant, truth, whole or number."""
    if name in _TEXT:
        return "text"
    if name in _INSTANTS:
        return "instant"
    if name.startswith("is_"):
        return "truth"
    bare = name.removeprefix("before_").removeprefix("after_")
    return "whole" if bare == "revision" or bare.startswith("n_") else "number"


async def sent_as_file(page_behind: PageBehind, file: JsonLines, name: str) -> Response:
    """All records from the first page on, each encoded as it is read."""
    first = await page_behind(None)  # before the answer begins: what goes wrong here is still a problem

    async def pieces() -> AsyncIterator[bytes]:
        yield file.page(first.items)
        cursor = first.next_cursor
        while cursor is not None:
            page = await page_behind(cursor)
            yield file.page(page.items)
            cursor = page.next_cursor
        yield file.end()

    named = {"content-disposition": f'attachment; filename="{name}"'}
    return StreamingResponse(pieces(), media_type=file.MEDIA_TYPE, headers=named)


def file_responses(ending: str, what: str) -> dict[int | str, dict[str, Any]]:
    """The description of the answers of a route that sends a file of this format."""
    content = {FORMATS[ending].MEDIA_TYPE.partition(";")[0]: {"schema": {"type": "string"}}}
    codes = (422, 503, 501) if ending == "parquet" else (422, 503)
    return {200: {"content": content, "description": what}, **problem_responses(*codes)}
