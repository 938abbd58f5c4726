"""What false statements do to a vehicle that learns from recorded drives.

    python -m benchmarks.accuracy.false_statements DATA [--output docs]

One empty drive and five mixed ones of the recorded van teach, each with a statement: empty, or a delivery note with an
error of its own. Then one statement, or all, are false in one of the ways of KINDS. For each way the study counts the
false statements that were refused before any fit, held, weakened or used, and the true ones that were accused, and
weighs three other drives with the vehicle that was learnt. In a last run all eight mixed drives teach: with true notes,
with notes that are all 10 % low, with and without one weighing on a scale, and with two notes exchanged.
"""

import argparse
import json
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from benchmarks.accuracy.markdown import table
from benchmarks.accuracy.taught import line_of, runs_of, weighed, whole
from gateway.calibration.assigned import Assigned, Fate, Piece, assign
from gateway.calibration.campaign_file import load_campaign
from gateway.calibration.found import ClaimState, FoundClaim, Taught
from gateway.calibration.learning.told import common_errors, question
from gateway.calibration.stated_drive import StatedDrive
from gateway.calibration.statements import Statement
from gateway.calibration.teach import teach
from gateway.core.batch_settings import BatchSettings
from gateway.core.vehicle import Vehicle
from gateway.estimates.quantity import Z95
from gateway.model.table import UNSPRUNG_SHARE
from gateway.offline.campaigns import split_runs
from gateway.records import F64, Batch
from gateway.stated.statement import StatementRecord

SEED: Final = 11
NOTE_PLUS_MINUS_KG: Final = 25.0
FIRST_DAY: Final = datetime(2026, 3, 2, 8, tzinfo=UTC)
MOST_DRIVE: Final = timedelta(hours=1)

STEADY: Final = "steady empty"
TEACH: Final = {"358 kg": 0, "130 kg": 1, "empty": 3, "436 kg": 5, "208 kg": 6}
TEST: Final = (2, 4, 7)
NOTES: Final = tuple(name for name in TEACH if name != "empty")

Said = dict[str, Any]
"""A statement record; without a time it is of the drive's begin."""
Told = dict[str, tuple[Said, ...]]
"""What is stated of each drive."""


def said(source: str, place: Mapping[str, float] | None = None, **load: float) -> Said:
    """One statement."""
    return {"source": source, "load": load} | ({} if place is None else {"place": dict(place)})


def note(payload_kg: float, **place: float) -> Said:
    """A delivery note."""
    return said("delivery_note", place or None, payload_kg=max(payload_kg, 0.0), plus_minus_kg=NOTE_PLUS_MINUS_KG)


EMPTY: Final = said("empty", payload_kg=0.0)
TRUE: Final = "true"  # the note of a statement that is true although others of its drive are false


def axles_kg(run: StatedDrive, vehicle: Vehicle) -> tuple[float, float]:
    """What scales show of the front and the rear axle under the load of a drive."""
    share, below_kg = 0.01 * run.front_share_pct, UNSPRUNG_SHARE * vehicle.empty_mass_kg
    sprung_kg = vehicle.empty_mass_kg + run.payload_kg
    return below_kg + share * sprung_kg, below_kg + (1.0 - share) * sprung_kg


@dataclass(frozen=True)
class Recorded:
    """The recorded van: its drives by name, the drives to test on, and the true statements."""

    vehicle: Vehicle
    drives: Mapping[str, StatedDrive]
    tests: tuple[StatedDrive, ...]
    told: Told

    def kg(self, name: str) -> float:
        """The true payload of a drive."""
        return self.drives[name].payload_kg

    def gross_kg(self, name: str) -> float:
        """What scales show of the whole vehicle."""
        return (1.0 + 2.0 * UNSPRUNG_SHARE) * self.vehicle.empty_mass_kg + self.kg(name)

    def axles_kg(self, name: str) -> tuple[float, float]:
        """What scales show of the front and the rear axle."""
        return axles_kg(self.drives[name], self.vehicle)

    def place_m(self, name: str) -> float:
        """The payload's place behind the front axle."""
        of_load_kg = 0.01 * self.drives[name].front_share_pct * (self.vehicle.empty_mass_kg + self.kg(name))
        of_load_kg -= self.vehicle.empty_front_share * self.vehicle.empty_mass_kg
        return self.vehicle.wheelbase_m * (1.0 - of_load_kg / self.kg(name))


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of false statement: the drives that it concerns, and what it says. ``unloaded``: a drive whose load
    became that of another drive halfway.
    """

    title: str
    false: tuple[str, ...]
    tell: Callable[[Recorded], Mapping[str, Sequence[Said]]]
    unloaded: tuple[str, str] | None = None


def _shifted(of: Recorded) -> dict[str, Sequence[Said]]:
    """Each note stands at the drive after its own."""
    return dict(zip((*NOTES[1:], NOTES[0]), (of.told[name] for name in NOTES), strict=True))


def _times(of: Recorded, factor: float) -> dict[str, Sequence[Said]]:
    return {name: [note(factor * one["load"]["payload_kg"]) for one in of.told[name]] for name in NOTES}


def _exchanged(one: str, other: str) -> Callable[[Recorded], Mapping[str, Sequence[Said]]]:
    return lambda of: {one: of.told[other], other: of.told[one]}


def _axles(front_kg: float, rear_kg: float) -> Said:
    return said("axle_scales", front_axle_kg=front_kg, rear_axle_kg=rear_kg)


def _ticket(gross_kg: float) -> Said:
    """A true one, beside a false note of the same load."""
    return said("scale", gross_kg=gross_kg) | {"note": TRUE}


KINDS: Final = (
    Kind("nothing is false", (), lambda of: {}),
    Kind("note of another van: 95 kg for 436", ("436 kg",), lambda of: {"436 kg": [note(95.0)]}),
    Kind("note at the wrong day: 436 kg for an empty one", ("empty",), lambda of: {"empty": [note(436.0)]}),
    Kind(
        "note of another year",
        ("436 kg",),
        lambda of: {"436 kg": [note(of.kg("436 kg")) | {"from": FIRST_DAY - timedelta(days=362)}]},
    ),
    Kind("gross for net", ("436 kg",), lambda of: {"436 kg": [note(of.gross_kg("436 kg"))]}),
    Kind("net for gross", ("436 kg",), lambda of: {"436 kg": [said("scale", gross_kg=of.kg("436 kg"))]}),
    Kind("pounds: 458 for 208 kg", ("208 kg",), lambda of: {"208 kg": [note(2.20462 * of.kg("208 kg"))]}),
    Kind("pounds: 961 for 436 kg", ("436 kg",), lambda of: {"436 kg": [note(2.20462 * of.kg("436 kg"))]}),
    Kind("tonnes", ("436 kg",), lambda of: {"436 kg": [note(0.001 * of.kg("436 kg"))]}),
    Kind("a digit missing", ("436 kg",), lambda of: {"436 kg": [note(0.1 * of.kg("436 kg"))]}),
    Kind("two digits exchanged: 346 for 436 kg", ("436 kg",), lambda of: {"436 kg": [note(346.0)]}),
    Kind("empty with 436 kg", ("436 kg",), lambda of: {"436 kg": [EMPTY]}),
    Kind("empty with 130 kg", ("130 kg",), lambda of: {"130 kg": [EMPTY]}),
    Kind(
        "the only empty one has 130 kg aboard",
        ("130 kg",),
        lambda of: {STEADY: [], "empty": [], "130 kg": [EMPTY]},
    ),
    Kind("a note, but nothing was loaded", ("empty",), lambda of: {"empty": [note(208.0)]}),
    Kind("axles exchanged", ("436 kg",), lambda of: {"436 kg": [_axles(*reversed(of.axles_kg("436 kg")))]}),
    Kind(
        "place measured from the rear axle",
        ("436 kg",),
        lambda of: {
            "436 kg": [
                note(
                    of.kg("436 kg"),
                    behind_front_axle_m=of.vehicle.wheelbase_m - of.place_m("436 kg"),
                    plus_minus_m=0.2,
                )
            ]
        },
    ),
    Kind(
        "place in centimetres",
        ("436 kg",),
        lambda of: {"436 kg": [note(of.kg("436 kg"), behind_front_axle_m=100.0 * of.place_m("436 kg"))]},
    ),
    Kind(
        "two notes for one load, half each",
        ("436 kg",),
        lambda of: {"436 kg": [note(0.5 * of.kg("436 kg")), note(0.5 * of.kg("436 kg") + 1.0)]},
    ),
    Kind("one of two notes is missing", ("436 kg",), lambda of: {"436 kg": [note(0.5 * of.kg("436 kg"))]}),
    Kind("the load noted twice", ("208 kg",), lambda of: {"208 kg": [note(2.0 * of.kg("208 kg"))]}),
    Kind("half a tour: unloaded at half", ("436 kg",), lambda of: {}, ("436 kg", "empty")),
    Kind("two notes exchanged: 436 and 130 kg", ("436 kg", "130 kg"), _exchanged("436 kg", "130 kg")),
    Kind("two notes exchanged: 358 and 208 kg", ("358 kg", "208 kg"), _exchanged("358 kg", "208 kg")),
    Kind("every note one drive late", NOTES, _shifted),
    Kind("all notes 10 % low", NOTES, lambda of: _times(of, 0.9)),
    Kind(
        "all notes 10 % low, and a scale ticket",
        NOTES,
        lambda of: _times(of, 0.9) | {"436 kg": [*_times(of, 0.9)["436 kg"], _ticket(of.gross_kg("436 kg"))]},
    ),
    Kind("all notes 25 % low", NOTES, lambda of: _times(of, 0.75)),
    Kind("the same 250 kg on every note", NOTES, lambda of: {name: [note(250.0)] for name in NOTES}),
    Kind(
        "weighed with three people aboard",
        ("436 kg",),
        lambda of: {"436 kg": [said("scale", gross_kg=of.gross_kg("436 kg") + 240.0)]},
    ),
    Kind(
        "229 kg dropped are written as taken aboard",
        ("208 kg",),
        lambda of: {"208 kg": [said("delivery_note", change_kg=of.kg("436 kg") - of.kg("208 kg"), plus_minus_kg=10.0)]},
    ),
    Kind(
        "a guess, 60 kg high, as a weighed load",
        ("358 kg",),
        lambda of: {"358 kg": [said("known", payload_kg=of.kg("358 kg") + 60.0)]},
    ),
)
"""The first is for comparison."""


@dataclass(frozen=True, slots=True)
class Stated:
    """Statements as records, each with the drive that it was meant for, what became of them before any fit, and the
    faults of those that are no records.
    """

    records: tuple[tuple[str, StatementRecord], ...]
    assigned: Assigned
    faults: tuple[str, ...]


def stated(told: Mapping[str, Sequence[Said]], names: Iterable[str], vehicle: Vehicle) -> Stated:
    """What is told of drives with these names, one a day."""
    records: list[tuple[str, StatementRecord]] = []
    faults: list[str] = []
    pieces = []
    for day, name in enumerate(names):
        begin = FIRST_DAY + timedelta(days=day)
        begin_ns, end_ns = (round(at.timestamp()) * 1_000_000_000 for at in (begin, begin + MOST_DRIVE))
        pieces.append(Piece(begin_ns, end_ns, day))
        for number, one in enumerate(told.get(name, ())):
            try:
                record = StatementRecord.model_validate({"from": begin, **one, "id": f"{name}, {number}"})
            except ValidationError as fault:
                faults += [f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in fault.errors()]
                continue
            records.append((name, record))
    return Stated(tuple(records), assign([record for _, record in records], pieces, vehicle), tuple(faults))


def taught_by(said: Stated, drives: Mapping[str, StatedDrive], vehicle: Vehicle) -> Taught:
    """The vehicle that these drives teach."""
    each = zip(drives.items(), said.assigned.statements, strict=True)
    return teach([StatedDrive(name, run.batches, statement) for (name, run), statement in each], vehicle)


def outcome(said: Stated, taught: Taught, false: Collection[str], vehicle: Vehicle) -> dict[str, Any]:
    """States of the false statements and of the true ones, and what is said about the false ones."""
    states: dict[str, list[str]] = {"false": ["refused"] * len(said.faults), "true": []}
    asked: list[str] = [*said.faults]
    by_name: dict[str, list[FoundClaim]] = {}
    for claim in taught.claims:
        by_name.setdefault(claim.name, []).append(claim)
    became = zip(said.records, said.assigned.fates, said.assigned.reasons, strict=True)
    for (drive, record), fate, reason in became:
        is_false = drive in false and record.note != TRUE
        claims = by_name.get(record.id, [])
        state = "refused"
        if fate is Fate.MATCHED and claims:
            worst = max(claims, key=lambda one: one.disagreement)
            state = str(worst.state)
            if is_false and worst.state is not ClaimState.USED:
                asked.append(question(worst, record, vehicle))
        elif is_false:
            asked.append(reason)
        states["false" if is_false else "true"].append(state)
    asked += common_errors(taught.causes)
    return {"states": states, "asked": asked}


def shown_without(taught: Taught, drives: Mapping[str, StatedDrive]) -> dict[str, float]:
    """Error (kg) and held share (%) of what each drive with a statement shows without it."""
    off = np.array([
        (one.without_kg - drives[one.name].payload_kg, Z95 * one.without_std_kg)
        for one in taught.loads
        if np.isfinite(one.without_kg)
    ])  # fmt: skip
    return {
        "error_kg": round(float(np.mean(np.abs(off[:, 0]))), 1),
        "held_pct": round(100.0 * float(np.mean(np.abs(off[:, 0]) <= off[:, 1])), 1),
    }


def _half(batches: tuple[Batch, ...], later: tuple[Batch, ...]) -> tuple[Batch, ...]:
    return batches[: len(batches) // 2] + later[len(later) // 2 :]


def told_by(kind: Kind, of: Recorded) -> Told:
    """What is told of each drive."""
    return of.told | {name: tuple(one) for name, one in kind.tell(of).items()}


@dataclass(frozen=True, slots=True)
class Lesson:
    """The vehicle that drives with statements taught, and what it weighs on other drives."""

    taught: Taught
    rows: list[F64]
    refused: Counter[str]


Lessons = dict[tuple[str, tuple[Statement, ...]], Lesson]
"""By the statements that were left before the fit; what is refused leaves the same as nothing said."""


def tried(kind: Kind, of: Recorded, before: Lessons) -> dict[str, Any]:
    """One kind of false statement; ``before`` holds the fits of other kinds, and gets this one."""
    drives = dict(of.drives)
    if kind.unloaded is not None:
        name, emptied = kind.unloaded
        drives[name] = replace(drives[name], batches=_half(drives[name].batches, drives[emptied].batches))
    said = stated(told_by(kind, of), drives, of.vehicle)
    key = "" if kind.unloaded is None else kind.title, said.assigned.statements
    if key not in before:
        taught = taught_by(said, drives, of.vehicle)
        before[key] = Lesson(taught, *weighed(of.tests, taught.model, of.vehicle))
    lesson = before[key]
    span_kg = of.vehicle.payload_range_kg[1] - of.vehicle.payload_range_kg[0]
    weighs = line_of(kind.title, lesson.rows, lesson.refused, span_kg)
    return outcome(said, lesson.taught, kind.false, of.vehicle) | {"weighs": weighs}


def recorded(data: Path) -> tuple[Recorded, list[StatedDrive]]:
    """The drives of known_loads and mixed, and all the mixed ones."""
    campaign = load_campaign(data / "known_loads" / "campaign_roll.toml")
    [steady] = split_runs(campaign, BatchSettings(), numbers=[1])
    vehicle, *both = runs_of(data / "mixed")
    mixed = whole(*both)
    return recorded_of(vehicle, whole([steady.identification], [steady.validation])[0], mixed), mixed


def recorded_of(vehicle: Vehicle, steady: StatedDrive, mixed: Sequence[StatedDrive]) -> Recorded:
    """The drives with notes that err by chance."""
    rng = np.random.default_rng(SEED)
    drives = {STEADY: steady, **{name: mixed[i] for name, i in TEACH.items()}}
    notes = {
        name: (note(drives[name].payload_kg + float(rng.normal(0.0, NOTE_PLUS_MINUS_KG / Z95))),) for name in NOTES
    }
    return Recorded(vehicle, drives, tuple(mixed[i] for i in TEST), {STEADY: (EMPTY,), "empty": (EMPTY,), **notes})


def of_all(of: Recorded, mixed: Sequence[StatedDrive]) -> Iterator[dict[str, Any]]:
    """All mixed drives teach beside the empty one, with notes that are true or false in four ways."""
    rng = np.random.default_rng(SEED)
    drives = {STEADY: of.drives[STEADY], **{f"drive {number}": run for number, run in enumerate(mixed, 1)}}
    whole_van = replace(of, drives=drives)
    notes: dict[str, tuple[Said, ...]] = {STEADY: (EMPTY,)}
    for name, run in list(drives.items())[1:]:
        off_kg = float(rng.normal(0.0, NOTE_PLUS_MINUS_KG / Z95))
        notes[name] = (note(run.payload_kg + off_kg),) if run.payload_kg else (EMPTY,)
    loaded = [name for name, run in drives.items() if run.payload_kg]
    low = notes | {name: (note(0.9 * notes[name][0]["load"]["payload_kg"]),) for name in loaded}
    weighed_one = "drive 8"
    ticket = _ticket(whole_van.gross_kg(weighed_one))
    sets: tuple[tuple[str, Sequence[str], Mapping[str, tuple[Said, ...]]], ...] = (
        ("true notes", (), notes),
        ("all notes 10 % low", loaded, low),
        ("all notes 10 % low, one scale ticket", loaded, low | {weighed_one: (*low[weighed_one], ticket)}),
        (
            "two notes exchanged, 436 and 130 kg",
            ("drive 2", "drive 6"),
            notes | {"drive 2": notes["drive 6"], "drive 6": notes["drive 2"]},
        ),
    )
    for title, false, told in sets:
        said_of_all = stated(told, drives, of.vehicle)
        taught = taught_by(said_of_all, drives, of.vehicle)
        found = {"title": title, **outcome(said_of_all, taught, false, of.vehicle), **shown_without(taught, drives)}
        print(found, flush=True)
        yield found


def study(of: Recorded, mixed: Sequence[StatedDrive]) -> dict[str, Any]:
    """Both tables."""
    lessons: Lessons = {}
    return {"kinds": [tried(kind, of, lessons) for kind in KINDS], "all": list(of_all(of, mixed))}


# -- as a page shows it --

_ORDER: Final = ("refused", "held", "weak", "used")


def _counted(states: Sequence[str]) -> str:
    parts = [f"{states.count(state)} {state}" for state in _ORDER if state in states]
    return ", ".join(parts) if len(states) > 1 else (states[0] if states else "–")


def _accused(states: Sequence[str]) -> str:
    accused = [state for state in states if state != "used"]
    return _counted(accused) if len(accused) != 1 else f"1 {accused[0]}"


KINDS_HEAD: Final = ("the false ones are", "of these kinds", "true ones accused", "error %", "± %")
ALL_HEAD: Final = ("all eight mixed drives", "the false ones", "true ones accused", "error kg", "held %")


def section(found: Mapping[str, Any]) -> str:
    """Kinds by what becomes of the false statements, and the table of all drives, in Markdown."""
    by_state: dict[str, list[Mapping[str, Any]]] = {}
    for one in found["kinds"]:
        by_state.setdefault(max(one["states"]["false"], key=_ORDER.index, default="–"), []).append(one)
    kinds = [
        [
            state,
            "; ".join(one["weighs"]["title"] for one in ones),
            _accused([state for one in ones for state in one["states"]["true"]]),
            *(_span([one["weighs"]["payload"][name] for one in ones]) for name in ("error", "half")),
        ]
        for state in ("–", *_ORDER)
        if (ones := by_state.get(state))
    ]
    every = [
        [one["title"], _counted(one["states"]["false"]), _accused(one["states"]["true"]), f"{one['error_kg']:.0f}",
         f"{one['held_pct']:.0f}"]
        for one in found["all"]
    ]  # fmt: skip
    return "\n".join([*table(KINDS_HEAD, kinds), "", *table(ALL_HEAD, every), ""])


def _span(numbers: Sequence[float]) -> str:
    low, high = min(numbers), max(numbers)
    return f"{low:.1f}" if low == high else f"{low:.1f} to {high:.1f}"


def main() -> None:
    """Print every kind, and write them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder of recorded campaigns")
    parser.add_argument("--output", type=Path, default=None, help="folder for false_statements.json")
    asked = parser.parse_args()
    found = study(*recorded(asked.data))
    if asked.output is not None:
        (asked.output / "false_statements.json").write_text(f"{json.dumps(found, indent=1)}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
