"""What is still to be delivered. The store is the queue: the outbox only knows how far it has come."""

import json
from dataclasses import dataclass
from typing import Any, Protocol

from gateway.history import Delivery, Page
from gateway.records import json_line


@dataclass(frozen=True, slots=True)
class Letter:
    """One estimate or rejection: its place in the store, its idempotent id, its JSON without spectra.

    The JSON has a ``sequence`` of its own: which store it comes from, its number there, and the number before it.
    """

    cursor: str
    id: str
    text: str


class History(Protocol):
    """The store's reading side, as far as the outbox needs it."""

    def estimates(self, *, cursor: str | None, limit: int, with_spectra: bool) -> Page: ...
    def delivery(self, uplink: str) -> Delivery: ...


class Memory(Protocol):
    """The store's writing side, as far as the outbox needs it."""

    def write_delivery(self, uplink: str, cursor: str) -> bool: ...


class Outbox:
    """Hands out letters in order, and again from the last delivered one after :meth:`rewind`.

    Where the database was replaced (set aside as damaged, deleted), its numbers begin anew: what the
    new one remembers counts then, and without that everything it holds goes out; ids are idempotent.
    """

    def __init__(self, history: History, memory: Memory, name: str) -> None:
        self._history = history
        self._memory = memory
        self._name = name
        self._delivered: str | None = None  # until the store was asked
        self._handed_out: str | None = None

    def next_letters(self, limit: int) -> list[Letter]:
        """Up to ``limit`` letters behind the last one handed out. Raises what the store's reader raises."""
        page = self._behind(self._handed_out, limit)
        if page.cursors and _epoch(self._handed_out) != _epoch(page.cursors[0]):
            self._take_place(_epoch(page.cursors[0]))
            page = self._behind(self._handed_out, limit)
        if page.cursors:
            self._handed_out = page.cursors[-1]
        return [
            _letter(cursor, previous, json.loads(text))
            for cursor, previous, text in zip(page.cursors, page.previous, page.items, strict=True)
        ]

    def delivered(self, letter: Letter) -> None:
        """The broker has this letter and all before it."""
        self._delivered = letter.cursor
        self._memory.write_delivery(self._name, letter.cursor)

    def rewind(self) -> None:
        """The link broke: what was handed out and not delivered goes out again."""
        self._handed_out = self._delivered

    def look(self) -> Delivery:
        """How much waits and how much retention removed undelivered, as the store has it."""
        return self._history.delivery(self._name)

    def _behind(self, cursor: str | None, limit: int) -> Page:
        return self._history.estimates(cursor=cursor, limit=limit, with_spectra=False)

    def _take_place(self, epoch: str) -> None:
        """Go on where the database that is there now remembers us; an uplink it never saw begins at its first row."""
        known = self._history.delivery(self._name).cursor
        if _epoch(known) != epoch:
            known = f"{epoch}-0"
            self._memory.write_delivery(self._name, known)  # from here on, what retention removes is counted
        self._delivered = self._handed_out = known


def _letter(cursor: str, previous: int | None, record: dict[str, Any]) -> Letter:
    stream, _, number = cursor.partition("-")
    sequence = {"stream": stream, "number": int(number), "previous": previous}
    return Letter(cursor, record["id"], json_line(record | {"sequence": sequence}))


def _epoch(cursor: str | None) -> str:
    return "" if cursor is None else cursor.partition("-")[0]
