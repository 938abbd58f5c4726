"""A stretch of estimates as load events and trips: a pure function of the batches."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from gateway.core.change import Rules, change_of
from gateway.core.events.entry import Entry, EntryKind, entry_id, quantity_json, rounded
from gateway.core.loads import (
    FusedLoad,
    Halt,
    LoadLink,
    Loads,
    Weighing,
    clocks_of,
    halts_of,
    links_of,
    loads_of,
    weighings_of,
)
from gateway.estimate import NOWHERE, Estimate
from gateway.estimate_json.way import place_to_json
from gateway.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD
from gateway.records import iso_utc


@dataclass(frozen=True)
class Day:
    """Batches in order of arrival, and the weighings, halts and loads that follow from them."""

    estimates: tuple[Estimate, ...]
    rules: Rules

    @cached_property
    def weighings(self) -> list[Weighing]:
        return weighings_of(self.estimates)

    @cached_property
    def clocks(self) -> list[int]:
        return clocks_of(self.estimates)

    @cached_property
    def halts(self) -> list[Halt]:
        return halts_of(self.estimates)

    @cached_property
    def links(self) -> list[LoadLink]:
        return links_of(self.estimates, self.weighings, self.halts)

    @cached_property
    def found(self) -> Loads:
        return loads_of(self.weighings, self.links, self.rules)

    def events(self, since: tuple[int, int] = (0, 0)) -> Iterator[Entry]:
        """One record per link between weighings, however unlikely a change is; without a revision. ``since`` is the
        clock and the time (ns) of the earliest end.
        """
        for at, link in enumerate(self.links):
            is_one_scale = self.weighings[at].by == self.weighings[at + 1].by
            if is_one_scale and (link.clock, link.span_ns[1]) >= since:
                yield self._event(at)

    def _event(self, at: int) -> Entry:
        link, halts = self.links[at], self.links[at].likely
        before, after = self.found.sides(at)
        probability = self.found.probability(at)
        begin_ns, end_ns = link.span_ns
        place = halts[0].place if len(halts) == 1 else NOWHERE
        newest = self.estimates[-1]
        first = self.estimates[self.weighings[at + 1].at]  # never changes: the id is derived from it
        record = {
            "id": entry_id(EntryKind.EVENT, newest.vehicle_id, first.t_start_ns),
            "revision": 0,
            "vehicle_id": newest.vehicle_id,
            "t_start": iso_utc(begin_ns),
            "t_end": iso_utc(end_ns),
            **quantity_json(change_of(before.measured, after.measured), "change", "kg", 1),
            "probability": round(probability, 4),
            "is_withdrawn": False,
            "place": place_to_json(place),
            "stops": [_stop_json(halt) for halt in halts],
            "before": self._load_json(before),
            "after": self._load_json(after),
        }
        return Entry(EntryKind.EVENT, str(record["id"]), end_ns, record, link.clock)

    def _load_json(self, load: FusedLoad) -> dict[str, Any]:
        payload, share, cg_left = (load.shown.quantity(i) for i in (PAYLOAD, FRONT_SHARE, CG_LEFT))
        record: dict[str, Any] = quantity_json(payload, "payload", "kg", 1)
        record |= {"front_share_pct": rounded(share.number, 2), "front_share_std_pct": rounded(share.std, 2)}
        record |= {"cg_left_m": rounded(cg_left.number, 4), "cg_left_std_m": rounded(cg_left.std, 4)}
        return record | {"n_batches": load.n_batches}


def _stop_json(halt: Halt) -> dict[str, Any]:
    return {
        "t_start": iso_utc(halt.t_start_ns),
        "t_end": iso_utc(halt.t_end_ns),
        "door_opened": halt.watched.door_opened,
        "ignition_off": halt.watched.ignition_off,
        "place": place_to_json(halt.place),
    }
