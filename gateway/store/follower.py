"""Follows the journal: returns each record of the chosen kinds once, in order, as it is accepted."""

from collections.abc import Callable, Sequence

from gateway.history import BATCHES, JournalRecord
from gateway.store.reader import StoreReader, seq_after
from gateway.store.rows import JournalRow
from gateway.store.write_buffer import WriteBuffer

Link = Callable[[Sequence[JournalRow]], tuple[JournalRow, ...]]


class Follower:
    """A read position in the journal. One thread reads; any thread may close it.

    An idle follower costs nothing: it has no thread, no connection and sends no query. It reads recent records from
    memory and older ones from disk. If a database that was out of reach comes back, records in memory get new numbers
    and the position moves with them. A position in a database that no longer exists starts again at the first record.
    """

    def __init__(
        self,
        buffer: WriteBuffer,
        reader: StoreReader,
        link: Link,
        kinds: Sequence[str],
        after: str | None,
        on_news: Callable[[], None],
    ) -> None:
        """Raises ValueError if ``after`` is not a cursor of this program."""
        seq_after(after, buffer.epoch)
        self._buffer, self._reader, self._link = buffer, reader, link
        self._kinds = tuple(kinds)
        self._after = after
        buffer.listen(self, on_news)

    @property
    def place(self) -> str:
        """Cursor of the last record read, or of the place from which it follows."""
        return self._after or f"{self._buffer.epoch}-0"

    def read(self, limit: int) -> list[JournalRecord]:
        """The next records of its kinds in order of their numbers; none if there is nothing new.

        Raises StoreError or TimeoutError.
        """
        memory = self._buffer.in_memory()
        seq = self._seq(memory.epoch)
        if seq >= self._buffer.newest(self._kinds):
            self._after = f"{memory.epoch}-{max(seq, memory.head)}"
            return []
        last_revision = {row.id: row.seq for row in memory.rows}
        rows = [
            row
            for row in self._link(memory.rows)
            if row.seq > seq and row.kind in self._kinds and (row.kind in BATCHES or last_revision[row.id] == row.seq)
        ]
        if seq < memory.floor:
            stored = self._reader.behind(self._kinds, seq, limit)
            last = stored[-1].seq if stored else seq
            rows = stored + ([] if len(stored) >= limit else [row for row in rows if row.seq > last])
        found = [
            JournalRecord(f"{memory.epoch}-{row.seq}", row.kind, row.id, row.previous, row.text) for row in rows[:limit]
        ]
        if len(found) == limit:
            self._after = found[-1].cursor
        else:  # all up to there was looked through
            self._after = f"{memory.epoch}-{max(memory.head, found[-1].number if found else 0)}"
        return found

    def go_to(self, cursor: str | None) -> None:
        """Continue after another cursor; None: from the first record."""
        self._after = cursor

    def close(self) -> None:
        """Stop following."""
        self._buffer.unlisten(self)

    def _seq(self, epoch: str) -> int:
        seq = seq_after(self._after, epoch)
        if seq is None and self._after is not None:
            before, _, digits = self._after.partition("-")
            seq = self._buffer.place_of(before, int(digits))
        return 0 if seq is None else seq
