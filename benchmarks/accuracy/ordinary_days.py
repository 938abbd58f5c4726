"""What a van has learnt after 1, 3, 10 and 30 ordinary days, and how well it then weighs.

Every van is fresh. When it is fitted it is driven empty, which is stated. Then each day it makes one tour of town,
country and motorway, in its state of that day, with a load of any shape at any place. WAYS says what is told of these
tours. Other tours, of other days, test what was learnt.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.calibrated import taught_by
from benchmarks.accuracy.drives import TRIPS, FreshVan, Scope, driven, fresh_van, known_loads, stated, unseen_load
from benchmarks.accuracy.false_statements import Said, axles_kg, note, said
from benchmarks.accuracy.false_statements import stated as stated_of
from benchmarks.accuracy.markdown import table
from benchmarks.accuracy.scatter import Scatter, scattered
from benchmarks.accuracy.study import Study
from benchmarks.accuracy.taught import SHARE_SPAN_PCT, taught, weighed
from gateway.calibration.stated_drive import StatedDrive
from gateway.calibration.teach import teach
from gateway.model.vehicle_model import VehicleModel

SEED: Final = 20281  # arbitrary, of this study alone
DAYS: Final = (1, 3, 10, 30)
SCOPE: Final = Scope(n_known_loads=10, mixed_s=960.0)  # three batches a tour
N_TESTS: Final = 6  # chosen: tours
DAY: Final = TRIPS["mixed, another day"]
LOW: Final = 0.9  # chosen: what notes say, of what is aboard
WRONG: Final = 0.05  # chosen: of the notes are another tour's
WEIGHED_ON: Final = 3  # chosen: the day on which axle scales are on the way
OF_A_MODEL: Final = Scatter(
    spring=0.04, progression=0.1, damper=0.08, friction=0.2, tyre=0.05, unsprung=0.03, sprung=0.03, cog_position=0.01,
    inertia=0.03,
)  # fmt: skip
"""Chosen: by how much vans of one model differ."""
FITTED: Final = "fitted"
EMPTY: Final = said("empty", payload_kg=0.0)
NOTHING, NOTES, SCALES, SISTER, KNOWN = WAYS = (
    "nothing stated",
    "a note on every tour, all 10 % low, 5 % of another tour",
    "axle scales once, on the third day",
    "nothing stated, a sister as prior",
    "ten known loads, no day",
)
Found = dict[str, list[list[float]]]
"""By way and day ("way|day"): a row for each batch of the tests, payload's error, its interval's half-width and how far
the interval misses, in percent of the payload range, the same of the share in percent of 20 points; or no number, for a
refused batch.
"""


def of_one_van(seed: int, number: int) -> Found:
    """What one van weighs by every way, after every number of days."""
    fresh = fresh_van(SCOPE, seed, number)
    tour_seed, told_seed, sister_seed = np.random.SeedSequence([seed, number, 1]).spawn(3)
    n_days = DAYS[-1]
    fitted, *tours = [
        driven(fresh.van, load, DAY, SCOPE, one, i, fresh.sensors)
        for i, (load, one) in enumerate(
            zip(
                [(), *(unseen_load(fresh.van, fresh.rng) for _ in range(n_days + N_TESTS))],
                tour_seed.spawn(1 + n_days + N_TESTS),
                strict=True,
            )
        )
    ]
    days, tests = tours[:n_days], tours[n_days:]
    told = {NOTHING: {}, NOTES: _notes(days, told_seed), SCALES: {WEIGHED_ON: _scales(days[WEIGHED_ON - 1], fresh)}}
    sister = _sister(fresh, sister_seed)
    found: Found = {}

    def keep(way: str, after: int, model: VehicleModel) -> None:
        found[f"{way}|{after}"] = _rows(tests, model, fresh)

    for after in DAYS:
        drives = {FITTED: fitted, **{str(day): one for day, one in enumerate(days[:after], 1)}}
        for way, by_day in told.items():
            statements = {FITTED: (EMPTY,), **{str(day): (one,) for day, one in by_day.items() if day <= after}}
            if way is not SCALES or after >= WEIGHED_ON:
                keep(way, after, _taught(drives, statements, fresh, None))
        keep(SISTER, after, _taught(drives, {FITTED: (EMPTY,)}, fresh, sister))
    keep(KNOWN, 0, taught_by(fresh.runs, fresh.vehicle))
    return found


def _taught(
    drives: Mapping[str, StatedDrive],
    told: Mapping[str, tuple[Said, ...]],
    fresh: FreshVan,
    sister: VehicleModel | None,
) -> VehicleModel:
    statements = stated_of(told, drives, fresh.vehicle).assigned.statements
    each = zip(drives.items(), statements, strict=True)
    said = [StatedDrive(name, run.batches, statement) for (name, run), statement in each]
    return teach(said, fresh.vehicle, sister).model


def _notes(days: Sequence[StatedDrive], seed: np.random.SeedSequence) -> dict[int, Said]:
    rng = np.random.default_rng(seed)
    said_of: dict[int, Said] = {}
    for day, run in enumerate(days, 1):
        of = days[int(rng.integers(len(days)))] if rng.random() < WRONG else run
        said_of[day] = note(LOW * of.payload_kg) if of.payload_kg else EMPTY
    return said_of


def _scales(run: StatedDrive, fresh: FreshVan) -> Said:
    """What axle scales show of this tour's load."""
    front_kg, rear_kg = axles_kg(run, fresh.vehicle)
    return said("axle_scales", front_axle_kg=front_kg, rear_axle_kg=rear_kg)


def _sister(fresh: FreshVan, seed: np.random.SeedSequence) -> VehicleModel:
    """What ten known loads teach of another van of the same model."""
    rng, *seeds = (np.random.default_rng(seed), *seed.spawn(SCOPE.n_known_loads))
    van = scattered(fresh.van, OF_A_MODEL, rng)
    loads = known_loads(van, SCOPE.n_known_loads, rng)
    runs = [
        driven(van, load, TRIPS["as calibrated"], SCOPE, one, i, fresh.sensors)
        for i, (load, one) in enumerate(zip(loads, seeds, strict=True), 1)
    ]
    return taught(runs, [run.statement for run in runs], stated(van, fresh.sensors))


def _rows(tests: Sequence[StatedDrive], model: VehicleModel, fresh: FreshVan) -> list[list[float]]:
    rows, refused = weighed(tests, model, fresh.vehicle)
    each = np.array(rows).reshape(-1, 2, 4) * (
        100.0 / np.array([fresh.vehicle.payload_range_kg[1], SHARE_SPAN_PCT])[:, None]
    )
    true, answer, low, high = np.moveaxis(each, 2, 0)
    missed = np.maximum(0.0, np.maximum(low - true, true - high))
    told = np.stack([abs(answer - true), 0.5 * (high - low), missed], axis=2).reshape(-1, 6)
    return [*np.round(told, 3).tolist(), *([] for _ in range(sum(refused.values())))]


def numbers(seed: int, n: int, cases: Sequence[Found]) -> dict[str, Any]:
    """The figures of every way and day over all vans."""
    lines = []
    for way in WAYS:
        for after in (0,) if way is KNOWN else DAYS:
            of_vans = [case[f"{way}|{after}"] for case in cases if f"{way}|{after}" in case]
            batches = [row for rows in of_vans for row in rows]
            if answered := np.array([row for row in batches if row]).reshape(-1, 6).tolist():
                lines.append({"way": way, "days": after, "refused": len(batches) - len(answered), **_figures(answered)})
                held = [np.mean([row[2] == 0.0 for row in rows if row]) for rows in of_vans if any(rows)]
                lines[-1]["least_held_of_a_van_pct"] = round(100.0 * float(min(held)), 1)
    return {"seed": seed, "n_vans": n, "lines": lines}


def _figures(answered: Sequence[Sequence[float]]) -> dict[str, Any]:
    rows = np.array(answered)
    told: dict[str, Any] = {"n": len(rows)}
    for name, (error, half, missed) in {"payload": rows[:, :3].T, "share": rows[:, 3:].T}.items():
        told[name] = {
            "error": round(float(error.mean()), 2),
            "half": round(float(half.mean()), 1),
            "held": round(100.0 * float(np.mean(missed == 0.0)), 1),
            "score": round(float(np.mean(2.0 * half + 40.0 * missed)), 1),
        }
    told["beyond_twice_pct"] = round(100.0 * float(np.mean(rows[:, 2] > rows[:, 1])), 1)
    return told


HEAD: Final = ("payload error, ±, and held, in %", *(f"after {after} d" for after in DAYS), "worst van held")


def section(found: Mapping[str, Any]) -> str:
    """A row for each way, with the least share that the intervals of one van held after the most days."""
    by_way: dict[str, dict[int, Mapping[str, Any]]] = {}
    for line in found["lines"]:
        by_way.setdefault(line["way"], {})[line["days"] or DAYS[-1]] = line
    rows = [
        [way, *(_cell(lines.get(after)) for after in DAYS), f"{lines[max(lines)]['least_held_of_a_van_pct']:.0f}"]
        for way, lines in by_way.items()
    ]
    return "\n".join([f"{found['n_vans']} vans.", "", *table(HEAD, rows), ""])


def _cell(line: Mapping[str, Any] | None) -> str:
    return "–" if line is None else "{error:.1f} ±{half:.0f} ({held:.0f})".format(**line["payload"])


STUDY: Final = Study(
    name="ordinary_days",
    does="What vans learn from ordinary days, and how well they then weigh; some ten minutes a van.",
    doing="letting vans learn from ordinary days",
    of_case=of_one_van,
    numbers=numbers,
    section=section,
    seed=SEED,
    n=20,
)
