"""The rows that the store writes: records of the journal, documents, and positions of uplinks."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final


@dataclass(frozen=True, slots=True)
class JournalRow:
    """One record. ``seq`` orders all records and never repeats; ``previous`` links batches into a chain.

    ``boot_ns`` is the time of receipt on a monotonic clock (table ``receipts``); it is no column of the journal.
    """

    seq: int
    kind: str
    id: str
    revision: int
    t_end_ns: int
    previous: int
    received_ns: int
    text: str
    boot_ns: int = 0

    def columns(self) -> tuple[Any, ...]:
        """All but the checksum, in the order of the table."""
        return (
            self.seq, self.kind, self.id, self.revision, self.t_end_ns, self.previous, self.received_ns, self.text
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class DocumentRow:
    """The last version of a text, stored under a name."""

    name: str
    received_ns: int
    text: str


@dataclass(frozen=True, slots=True)
class DeliveryRow:
    """How far an uplink has delivered: every record up to number ``seq``."""

    name: str
    seq: int


Row = JournalRow | DocumentRow | DeliveryRow

JOURNAL_COLUMNS: Final = "seq, kind, id, revision, t_end_ns, previous, received_ns, text"


def checksum(columns: Sequence[Any]) -> int:
    """CRC-32 of a row's columns without the sum itself. Detects every single-bit error and every burst of 32 bits."""
    parts = (column if isinstance(column, bytes) else str(column).encode() for column in columns)
    return zlib.crc32(b"\x1f".join(parts))


class Chain:
    """Links each batch to the one before it and leaves out batches that were already stored."""

    def __init__(self, known: "Chain | None" = None) -> None:
        """Continues a copy of ``known``."""
        self._skipped: dict[int, int] = {} if known is None else dict(known._skipped)

    def linked(self, row: JournalRow) -> JournalRow:
        """The row, linked to the last batch that was stored."""
        return replace(row, previous=self._skipped.pop(row.previous, row.previous)) if row.previous else row

    def skip(self, row: JournalRow) -> None:
        """Leave this row out: the batch after it is linked to the one before it."""
        self._skipped[row.seq] = row.previous
