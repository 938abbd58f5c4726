"""A stretch of estimates as load events and trips: a pure function of the batches.

A trip is one row per drive, with the load carried along its way:

    tonne-kilometres = sum over loads of payload x distance,    std = sum of std x distance

We add the standard deviations of different loads as if their errors were fully correlated: most of the error is.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Final

from gateway.core.change import Rules, change_of
from gateway.core.events.entry import Entry, EntryKind, entry_id, quantity_json
from gateway.core.loads import (
    SLACK_NS,
    FusedLoad,
    Halt,
    LoadLink,
    Loads,
    Weighing,
    clocks_of,
    follows,
    halts_of,
    links_of,
    loads_of,
    weighings_of,
)
from gateway.estimates.batch_estimate import NOWHERE, Estimate, Quantity, Way
from gateway.estimates.field_kinds import PLACE
from gateway.estimates.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD
from gateway.records import iso_utc, rounded
from gateway.units import NS_PER_S


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
            **quantity_json(change_of(before.posterior, after.posterior), "change", "kg", 1),
            "probability": round(probability, 4),
            "is_withdrawn": False,
            "place": PLACE.write(place),
            "stops": [_stop_json(halt) for halt in halts],
            "before": self._load_json(before),
            "after": self._load_json(after),
        }
        return Entry(EntryKind.EVENT, str(record["id"]), end_ns, record, link.clock)

    def _load_json(self, load: FusedLoad) -> dict[str, Any]:
        payload, share, cg_left = (load.posterior.quantity(i) for i in (PAYLOAD, FRONT_SHARE, CG_LEFT))
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
        "place": PLACE.write(halt.place),
    }


EMPTY_SHARE: Final = 0.03  # chosen: of the loaded vehicle's mass; a smaller payload counts as empty
ODOMETER_WITHIN: Final = 0.2  # chosen: of the distance by speed; a larger difference means that one of the two is wrong
ODOMETER_SLACK_M: Final = 200.0  # chosen: two steps of the coarsest odometer in use (100 m)
LEAST_TRIP_M: Final = 50.0  # chosen: a shorter drive is manoeuvring, or receiver noise
KG_M_PER_TONNE_KM: Final = 1e6  # 1000 kg x 1000 m


@dataclass(frozen=True, slots=True)
class _Piece:
    """One batch of a trip: its distance, its load (None: unknown), and whether it was overloaded."""

    distance_m: float
    load: FusedLoad | None
    is_overloaded: bool | None
    is_weighed: bool


def trips_of(day: Day, *, is_cut: bool = False) -> list[Entry]:
    """Every drive with a distance, in order; without a revision. ``is_cut``: the first drive may lack its beginning."""
    loads = _load_of_each(day)
    trips = (_trip(day, first, last, loads) for first, last in _drives(day.estimates) if first or not is_cut)
    return [trip for trip in trips if trip is not None]


def _drives(estimates: Sequence[Estimate]) -> Iterator[tuple[int, int]]:
    """First and last batch (inclusive) of each drive."""
    first = 0
    for i in range(len(estimates)):
        if i + 1 == len(estimates) or not follows(estimates[i], estimates[i + 1]):
            yield first, i
            first = i + 1


def _load_of_each(day: Day) -> list[FusedLoad | None]:
    """The load during each batch: as weighed, or as the nearest weighings agree without a long stop between."""
    whole = day.estimates
    of_weighing: dict[int, FusedLoad] = {}
    for weighing, load in zip(day.weighings, day.found.of_weighing, strict=True):
        at, one = weighing.at, whole[weighing.at]
        while at >= 0 and at not in of_weighing and one.t_start_ns <= whole[at].way_start_ns < one.t_end_ns:
            of_weighing[at] = load
            at -= 1
    ahead: list[FusedLoad | None] = []
    for i in range(len(whole)):
        goes_on = i > 0 and follows(whole[i - 1], whole[i])
        ahead.append(of_weighing.get(i, ahead[i - 1] if goes_on else None))
    back: list[FusedLoad | None] = [None] * len(whole)
    for i in reversed(range(len(whole))):
        goes_on = i + 1 < len(whole) and follows(whole[i], whole[i + 1])
        back[i] = of_weighing.get(i, back[i + 1] if goes_on else None)
    between: list[FusedLoad | None] = [None] * len(whole)
    for one_at, other_at in pairwise(sorted(of_weighing)):
        if of_weighing[one_at] is of_weighing[other_at]:
            between[one_at:other_at] = [of_weighing[one_at]] * (other_at - one_at)
    return [one or other or both for one, other, both in zip(ahead, back, between, strict=True)]


def _trip(day: Day, first: int, last: int, loads: Sequence[FusedLoad | None]) -> Entry | None:
    batches = day.estimates[first : last + 1]
    ways = [one.way for one in batches if one.way is not None]
    by_speed_m = sum(way.distance_m for way in ways if math.isfinite(way.distance_m))
    if not ways or by_speed_m < LEAST_TRIP_M:
        return None
    duration_s = (batches[-1].t_end_ns - batches[0].way_start_ns) / NS_PER_S
    distance_m, source = _distance(ways, by_speed_m, duration_s)
    scale = distance_m / by_speed_m
    pieces = [
        _Piece(one.way.distance_m * scale, load, _is_overloaded(day, one, load), one.counted)
        for one, load in zip(batches, loads[first : last + 1], strict=True)
        if one.way is not None and math.isfinite(one.way.distance_m)
    ]
    begin_ns, end_ns = batches[0].way_start_ns, _arrival_ns(batches)
    moving_s, known_s = sum(way.moving_s for way in ways), sum(way.known_s for way in ways)
    newest = day.estimates[-1]
    record: dict[str, Any] = {
        "id": entry_id(EntryKind.TRIP, newest.vehicle_id, begin_ns),
        "revision": 0,
        "vehicle_id": newest.vehicle_id,
        "t_start": iso_utc(begin_ns),
        "t_end": iso_utc(end_ns),
        "is_over": last + 1 < len(day.estimates),
        "from": PLACE.write(ways[0].start),
        "to": PLACE.write(ways[-1].end if ways[-1].end.is_known else NOWHERE),
        "distance_m": rounded(distance_m, 0),
        "distance_by": source,
        "unknown_s": rounded(max(0.0, duration_s - known_s), 1),
        "moving_s": rounded(moving_s, 1),
        "mean_speed_mps": rounded(by_speed_m / moving_s, 2) if moving_s > 0.0 else None,
        **_carried(day, pieces),
    }
    return Entry(EntryKind.TRIP, str(record["id"]), end_ns, record, day.clocks[last])


def _distance(ways: Sequence[Way], by_speed_m: float, duration_s: float) -> tuple[float, str]:
    """The distance in metres and its source: the odometer where it agrees with the speed or the speed has gaps, else
    the speed.
    """
    readings = [(way.odometer_start_m, way.odometer_end_m) for way in ways if math.isfinite(way.odometer_start_m)]
    if len(readings) == len(ways):
        odometer_m = readings[-1][1] - readings[0][0]
        unknown = 1.0 - sum(way.known_s for way in ways) / duration_s if duration_s > 0.0 else 0.0
        tolerance_m = (ODOMETER_WITHIN + max(0.0, unknown)) * odometer_m + ODOMETER_SLACK_M
        if odometer_m > 0.0 and abs(odometer_m - by_speed_m) <= tolerance_m:
            return odometer_m, "odometer"
    return by_speed_m, "speed"


def _carried(day: Day, pieces: Sequence[_Piece]) -> dict[str, Any]:
    """Tonne-kilometres and payload over the weighed part of the way."""
    weighed = [(piece.distance_m, piece.load) for piece in pieces if piece.load is not None]
    weighed_m = sum(distance_m for distance_m, _ in weighed)
    whole_m = sum(piece.distance_m for piece in pieces)
    judged = [piece for piece in pieces if piece.is_overloaded is not None]
    judged_m = sum(piece.distance_m for piece in judged)
    payload = tonne_km = Quantity()
    empty = overloaded = math.nan
    if weighed_m > 0.0:
        told = [(distance_m, load.posterior.quantity(PAYLOAD)) for distance_m, load in weighed if load is not None]
        kg_m = sum(distance_m * quantity.number for distance_m, quantity in told)
        kg_m_std = sum(distance_m * quantity.std for distance_m, quantity in told)
        payload = Quantity.normal(kg_m / weighed_m, kg_m_std / weighed_m)
        tonne_km = Quantity.normal(kg_m / KG_M_PER_TONNE_KM, kg_m_std / KG_M_PER_TONNE_KM)
        empty_kg = EMPTY_SHARE * day.rules.mass_kg
        empty = sum(distance_m for distance_m, quantity in told if quantity.number < empty_kg) / weighed_m
    if judged_m > 0.0:
        overloaded = sum(piece.distance_m for piece in judged if piece.is_overloaded) / judged_m
    return {
        **quantity_json(payload, "payload", "kg", 1),
        **quantity_json(tonne_km, "carried", "tkm", 4),
        "weighed_share": rounded(weighed_m / whole_m, 3) if whole_m > 0.0 else None,
        "empty_share": rounded(empty, 3),
        "overloaded_share": rounded(overloaded, 3),
        "n_weighed": sum(piece.is_weighed for piece in pieces),
    }


def _is_overloaded(day: Day, batch: Estimate, load: FusedLoad | None) -> bool | None:
    """Whether the load's mean exceeds the gross limit; None without a limit."""
    gross = batch.weights.gross
    if load is None or gross.limit_kg is None or not gross.is_known:
        return None
    return gross.kg - batch.payload.number + load.posterior.quantity(PAYLOAD).number > gross.limit_kg


def _arrival_ns(batches: Sequence[Estimate]) -> int:
    """The time at which the vehicle came to its last standstill, if that lasts to the end of the drive."""
    end_ns = arrival_ns = batches[-1].t_end_ns
    for batch in reversed(batches):
        stops = batch.way.stops if batch.way else ()
        if not stops or abs(stops[-1].t_end_ns - arrival_ns) > SLACK_NS:
            break
        arrival_ns = stops[-1].t_start_ns
        if abs(arrival_ns - batch.way_start_ns) > SLACK_NS:
            break
    return min(arrival_ns, end_ns)
