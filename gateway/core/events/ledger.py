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

from gateway.core.events.change import Rules
from gateway.core.events.day import Day
from gateway.core.events.entry import Entry, EntryKind, is_news
from gateway.core.events.loads import EVEN
from gateway.core.events.trips import trips_of
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_from_json, estimate_to_json
from gateway.units import NS_PER_S

TOLD_FROM: Final = 0.9  # a change less likely than this is not told; one that was is withdrawn below one half
HORIZON_NS: Final = 24 * 3600 * NS_PER_S  # batches older than this are no longer looked at
SETTLED_NS: Final = 12 * 3600 * NS_PER_S  # and what is older than this stays as it was told


class Ledger:
    """One vehicle's events and trips of the last day."""

    def __init__(self, rules: Rules, estimates: Iterable[Estimate] = (), known: Iterable[Entry] = ()) -> None:
        """Go on from what was: estimates of the last day, and the last revision of each entry that was told."""
        self._rules = rules
        self._estimates = tuple(estimates)
        self._known = {entry.id: entry for entry in known}

    def add(self, estimate: Estimate) -> list[Entry]:
        """What one more batch, answered or not, tells that was not told before. Early looks tell nothing."""
        if estimate.is_provisional:
            return []
        now_ns = estimate.t_end_ns
        self._estimates = tuple(
            one for one in (*self._estimates, as_stored(estimate)) if abs(now_ns - one.t_end_ns) < HORIZON_NS
        )
        self._known = {each: entry for each, entry in self._known.items() if abs(now_ns - entry.t_end_ns) < HORIZON_NS}
        told = []
        for entry in self._entries():
            if now_ns - entry.t_end_ns < SETTLED_NS and (news := self._news(entry)) is not None:
                self._known[news.id] = news
                told.append(news)
        return told

    def _entries(self) -> Iterator[Entry]:
        day = Day(self._estimates, self._rules)
        yield from trips_of(day)
        yield from day.events()

    def _news(self, entry: Entry) -> Entry | None:
        before = self._known.get(entry.id)
        if entry.kind is EntryKind.EVENT:
            probability = entry.record["probability"]
            if probability < (EVEN if before and not before.record["is_withdrawn"] else TOLD_FROM):
                if before is None or before.record["is_withdrawn"]:
                    return None
                entry = replace(entry, record={**entry.record, "is_withdrawn": True})
        if before is None:
            return entry.revised(1)
        return entry.revised(before.revision + 1) if is_news(before, entry) else None


def as_stored(estimate: Estimate) -> Estimate:
    """As it comes back from its JSON object: what is told must not hang on whether it was ever stored."""
    return estimate_from_json(estimate_to_json(replace(estimate, spectra=None)))
