"""The history as rooms hand it to each other: the kinds of its records, and who reads or follows them.

The store keeps one journal. The web sends it, the uplink and the webhook deliver it, and all follow it the same way.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of record: a row of the table below.

    ``name`` is its name in the journal and on the event stream, ``letter`` that in the webhook, ``branch`` its MQTT
    topic below the vehicle's. A later revision of a revised record takes the place of the one before it; records that
    are not revised form a chain, each with the number of the one before it. What is retained stays with the broker.
    """

    name: str
    letter: str
    branch: str
    is_revised: bool
    is_retained: bool = False


ESTIMATE: Final = "estimate"
REJECTION: Final = "rejection"
ALARM: Final = "alarm"
REMAINDER: Final = "remainder"  # too short to be a batch: kept for the trips, never sent
SERVICE: Final = "service"  # what happened to the service itself: kept and asked for, never sent

KINDS: Final = {
    kind.name: kind
    for kind in (
        Kind(ESTIMATE, ESTIMATE, "estimates", is_revised=False),
        Kind(REJECTION, ESTIMATE, "estimates", is_revised=False),
        Kind("event", "event", "events", is_revised=True),
        Kind("trip", "trip", "trips", is_revised=True),
        Kind(ALARM, "alarm", "alarms", is_revised=True, is_retained=True),
    )
}
BATCHES: Final = tuple(kind.name for kind in KINDS.values() if not kind.is_revised)
ENTRIES: Final = tuple(kind.name for kind in KINDS.values() if kind.is_revised)


@dataclass(frozen=True, slots=True)
class Record:
    """One record of the journal: its place, what it is, and its JSON.

    ``previous`` is the number of the record before it in the chain of batches, 0 where there is none.
    """

    cursor: str
    kind: str
    id: str
    previous: int
    text: str

    @property
    def number(self) -> int:
        """Its number in the journal."""
        return int(self.cursor.partition("-")[2])


@dataclass(frozen=True, slots=True)
class Page:
    """A piece of the history: JSON texts in order, the cursor of each beside it, and the number of the one before it.

    ``next_cursor`` asks for more, None where there is no more now; ``last_cursor`` is the newest row
    of this page: the place to go on from when more arrives (None while there is nothing at all).
    """

    items: tuple[str, ...]
    cursors: tuple[str, ...]
    previous: tuple[int, ...]
    next_cursor: str | None
    last_cursor: str | None


@dataclass(frozen=True, slots=True)
class Delivery:
    """How far an uplink has delivered. ``n_pruned`` estimates were removed by retention before it could.

    ``oldest_ns`` is when the oldest that waits was received; None where none waits.
    ``n_pruned_entries`` is of load events, trips and alarms.
    """

    cursor: str | None
    n_pruned: int
    n_waiting: int
    oldest_ns: int | None = None
    n_pruned_entries: int = 0


class Follower(Protocol):
    """Follows the journal from a place on. One thread reads; any thread may close it."""

    @property
    def place(self) -> str:
        """Cursor of the last record read, or of the place from which it follows."""
        ...

    def read(self, limit: int) -> list[Record]:
        """The next records of its kinds in order of their numbers; none where there is nothing new.

        Asks the disk only for what is no longer in memory. Raises StoreError or TimeoutError.
        """
        ...

    def go_to(self, cursor: str | None) -> None:
        """Follow from behind another place; None: from the first record."""
        ...

    def close(self) -> None:
        """Follow no more."""
        ...


class Journal(Protocol):
    """What a sender needs of the store."""

    def follow(self, kinds: Sequence[str], after: str | None, on_news: Callable[[], None]) -> Follower:
        """Follow these kinds from behind a cursor. ``on_news`` is called with each record that is accepted, from the
        thread that writes it: quick, and never blocking. Raises ValueError for a cursor that is none.
        """
        ...

    def head(self) -> str:
        """Cursor of the newest record accepted."""
        ...

    def delivery(self, uplink: str, kinds: Sequence[str]) -> Delivery:
        """How far ``uplink`` has delivered, and what of these kinds waits. Raises StoreError or TimeoutError."""
        ...

    def write_delivery(self, uplink: str, cursor: str) -> bool:
        """Remember that ``uplink`` has delivered everything up to ``cursor``."""
        ...


class Reader(Protocol):
    """What the web asks of the store. Blocking questions, each from a thread of its own.

    Raises ValueError for a cursor that is none, TimeoutError for a question that takes too long,
    StoreError for a store that cannot be read.
    """

    def page(
        self,
        kinds: Sequence[str],
        *,
        since_ns: int | None = None,
        until_ns: int | None = None,
        limit: int = 100,
        cursor: str | None = None,
        newest_first: bool = False,
        with_spectra: bool = True,
    ) -> Page:
        """Records of these kinds with since_ns <= t_end_ns < until_ns, in the order of their arrival."""
        ...

    def follow(self, kinds: Sequence[str], after: str | None, on_news: Callable[[], None]) -> Follower:
        """As ``Journal.follow``."""
        ...

    def head(self) -> str:
        """Cursor of the newest record accepted."""
        ...
