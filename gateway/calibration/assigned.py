"""From statements as people make them to what is stated of each drive.

    assigned = assign(records, pieces, vehicle)

A piece is a drive, or a part of one between two moments at which a statement begins or ends (:func:`moments`). A
statement holds for a piece whose middle lies within it. Without ``until`` it holds to the end of its drive, the one
under way or the next, for after a stop of a minute the load may be another; or to the next statement of its kind.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from math import hypot, inf, sqrt
from types import MappingProxyType
from typing import Final

from gateway.calibration.statements import NOTHING_KNOWN, Claim, Statement, is_in_tonnes
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.core.weights.on_the_road import unsprung_kg
from gateway.estimates.quantity import Z95
from gateway.model.table import ESTIMATED_UNSPRUNG_STD, UNSPRUNG_SHARE
from gateway.records import iso_utc
from gateway.stated.statement import StatementRecord, StatementSource
from gateway.units import NS_PER_S

SLACK_S: Final = 120.0  # chosen: people write times to a minute or two
MOST_WAIT_S: Final = 12.0 * 3600.0  # chosen: longer before a drive, somebody else may have loaded or unloaded
PIECE_PLUS_MINUS_KG: Final = 1.0  # chosen: fuel and driver between two pieces under one statement
PLACE_PLUS_MINUS_M: Final = 0.5  # chosen: of a place that nobody measured
LEFT_PLUS_MINUS_M: Final = 0.1  # chosen: likewise across
BIAS: Final[Mapping[StatementSource, tuple[float, float]]] = MappingProxyType(
    {
        StatementSource.DELIVERY_NOTE: (0.1, 0.0),  # packaging and what is always aboard
        StatementSource.SCALE: (0.0, 5.0),  # driver and tank, compared with the empty vehicle as it was weighed
        StatementSource.AXLE_SCALES: (0.0, 5.0),
    }
)
"""Chosen: standard deviation of the error that all statements of a source share: part of the payload, and kg."""
PLUS_MINUS_KG: Final[Mapping[StatementSource, float]] = MappingProxyType(
    {
        StatementSource.EMPTY: 10.0,  # driver and tank
        StatementSource.DELIVERY_NOTE: 25.0,
        StatementSource.SCALE: 12.0,  # a weighbridge with steps of 20 kg
        StatementSource.AXLE_SCALES: 12.0,
        StatementSource.KNOWN: 4.0,
    }
)
"""Chosen: half the 95 % interval of a weight that states none."""
NOTE_PLUS_MINUS_SHARE: Final = 0.05  # chosen: of a large payload by its note
MOST_PAYLOADS: Final = 2.0  # chosen: times the largest payload; more is another unit or another vehicle
MOST_LIGHTER_SHARE: Final = 0.1  # chosen: of the empty mass, by which scales may show less than the empty vehicle
SHARES: Final = (0.05, 0.95)  # chosen: on the front axle


class Fate(StrEnum):
    """What became of a record before any fit."""

    MATCHED = "matched"
    WAITING = "waiting"
    OVERLAPPING = "overlapping"
    REPLACED = "replaced"
    IMPOSSIBLE = "impossible"


@dataclass(frozen=True, slots=True)
class Piece:
    """A drive, or a part of one; pieces of one drive have its number."""

    begin_ns: int
    end_ns: int
    drive: int

    @property
    def middle_ns(self) -> int:
        """Halfway."""
        return (self.begin_ns + self.end_ns) // 2

    def meets(self, begin_ns: int, end_ns: int) -> bool:
        """Whether it has a time in common with another span."""
        return self.begin_ns < end_ns and begin_ns < self.end_ns


@dataclass(frozen=True, slots=True)
class Assigned:
    """What is stated of each piece; what became of each record, and why; and the records that hold for each piece,
    those included that are not learnt from.
    """

    statements: tuple[Statement, ...]
    fates: tuple[Fate, ...]
    reasons: tuple[str, ...]
    holding: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True)
class Weight:
    """A payload by a record: what it is, and the standard deviations (kg) of its errors by cause."""

    payload_kg: float
    errors: tuple[tuple[str, float], ...]
    front_share_pct: float | None = None
    front_share_plus_minus_pct: float = inf


class ImpossibleError(Exception):
    """A record that cannot be true of this vehicle; the message says how to mend it."""


def moments(records: Sequence[StatementRecord]) -> list[int]:
    """The times (ns) at which a record begins or ends, in order."""
    return sorted({at for one in records for at in (one.from_ns, one.until_ns) if at is not None})


def cut(begin_ns: int, end_ns: int, at_ns: Sequence[int]) -> list[tuple[int, int]]:
    """A drive as pieces, cut at these moments unless they are as good as its begin or its end."""
    slack_ns = round(SLACK_S * NS_PER_S)
    inside = [t_ns for t_ns in at_ns if begin_ns + slack_ns < t_ns < end_ns - slack_ns]
    return list(pairwise([begin_ns, *inside, end_ns]))


def assign(records: Sequence[StatementRecord], pieces: Sequence[Piece], vehicle: Vehicle) -> Assigned:
    """What ``records`` of one vehicle, in the order in which they were made, say of its ``pieces``, in order of time.

    A later record with the ref of an earlier one replaces it. Two records of one source that overlap are both set
    aside, for nobody knows which is meant.
    """
    fates = [Fate.WAITING] * len(records)
    reasons = [""] * len(records)
    for i, later in _replaced(records).items():
        fates[i], reasons[i] = Fate.REPLACED, f"replaced by a later one with the ref {records[later].ref}"
    spans = _spans(records, [i for i, fate in enumerate(fates) if fate is Fate.WAITING], pieces)
    for i, others in _overlapping(records, spans).items():
        fates[i], reasons[i] = Fate.OVERLAPPING, f"of the same time as {_named(others, records)}"
    weights: dict[int, Weight] = {}
    for i in sorted(spans, key=lambda i: (records[i].from_ns, i)):
        if fates[i] is not Fate.OVERLAPPING:
            try:
                weights[i] = _weight(i, records, spans, weights, vehicle)
            except ImpossibleError as fault:
                fates[i], reasons[i] = Fate.IMPOSSIBLE, str(fault)
    holding = [[i for i in weights if _holds(spans[i], piece)] for piece in pieces]
    for i in weights:
        if any(i in found for found in holding):
            fates[i] = Fate.MATCHED
        else:
            reasons[i] = _why_waiting(records[i], spans[i])
    statements = [_stated([i for i in found if records[i].learn], records, weights) for found in holding]
    return Assigned(tuple(statements), tuple(fates), tuple(reasons), tuple(map(tuple, holding)))


def _replaced(records: Sequence[StatementRecord]) -> dict[int, int]:
    """Of each record that a later one replaces, which one."""
    newest = {one.ref: i for i, one in enumerate(records) if one.ref}
    return {i: newest[one.ref] for i, one in enumerate(records) if one.ref and newest[one.ref] != i}


@dataclass(frozen=True, slots=True)
class _Span:
    """When a record holds; without an end of its own only for one drive, -1 as long as there is none."""

    begin_ns: int
    end_ns: float
    drive: int | None


def _spans(records: Sequence[StatementRecord], kept: Sequence[int], pieces: Sequence[Piece]) -> dict[int, _Span]:
    """When each of the records ``kept`` holds. A change of load holds as long as the statement that it changes."""
    slack_ns, wait_ns = round(SLACK_S * NS_PER_S), round(MOST_WAIT_S * NS_PER_S)
    spans: dict[int, _Span] = {}
    until_ns: int | None = None
    ordered = sorted(kept, key=lambda i: (records[i].from_ns, i))
    for place, i in enumerate(ordered):
        one = records[i]
        is_within = one.load.change_kg is not None and one.until_ns is None and (until_ns or 0) > one.from_ns
        until_ns = until_ns if is_within else one.until_ns
        end_ns = _next_change_ns(one, (records[j] for j in ordered[place + 1 :]), until_ns)
        if until_ns is not None:
            spans[i] = _Span(one.from_ns, end_ns, None)
            continue
        begun_ns = one.from_ns
        drives = [piece.drive for piece in pieces if piece.end_ns - slack_ns > begun_ns >= piece.begin_ns - wait_ns]
        spans[i] = _Span(one.from_ns, end_ns, drives[0] if drives else -1)
    return spans


def _next_change_ns(one: StatementRecord, after: Iterable[StatementRecord], until_ns: int | None) -> float:
    """When the record ends at the latest: at ``until_ns``, or as soon as a later one changes the load; without an end
    of its own also as soon as a later one has its source. ``after`` are in order of time.
    """
    for other in after:
        if until_ns is not None and other.from_ns >= until_ns:
            break
        is_new = _changes(other, one) or (until_ns is None and other.source is one.source)
        if other.from_ns > one.from_ns and is_new:
            return other.from_ns
    return inf if until_ns is None else until_ns


def _changes(later: StatementRecord, earlier: StatementRecord) -> bool:
    """Whether the load of the earlier statement is no longer aboard when the later one begins."""
    return later.load.change_kg is not None or (later.source is StatementSource.EMPTY) is not (
        earlier.source is StatementSource.EMPTY
    )


def _holds(span: _Span, piece: Piece) -> bool:
    is_of_drive = span.drive is None or span.drive == piece.drive
    return is_of_drive and span.begin_ns <= piece.middle_ns < span.end_ns


def _overlapping(records: Sequence[StatementRecord], spans: Mapping[int, _Span]) -> dict[int, list[int]]:
    """Of each record those of its source that overlap with it by more than people's times are off."""
    slack_ns = round(SLACK_S * NS_PER_S)
    found: dict[int, list[int]] = {}
    ordered = sorted(spans, key=lambda i: (spans[i].begin_ns, i))
    for place, i in enumerate(ordered):
        one = spans[i]
        for j in ordered[place + 1 :]:
            other = spans[j]
            if other.begin_ns > one.begin_ns and other.begin_ns >= one.end_ns:
                break
            common_ns = min(one.end_ns, other.end_ns) - other.begin_ns
            is_same = one.begin_ns == other.begin_ns
            if records[i].source is records[j].source and (common_ns > slack_ns or is_same):
                found.setdefault(i, []).append(j)
                found.setdefault(j, []).append(i)
    return {i: sorted(others, key=lambda j: (spans[j].begin_ns, j)) for i, others in found.items()}


def _named(which: Sequence[int], records: Sequence[StatementRecord]) -> str:
    return ", ".join(records[i].ref or f"that from {iso_utc(records[i].from_ns)[:16]}Z" for i in which)


def _why_waiting(one: StatementRecord, span: _Span) -> str:
    if one.until_ns is None and span.drive == -1:
        return f"no drive within {MOST_WAIT_S / 3600.0:g} hours of {iso_utc(one.from_ns)[:16]}Z is over yet"
    if one.until_ns is None:
        return "another statement began before the middle of the drive"
    return f"no drive from {iso_utc(one.from_ns)[:16]}Z to {iso_utc(one.until_ns)[:16]}Z"


def _weight(
    i: int,
    records: Sequence[StatementRecord],
    spans: Mapping[int, _Span],
    weights: Mapping[int, Weight],
    vehicle: Vehicle,
) -> Weight:
    """The payload of record ``i``; ``weights`` are those of the records before it. Raises ImpossibleError."""
    one, load = records[i], records[i].load
    if load.change_kg is not None:
        found = _changed(i, records, spans, weights)
    elif load.payload_kg is not None:
        found = _of_payload(one, load.payload_kg)
        if is_in_tonnes(load.payload_kg, vehicle):
            raise ImpossibleError(
                f"payload_kg: {load.payload_kg:g} kg is no load of a vehicle of {vehicle.empty_mass_kg:g} kg: write "
                f"{1000.0 * load.payload_kg:g} if these are tonnes"
            )
    else:
        found = _of_scales(one, vehicle)
    _require_possible(one, found, vehicle)
    return found


def _errors(one: StatementRecord, payload_kg: float, plus_minus_kg: float, by: float = 0.0) -> Weight:
    part, bias_kg = BIAS.get(one.source, (0.0, 0.0))
    shared = hypot(part * payload_kg, bias_kg, by)
    errors = [(one.id, plus_minus_kg / Z95), *([(str(one.source), shared)] if shared else [])]
    return Weight(payload_kg, tuple(errors))


def _of_payload(one: StatementRecord, payload_kg: float) -> Weight:
    usual_kg = PLUS_MINUS_KG[one.source]
    if one.source is StatementSource.DELIVERY_NOTE:
        usual_kg = max(usual_kg, NOTE_PLUS_MINUS_SHARE * payload_kg)
    return _errors(one, payload_kg, one.load.plus_minus_kg or usual_kg)


def _of_scales(one: StatementRecord, vehicle: Vehicle) -> Weight:
    """Statics: what scales show is the sprung mass M + L and the unsprung masses u of both axles.

        L = G - M - u_front - u_rear,    D = (F_front - u_front) / (M + L)

    Unsprung masses that nobody stated, and that no kerb weight tells, have the usual share of the sprung mass with its
    scatter: the error is the same at every weighing.
    """
    load, step_kg = one.load, one.load.plus_minus_kg or PLUS_MINUS_KG[one.source]
    front, rear = (_unsprung(kg, vehicle) for kg in unsprung_kg(vehicle))
    below_kg, below_std_kg = front[0] + rear[0], hypot(front[1], rear[1])
    if load.gross_kg is not None:
        payload_kg = load.gross_kg - vehicle.empty_mass_kg - below_kg
        _require_gross(one, load.gross_kg, payload_kg, vehicle)
        return _errors(one, payload_kg, step_kg, below_std_kg)
    front_kg, rear_kg = load.front_axle_kg or 0.0, load.rear_axle_kg or 0.0
    payload_kg = front_kg + rear_kg - vehicle.empty_mass_kg - below_kg
    _require_gross(one, front_kg + rear_kg, payload_kg, vehicle)
    sprung_kg = vehicle.empty_mass_kg + payload_kg
    share = (front_kg - front[0]) / sprung_kg
    if not SHARES[0] < share < SHARES[1]:
        raise ImpossibleError(
            f"front_axle_kg, rear_axle_kg: {front_kg:g} and {rear_kg:g} kg put {100.0 * share:.0f} % of the sprung "
            "mass on the front axle: read the scale slip again, axle by axle"
        )
    by_step = hypot(1.0 - share, share) * step_kg / Z95
    share_std = hypot(by_step, front[1]) / sprung_kg
    weight = _errors(one, payload_kg, sqrt(2.0) * step_kg, below_std_kg)
    return replace(weight, front_share_pct=100.0 * share, front_share_plus_minus_pct=100.0 * Z95 * share_std)


def _unsprung(stated_kg: float, vehicle: Vehicle) -> tuple[float, float]:
    """An axle's unsprung mass and its standard deviation (kg)."""
    usual_kg = UNSPRUNG_SHARE * vehicle.empty_mass_kg
    return (stated_kg, 0.0) if stated_kg == stated_kg else (usual_kg, ESTIMATED_UNSPRUNG_STD * usual_kg)  # noqa: PLR0124


def _require_gross(one: StatementRecord, gross_kg: float, payload_kg: float, vehicle: Vehicle) -> None:
    if payload_kg < -MOST_LIGHTER_SHARE * vehicle.empty_mass_kg:
        key = "gross_kg" if one.load.gross_kg is not None else "front_axle_kg, rear_axle_kg"
        raise ImpossibleError(
            f"{key}: {gross_kg:g} kg are {-payload_kg:.0f} kg less than the empty vehicle: write payload_kg if that is "
            "the load alone; or is it another vehicle's?"
        )


def _require_possible(one: StatementRecord, found: Weight, vehicle: Vehicle) -> None:
    most_kg, payload_kg = vehicle.largest_payload_kg, found.payload_kg
    key = next(name for name in ("payload_kg", "change_kg", "gross_kg", "front_axle_kg")
               if getattr(one.load, name) is not None)  # fmt: skip
    if payload_kg > MOST_PAYLOADS * most_kg:
        gross = key == "payload_kg" and payload_kg > vehicle.empty_mass_kg
        meant = "write gross_kg if that is the whole vehicle" if gross else "is it in pounds, or another vehicle's?"
        raise ImpossibleError(
            f"{key}: a payload of {payload_kg:.0f} kg is more than {MOST_PAYLOADS:g} times what the vehicle may carry "
            f"({most_kg:.0f} kg): {meant}"
        )
    place_m = None if one.place is None else one.place.behind_front_axle_m
    if place_m is not None and payload_kg > 0.0:
        share_pct = front_share_pct(vehicle, payload_kg, place_m)
        if not 100.0 * SHARES[0] < share_pct < 100.0 * SHARES[1]:
            raise ImpossibleError(
                f"behind_front_axle_m: {payload_kg:.0f} kg at {place_m:g} m would put {share_pct:.0f} % of the weight "
                "on the front axle; it is measured from the front axle rearwards, in metres"
            )


def _changed(
    i: int, records: Sequence[StatementRecord], spans: Mapping[int, _Span], weights: Mapping[int, Weight]
) -> Weight:
    """By the statement in force until record ``i``, whose errors it inherits."""
    one, slack_ns = records[i], round(SLACK_S * NS_PER_S)
    before = [j for j in weights if records[j].from_ns < one.from_ns]
    if not before:
        raise ImpossibleError(
            "change_kg: no statement of the load before it: state payload_kg, gross_kg or axle weights"
        )
    last = max(before, key=lambda j: (records[j].from_ns, j))
    end_ns = spans[last].end_ns
    if records[last].until_ns is not None and end_ns < one.from_ns - slack_ns:
        raise ImpossibleError(
            f"change_kg: the statement before it ended at {iso_utc(round(end_ns))[:16]}Z: state payload_kg, or extend "
            "that one"
        )
    change_kg = one.load.change_kg or 0.0
    own = (one.id, (one.load.plus_minus_kg or PLUS_MINUS_KG[StatementSource.EMPTY]) / Z95)
    base = weights[last]
    payload_kg = base.payload_kg + change_kg
    if payload_kg < -Z95 * hypot(own[1], *(std for _, std in base.errors)):
        raise ImpossibleError(
            f"change_kg: {change_kg:+g} kg would leave {payload_kg:.0f} kg of the {base.payload_kg:.0f} kg aboard: "
            "dropped is negative; or is a statement missing before it?"
        )
    return Weight(payload_kg, (*base.errors, own))


def _stated(which: Sequence[int], records: Sequence[StatementRecord], weights: Mapping[int, Weight]) -> Statement:
    """What several records say of one load: each one's word on the payload, and the place by the surest."""
    if not which:
        return NOTHING_KNOWN
    claims = [
        Claim(
            name=records[i].id,
            payload_kg=weights[i].payload_kg,
            plus_minus_kg=PIECE_PLUS_MINUS_KG,
            shared=weights[i].errors,
            is_confirmed=records[i].confirmed,
        )
        for i in which
    ]
    surest = min(zip(claims, which, strict=True), key=lambda pair: pair[0].std_kg)[1]
    statement = Statement(source=records[surest].source).saying(claims)
    shapes = [shape.carries for i in which if (shape := records[i].shape) is not None and shape.carries is not None]
    if shapes:
        statement = replace(statement, carries=shapes[-1])
    placed = [i for i in which if _place_plus_minus_m(records[i]) < inf or weights[i].front_share_pct is not None]
    if not placed or all(weights[i].payload_kg == 0.0 for i in which):
        return statement
    by = min(placed, key=lambda i: (weights[i].front_share_pct is None, _place_plus_minus_m(records[i])))
    place, weight = records[by].place, weights[by]
    return replace(
        statement,
        placed_by=records[by].id,
        position_m=None if place is None or weight.front_share_pct is not None else place.behind_front_axle_m,
        position_plus_minus_m=min(_place_plus_minus_m(records[by]), 20.0),
        front_share_pct=weight.front_share_pct,
        front_share_plus_minus_pct=min(weight.front_share_plus_minus_pct, 100.0),
        left_m=None if place is None else place.left_m,
        left_plus_minus_m=LEFT_PLUS_MINUS_M,
    )


def _place_plus_minus_m(one: StatementRecord) -> float:
    """Half the 95 % interval of a record's place; infinite if it states none."""
    if one.place is None or (one.place.behind_front_axle_m is None and one.place.left_m is None):
        return inf
    if one.place.behind_front_axle_m is None:
        return PLACE_PLUS_MINUS_M
    return one.place.plus_minus_m or PLACE_PLUS_MINUS_M
