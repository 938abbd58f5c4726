"""Load events and trips as they become known: each batch may bring new ones and sharpen those of the hours before.

    ledger = Ledger(rules)
    for estimate in estimates:
        for entry in ledger.add(estimate): ...      # new, or the same id with a higher revision

What comes out follows from the estimates in their order alone. A restarted service goes on from the estimates and the
entries that it stored; a log read from its beginning gives the same.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

from gateway.core.change import EVEN, Rules
from gateway.core.events.day import Day
from gateway.core.events.entry import Entry, EntryKind, is_news
from gateway.core.events.trips import trips_of
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_from_json, estimate_to_json

TOLD_FROM: Final = 0.9  # a change less likely than this is not told; one that was is withdrawn below one half
PLAIN_STDS: Final = 3.0  # so far beyond its doubt, a change at a stop is told whatever its probability
HORIZON: Final = 300  # batches that are looked at, a day of driving however long the vehicle rested between
SETTLED: Final = 150  # what ended before the last so many stays as it was told


class Ledger:
    """One vehicle's events and trips of its last batches."""

    def __init__(self, rules: Rules, estimates: Iterable[Estimate] = (), known: Iterable[Entry] = ()) -> None:
        """Go on from what was: the last estimates, and the last revision of each entry that was told of them."""
        self._rules = rules
        self._estimates = tuple(estimates)
        self._known = {entry.id: entry for entry in known}

    def add(self, estimate: Estimate) -> list[Entry]:
        """What one more batch, answered or not, tells that was not told before. Early looks tell nothing."""
        if estimate.is_provisional:
            return []
        self._estimates = (*self._estimates, as_stored(estimate))[-HORIZON:]
        first_ns = min(one.t_start_ns for one in self._estimates)
        self._known = {each: entry for each, entry in self._known.items() if entry.t_end_ns >= first_ns}
        told = []
        for entry in self._unsettled():
            if (news := self._news(entry)) is not None:
                self._known[news.id] = news
                told.append(news)
        return told

    def _unsettled(self) -> Iterator[Entry]:
        day = Day(self._estimates, self._rules)
        settled = day.clocks[-SETTLED:][0], self._estimates[-SETTLED:][0].t_start_ns
        for trip in trips_of(day, is_cut=len(self._estimates) == HORIZON):
            if (trip.clock, trip.t_end_ns) >= settled:
                yield trip
        yield from day.events(settled)

    def _news(self, entry: Entry) -> Entry | None:
        before = self._known.get(entry.id)
        if entry.kind is EntryKind.EVENT:
            needed = EVEN if before and not before.record["is_withdrawn"] else TOLD_FROM
            if entry.record["probability"] < needed and not _is_plain(entry):
                if before is None or before.record["is_withdrawn"]:
                    return None
                entry = replace(entry, record={**entry.record, "is_withdrawn": True})
        if before is None:
            return entry.revised(1)
        return entry.revised(before.revision + 1) if is_news(before, entry) else None


def _is_plain(entry: Entry) -> bool:
    """A stop at which the door did not stay shut, and a change far beyond its own doubt."""
    record = entry.record
    could_load = any(stop["door_opened"] is not False for stop in record["stops"])
    return could_load and bool(abs(record["change_kg"]) >= PLAIN_STDS * record["change_std_kg"])


def as_stored(estimate: Estimate) -> Estimate:
    """As it comes back from its JSON object: what is told must not hang on whether it was ever stored."""
    return estimate_from_json(estimate_to_json(replace(estimate, spectra=None)))
