"""What a service needs of learning without fitting: which windows teach, their pieces, and which statements stand."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Any, Final

from gateway.calibration.assigned import Fate, Piece, cut
from gateway.calibration.statements_csv import ToldRow, ToldRows
from gateway.core.batch_settings import BatchSettings
from gateway.core.pool import LEAST_LOAD_S, can_be_pooled
from gateway.records import Batch
from gateway.stated.statement import StatementRecord
from gateway.units import NS_PER_S, S_PER_DAY
from gateway.words import counted as n_of

MOST_DRIVES: Final = 40  # chosen: a fit of so many takes minutes; more of the same teach little
ENOUGH_S: Final = 1800.0  # chosen: driving after which one drive teaches little more; the rest is not learnt from
HALVED_AFTER_DAYS: Final = 180.0  # chosen: springs, tyres and goods change with the seasons


STATES: Final[Mapping[Fate, str]] = {
    Fate.WAITING: "waiting",
    Fate.MATCHED: "waiting",  # for a drive that can teach
    Fate.OVERLAPPING: "held",
    Fate.REPLACED: "withdrawn",
    Fate.IMPOSSIBLE: "held",
}
PROBLEMS: Final[Mapping[Fate, str]] = {
    Fate.WAITING: "waits",
    Fate.OVERLAPPING: "overlap",
    Fate.REPLACED: "replaced",
    Fate.IMPOSSIBLE: "bad",
}


def can_teach(window: Batch, settings: BatchSettings) -> bool:
    """Whether a window has enough sound driving: also one that only lacks the length of a batch."""
    if window.is_provisional:
        return False
    is_enough = window.usable_s >= LEAST_LOAD_S and can_be_pooled(window, settings)
    return not window.rejected or is_enough


def spans_of(windows: Iterable[tuple[int, int, int]], at_ns: Sequence[int]) -> list[Piece]:
    """The pieces of drives by their windows: begin of the drive, begin and end of the window (ns)."""
    pieces: list[Piece] = []
    for number, (_, group) in enumerate(groupby(sorted(windows), lambda one: one[0]), 1):
        of_drive = list(group)
        bounds = cut(of_drive[0][1], max(end_ns for *_, end_ns in of_drive), at_ns)
        pieces += [Piece(begin_ns, end_ns, number) for begin_ns, end_ns in bounds]
    return pieces


def worth(usable_s: float, end_ns: int, newest_ns: int, *, is_stated: bool) -> tuple[bool, float]:
    """How much a drive teaches, for the choice of those that are fitted and of those that are kept: greater is more.

    A drive with a statement is worth more than any without; then driving counts, and half as much after half a year.
    """
    age_days = (newest_ns - end_ns) / NS_PER_S / S_PER_DAY
    return is_stated, min(usable_s, ENOUGH_S) * 0.5 ** (age_days / HALVED_AFTER_DAYS)


def teaching_most(drives: Sequence[tuple[float, int, bool]]) -> list[int]:
    """Which MOST_DRIVES of these teach most, in their order: of each its driving (s), its end (ns), and whether a
    statement is about it.
    """
    newest_ns = max((end_ns for _, end_ns, _ in drives), default=0)

    def value(i: int) -> tuple[tuple[bool, float], int]:
        usable_s, end_ns, is_stated = drives[i]
        return worth(usable_s, end_ns, newest_ns, is_stated=is_stated), i

    return sorted(sorted(range(len(drives)), key=value, reverse=True)[:MOST_DRIVES])


def standing(records: Iterable[StatementRecord]) -> list[StatementRecord]:
    """Those that stand, of records in the order in which they were made, in an order of their own.

    A later record with the ref of an earlier one replaces it; the same record twice counts once. So what is learnt does
    not depend on the order in which statements arrive.
    """
    by_id = {one.id: one for one in records}
    by_ref = {one.ref: one.id for one in by_id.values() if one.ref}
    kept = [one for one in by_id.values() if not one.ref or by_ref[one.ref] == one.id]
    return sorted(kept, key=lambda one: (one.from_ns, one.id))


def rows_record(
    told: ToldRows, mine: Sequence[ToldRow], fates: Mapping[str, tuple[Fate, str]], this_one: str
) -> dict[str, Any]:
    """What became of the rows of a table before any fit. ``mine`` are those of this vehicle, ``fates`` their records'
    by id, without those that a later one replaces; ``this_one`` names the vehicle.
    """
    problems: list[dict[str, Any]] = [
        {"row": number, "kind": "bad", "text": line.partition(": ")[2]}
        for number, lines in told.faults.items()
        for line in lines
    ]
    own = {row.number for row in mine}
    problems += [
        {"row": row.number, "kind": "unknown_vehicle", "text": f"vehicle: {row.vehicle}: this one is {this_one}"}
        for row in told.rows
        if row.number not in own
    ]
    n_match = 0
    for row in mine:
        fate, why = fates.get(row.record.id, (Fate.REPLACED, f"replaced by a later one with the ref {row.record.ref}"))
        n_match += fate is Fate.MATCHED
        if fate in PROBLEMS:
            problems.append({"row": row.number, "kind": PROBLEMS[fate], "text": why})
    problems.sort(key=lambda one: (one["row"], one["text"]))
    return {"n_rows": told.n_rows, "n_match": n_match, "problems": problems, "notes": list(told.notes)}


def rows_told(n_rows: int, n_match: int, problems: Sequence[Mapping[str, Any]]) -> str:
    """ "38 rows: 31 match a drive, 4 wait, 2 overlap (rows 9, 10), 1 unknown vehicle (row 12)"."""
    of_kind = {
        kind: sorted({one["row"] for one in problems if one["kind"] == kind})
        for kind in ("waits", "overlap", "replaced", "unknown_vehicle", "bad")
    }
    n_wait = len(of_kind.pop("waits"))
    parts = [f"{n_match} {'matches' if n_match == 1 else 'match'} a drive"]
    parts += [f"{n_wait} {'waits' if n_wait == 1 else 'wait'}"] if n_wait else []
    for kind, numbers in of_kind.items():
        if numbers:
            named = f"row{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"
            parts.append(f"{len(numbers)} {kind.replace('_', ' ')} ({named})")
    return f"{n_of(n_rows, 'row')}: {', '.join(parts)}"
