"""The types of the history that store, web and uplink exchange: kinds of records, records, pages.

The store keeps one journal. The web, the uplink and the webhook follow it in the same way.
"""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class RecordKind:
    """One kind of record: a row of the table below.

    ``name`` is its name in the journal and on the event stream, ``webhook_type`` its type in the webhook, ``branch``
    its MQTT topic below that of the vehicle. If ``is_revised``, a later revision replaces the earlier one; the other
    records form a chain, each with the number of the one before it. The broker retains the last message of a kind with
    ``is_retained``.
    """

    name: str
    webhook_type: str
    branch: str
    is_revised: bool
    is_retained: bool = False


ESTIMATE: Final = "estimate"
REJECTION: Final = "rejection"
ALARM: Final = "alarm"
REMAINDER: Final = "remainder"  # too short to be a batch: stored for the trips, never sent
SERVICE: Final = "service"  # events of the service itself: stored, never sent

KINDS: Final = {
    kind.name: kind
    for kind in (
        RecordKind(ESTIMATE, ESTIMATE, "estimates", is_revised=False),
        RecordKind(REJECTION, ESTIMATE, "estimates", is_revised=False),
        RecordKind("event", "event", "events", is_revised=True),
        RecordKind("trip", "trip", "trips", is_revised=True),
        RecordKind(ALARM, "alarm", "alarms", is_revised=True, is_retained=True),
    )
}
BATCHES: Final = tuple(kind.name for kind in KINDS.values() if not kind.is_revised)
ENTRIES: Final = tuple(kind.name for kind in KINDS.values() if kind.is_revised)


@dataclass(frozen=True, slots=True)
class JournalRecord:
    """One record of the journal: its cursor, kind, id and JSON.

    ``previous`` is the number of the record before it in the chain of batches, 0 if there is none.
    """

    cursor: str
    kind: str
    id: str
    previous: int
    text: str

    @property
    def number(self) -> int:
        """The record's number in the journal."""
        return int(self.cursor.partition("-")[2])


@dataclass(frozen=True, slots=True)
class HistoryPage:
    """A page of the history: JSON texts in order.

    ``next_cursor`` requests the next page; None if there are no more records now. ``last_cursor`` is the cursor of the
    newest record of this page, from which to follow new records; None if there is no record at all.
    """

    items: tuple[str, ...]
    next_cursor: str | None
    last_cursor: str | None


def up_to(cursor: str | None) -> str | None:
    """The cursor for a page, newest first, of the records up to this one; None: of all."""
    if cursor is None:
        return None
    epoch, _, number = cursor.partition("-")
    return f"{epoch}-{int(number) + 1}"


@dataclass(frozen=True, slots=True)
class Delivery:
    """How far an uplink has delivered, and how many records retention removed before it could.

    ``oldest_ns`` is when the oldest that waits was received; None if none waits.
    """

    cursor: str | None
    n_pruned: int
    n_waiting: int
    oldest_ns: int | None = None
