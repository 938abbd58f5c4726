"""The history as rooms hand it to each other: what the store answers, the web sends and the uplink delivers."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Page:
    """A piece of the history: JSON texts in order, the cursor of each beside it, and the number of the one before it.

    That number is None for records from before it was kept.
    ``next_cursor`` asks for more, None where there is no more now; ``last_cursor`` is the newest row
    of this page: the place to go on from when more arrives (None while there is nothing at all).
    """

    items: tuple[str, ...]
    cursors: tuple[str, ...]
    previous: tuple[int | None, ...]
    next_cursor: str | None
    last_cursor: str | None


@dataclass(frozen=True, slots=True)
class Delivery:
    """How far an uplink has delivered. ``n_pruned`` estimates were removed by retention before it could.

    ``waiting_age_s`` is the age of the oldest that waits, since its receipt; None where none waits.
    ``n_pruned_entries`` is of load events, trips and alarms.
    """

    cursor: str | None
    n_pruned: int
    n_waiting: int
    waiting_age_s: float | None = None
    n_pruned_entries: int = 0
