"""The history as rooms hand it to each other: the kinds of its records, and pieces of it.

The store keeps one journal. The web sends it, the uplink and the webhook deliver it, and all follow it the same way.
"""

from dataclasses import dataclass
from typing import Final


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
