"""Load events and trips as they become known: each batch may add new ones and refine recent ones.

    ledger = Ledger(rules)
    for estimate in estimates:
        for entry in ledger.add(estimate): ...      # new, or the same id with a higher revision

The output depends on the estimates and their order alone. A restarted service resumes from its stored estimates and
records; reading a log from its beginning gives the same.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

from gateway.core.change import EVEN, Rules
from gateway.core.events.day import Day, trips_of
from gateway.core.events.entry import Entry, EntryKind, is_news
from gateway.estimates.as_json import estimate_from_json, estimate_to_json
from gateway.estimates.batch_estimate import Estimate

TOLD_FROM: Final = 0.9  # chosen: a less likely change is not reported; a reported one is withdrawn below 0.5
PLAIN_STDS: Final = (
    3.0  # chosen: a change at a stop that is this many stds from 0 is reported regardless of its probability
)
HORIZON: Final = 300  # chosen: batches considered, about a day of driving without its rests
SETTLED: Final = 150  # chosen: a record that ended before the last 150 batches no longer changes


class Ledger:
    """The events and trips of one vehicle's last batches."""

    def __init__(self, rules: Rules, estimates: Iterable[Estimate] = (), known: Iterable[Entry] = ()) -> None:
        """Resume from the last estimates and from the last revision of each reported record."""
        self._rules = rules
        self._estimates = tuple(estimates)
        self._known = {entry.id: entry for entry in known}

    def add(self, estimate: Estimate) -> list[Entry]:
        """The records that one more batch, counted or refused, adds or changes. Provisional estimates change none."""
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
    """Whether the change was at a stop where the door may have opened, and is far beyond its standard deviation."""
    record = entry.record
    could_load = any(stop["door_opened"] is not False for stop in record["stops"])
    return could_load and bool(abs(record["change_kg"]) >= PLAIN_STDS * record["change_std_kg"])


def as_stored(estimate: Estimate) -> Estimate:
    """The estimate as read back from its JSON object, so that the result does not depend on whether it was stored."""
    return estimate_from_json(estimate_to_json(replace(estimate, spectra=None)))
