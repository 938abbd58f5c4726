"""A history as a Parquet file, sent while it is read: a row group for each page, so that memory stays bounded.

Its library is not part of a vehicle's install (extra ``archive``), and loads with the first request for such a file.
"""

import io
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime
from typing import Any, Final

from starlette.exceptions import HTTPException

PARQUET: Final = "application/vnd.apache.parquet"  # as registered with IANA
MISSING: Final = "this install writes no Parquet: pip install 'springscale[archive]', or request .csv or .jsonl"

Cells = Callable[[Any], Mapping[str, Any]]

_TEXT: Final = ("id", "vehicle_id", "distance_by")
_INSTANTS: Final = ("t_start", "t_end")


class ParquetFile:
    """One file that grows by pages; its bytes are drained after each."""

    def __init__(self, columns: Iterable[str], cells_of: Cells) -> None:
        """Raises HTTPException 501 if the library is missing."""
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
        self._schema = pyarrow.schema([(name, kinds[kind_of(name)]) for name in columns])
        self._cells_of = cells_of
        self._sink = io.BytesIO()
        self._writer = pyarrow.parquet.ParquetWriter(self._sink, self._schema, compression="zstd")

    def page(self, items: Sequence[str]) -> bytes:
        """A row group, from the texts of these items."""
        if items:
            rows = [self._row(json.loads(item)) for item in items]
            self._writer.write_table(self._table.from_pylist(rows, schema=self._schema))
        return self._drained()

    def end(self) -> bytes:
        """The file's footer, without which it is unreadable."""
        self._writer.close()
        return self._drained()

    def _row(self, record: Any) -> dict[str, Any]:
        cells = self._cells_of(record)
        told = {name: datetime.fromisoformat(cells[name]) for name in _INSTANTS if name in cells}
        return {**cells, **told}

    def _drained(self) -> bytes:
        piece = self._sink.getvalue()
        self._sink.seek(0)
        self._sink.truncate()
        return piece


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
