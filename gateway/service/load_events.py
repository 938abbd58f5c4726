"""Writes the load events and trips of each batch to the journal."""

import json
import logging
from collections.abc import Mapping
from typing import Any, Final

from gateway.core.change import Rules
from gateway.core.events.entry import Entry, EntryKind
from gateway.core.events.ledger import HORIZON, Ledger
from gateway.errors import StoreError
from gateway.estimate import Estimate
from gateway.estimate_json import INSTANT, estimate_from_json
from gateway.history import BATCHES, REMAINDER
from gateway.log import Event, log_event
from gateway.records import json_line
from gateway.setup import Setup
from gateway.store import Store, StoreReader

MOST: Final = 2 * HORIZON  # entries that so many batches can produce


class LoadEventLog:
    """Called by the pipeline's thread with every estimate, after it is stored and shown."""

    def __init__(self, setup: Setup, store: Store) -> None:
        """Resumes from the stored batches."""
        self._store = store
        rules = Rules.of(setup.calibrated.vehicle) if setup.calibrated else Rules()
        try:
            self._ledger = ledger_of(store.reader(), rules)
        except (StoreError, TimeoutError, ValueError, KeyError) as fault:  # the last two: another version's records
            log_event(Event.NOT_RESTORED, level=logging.WARNING, fault=str(fault))
            self._ledger = Ledger(rules)

    def __call__(self, found: Estimate) -> None:
        """Write the entries of this batch."""
        for entry in self._ledger.add(found):
            text = json_line(entry.record)
            self._store.write_entry(entry.kind, entry.id, entry.t_end_ns, text, entry.revision)
            log_event(Event.ENTRY, level=logging.DEBUG, id=entry.id, revision=entry.revision)


def ledger_of(reader: StoreReader, rules: Rules) -> Ledger:
    """The ledger at the last stop of the service, restored from the journal. Raises what the store's reader raises."""
    page = reader.page((*BATCHES, REMAINDER), limit=HORIZON, newest_first=True, with_spectra=False)
    estimates = [estimate_from_json(json.loads(text)) for text in reversed(page.items)]
    known: list[Entry] = []
    first_ns = min((one.t_start_ns for one in estimates), default=0)  # not the oldest's: clocks are put back
    for kind in EntryKind if estimates else ():
        told = reader.entries(kind=kind, since_ns=first_ns, limit=MOST, newest_first=True)
        known += (_entry(json.loads(text)) for text in told.items)
    return Ledger(rules, estimates, known)


def _entry(record: Mapping[str, Any]) -> Entry:
    kind = EntryKind(record["id"].partition("-")[0])
    return Entry(kind, record["id"], INSTANT.read(record["t_end"]), dict(record))
