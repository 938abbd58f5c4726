"""What the service writes about batches and its own state: log lines when they change, load events and trips."""

import json
import logging
from collections.abc import Callable, Mapping
from typing import Final

from pydantic import BaseModel

from gateway.core.change import Rules
from gateway.core.events.entry import Entry, EntryKind
from gateway.core.events.ledger import HORIZON, Ledger
from gateway.estimate import PLACES, Estimate
from gateway.estimate_json import INSTANT, read_estimate
from gateway.history import BATCHES, REMAINDER
from gateway.log import Event, log_event
from gateway.records import Why, json_line, rounded
from gateway.setup import Setup
from gateway.status import State, Status
from gateway.store import Store, StoreReader, restored
from gateway.web.live.board import Board
from gateway.web.routes.history import LoadEvent, Trip
from gateway.web.routes.weights import LatestWeights


class BatchLog:
    """Called by the pipeline with every batch. ``weigh`` returns the weights shown by the web, with warnings."""

    def __init__(self, weigh: Callable[[], LatestWeights]) -> None:
        self._weigh = weigh
        self._rejected: frozenset[Why] = frozenset()  # of the last full batch; before the first, as if it had counted
        self._overloaded = overloaded(weigh())

    def __call__(self, found: Estimate) -> None:
        """Log a new estimate at level info; rejected and provisional ones at level debug."""
        if found.is_remainder:
            return
        is_answer = found.counted and not found.is_provisional
        event = Event.PROVISIONAL if found.is_provisional else Event.ESTIMATE if found.counted else Event.REJECTED
        log_event(
            event,
            level=logging.INFO if is_answer else logging.DEBUG,
            batch=found.id,
            payload_kg=rounded(found.payload.number, 3),
            payload_std_kg=rounded(found.payload.std, 3),
            front_share_pct=rounded(found.front_share.number, 3),
            rejected=found.rejected,
        )
        if not found.is_provisional:
            before, self._rejected = self._rejected, frozenset(found.rejected)
            if self._rejected != before:
                log_event(Event.REASONS_CHANGED, rejected=found.rejected, before=sorted(before))
            self._tell_overload()

    def _tell_overload(self) -> None:
        weights = self._weigh()
        before, self._overloaded = self._overloaded, overloaded(weights)
        for where in PLACES:
            if where in before ^ self._overloaded:
                figure = getattr(weights, where)
                event, level = Event.OVERLOAD_ENDS, logging.INFO
                if where in self._overloaded:
                    event, level = Event.OVERLOAD_BEGINS, logging.WARNING
                log_event(event, level=level, where=where, kg=figure.kg, limit_kg=figure.limit_kg)


def overloaded(weights: LatestWeights) -> frozenset[str]:
    """The places whose weight is over its limit."""
    return frozenset(where for where in PLACES if getattr(weights, where).is_over_limit)


class Listeners:
    """Passes each batch to listeners by name. What one raises is its own fault: the others and the pipeline go on."""

    def __init__(self, hearers: Mapping[str, Callable[[Estimate], None]]) -> None:
        self._hearers = hearers
        self._faults: dict[str, str] = {}  # of the last batch

    def __call__(self, found: Estimate) -> None:
        for name, hear in self._hearers.items():
            try:
                hear(found)
            except Exception as failure:  # noqa: BLE001 - whatever it is, weighing does not depend on it
                if name not in self._faults:
                    log_event(Event.LISTENER_FAILED, level=logging.ERROR, listener=name, failure=repr(failure))
                self._faults[name] = repr(failure)
            else:
                self._faults.pop(name, None)

    @property
    def fault(self) -> str | None:
        """Which failed with the last batch, for people."""
        told = (f"{name} failed: {failure}; weighing goes on" for name, failure in self._faults.copy().items())
        return "; ".join(told) or None


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
    """Called by the pipeline's thread with every estimate, after it is stored and shown."""

    def __init__(self, setup: Setup, store: Store) -> None:
        """Resumes from the stored batches."""
        self._store = store
        rules = Rules.of(setup.calibrated.vehicle) if setup.calibrated else Rules()
        self._ledger = restored(lambda: ledger_of(store.reader(), rules), Ledger(rules))

    def __call__(self, found: Estimate) -> None:
        for entry in self._ledger.add(found):
            text = json_line(entry.record)
            self._store.write_entry(entry.kind, entry.id, entry.t_end_ns, text, entry.revision)
            log_event(Event.ENTRY, level=logging.DEBUG, id=entry.id, revision=entry.revision)


def ledger_of(reader: StoreReader, rules: Rules) -> Ledger:
    """The ledger at the last stop of the service, restored from the journal. Raises what the store's reader raises."""
    page = reader.page((*BATCHES, REMAINDER), limit=HORIZON, newest_first=True, with_spectra=False)
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
