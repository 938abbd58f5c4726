"""The service's log lines about changes of state, and its records of load events and trips."""

import json
import logging
from collections.abc import Mapping
from typing import Final

from pydantic import BaseModel

from gateway.core.change import Rules
from gateway.core.events.entry import Entry, EntryKind
from gateway.core.events.ledger import HORIZON, Ledger
from gateway.estimates.as_json import read_estimate
from gateway.estimates.batch_estimate import Estimate
from gateway.estimates.field_kinds import INSTANT
from gateway.log import Event, log_event
from gateway.records import Why, json_line, rounded
from gateway.service.journal_reader import WINDOWS, place_of
from gateway.setup import Setup
from gateway.status import State, Status
from gateway.store import Store, StoreReader, restored
from gateway.store.journal import up_to
from gateway.web.live.board import Board
from gateway.web.routes.events_trips_alarms import LoadEvent, Trip


class BatchLog:
    """Called with every stored batch."""

    NAME: Final = "log of batches"

    def __init__(self) -> None:
        self._rejected: frozenset[Why] = frozenset()  # of the last full batch; before the first, as if it had counted

    def __call__(self, found: Estimate) -> None:
        """Log a new estimate at level info, a rejected one at level debug."""
        if found.is_remainder:
            return
        log_event(
            Event.ESTIMATE if found.counted else Event.REJECTED,
            level=logging.INFO if found.counted else logging.DEBUG,
            batch=found.id,
            payload_kg=rounded(found.payload.number, 3),
            payload_std_kg=rounded(found.payload.std, 3),
            front_share_pct=rounded(found.front_share.number, 3),
            rejected=found.rejected,
        )
        before, self._rejected = self._rejected, frozenset(found.rejected)
        if self._rejected != before:
            log_event(Event.REASONS_CHANGED, rejected=found.rejected, before=sorted(before))


class StateLog:
    """Called often with the service's state; writes a line if it differs from the last one."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._state: State | None = None
        self._is_stale = board.is_stale()

    def __call__(self, now: Status) -> None:
        """Log a change of the state, and of whether the shown estimate is stale."""
        if now.state is not self._state:
            log_event(Event.STATE, state=now.state, before=self._state, sentence=now.sentence())
            self._state = now.state
        if (is_stale := self._board.is_stale()) is not self._is_stale:
            log_event(Event.STALE if is_stale else Event.FRESH, age_s=round(self._board.age_s() or 0.0, 1))
            self._is_stale = is_stale


_SHAPES: Final[Mapping[EntryKind, type[BaseModel]]] = {EntryKind.EVENT: LoadEvent, EntryKind.TRIP: Trip}
MOST: Final = 2 * HORIZON  # chosen: entries that so many batches can produce


class LoadEventLog:
    """Called with every stored window."""

    NAME: Final = "load events"

    def __init__(self, setup: Setup, store: Store) -> None:
        """Resumes from the windows that it has taken."""
        self._store = store
        rules = Rules.of(setup.calibrated.vehicle) if setup.calibrated else Rules()
        self._ledger = restored(lambda: ledger_of(store.reader(), rules, place_of(store, self.NAME)), Ledger(rules))

    def __call__(self, found: Estimate) -> None:
        for entry in self._ledger.add(found):
            text = json_line(entry.record)
            self._store.write_entry(entry.kind, entry.id, entry.t_end_ns, text)
            log_event(Event.ENTRY, level=logging.DEBUG, id=entry.id, revision=entry.revision)


def ledger_of(reader: StoreReader, rules: Rules, place: str | None = None) -> Ledger:
    """The ledger behind a place in the journal, None: its end. Raises what the store's reader raises."""
    page = reader.page(WINDOWS, limit=HORIZON, newest_first=True, with_spectra=False, cursor=up_to(place))
    estimates = reader.understood(reversed(page.items), read_estimate)
    known: list[Entry] = []
    first_ns = min((one.t_start_ns for one in estimates), default=0)  # not the oldest's: clocks are put back
    for kind in EntryKind if estimates else ():
        told = reader.entries(kind=kind, since_ns=first_ns, limit=MOST, newest_first=True)
        known += reader.understood(told.items, _entry)
    return Ledger(rules, estimates, known)


def _entry(text: str) -> Entry:
    record = json.loads(text)
    kind = EntryKind(record["id"].partition("-")[0])
    _SHAPES[kind].model_validate(record)
    return Entry(kind, record["id"], INSTANT.read(record["t_end"]), record)
