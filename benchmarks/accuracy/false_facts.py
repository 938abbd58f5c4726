"""False facts at commissioning: simulated vans are commissioned with one false answer each, and with true ones.

Each passes the service's steps: the typed answers are checked (``doubts_of``), made a vehicle and compared with its
line; then its empty drive is fitted and compared with both (``contradictions``). A fact is caught if any step refuses
it or asks about it. No setting was chosen with these vans: the seed serves this study alone.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from pydantic import TypeAdapter, ValidationError

from benchmarks.accuracy.drives import AS_CALIBRATED, driven
from benchmarks.accuracy.lines import MIXED, SCOPE, Drawn, draw_line, drawn_van, sister
from benchmarks.accuracy.lines import Line as DrawnLine
from benchmarks.accuracy.markdown import Column, Row, page, table_of, text
from benchmarks.accuracy.study import Study
from gateway.calibration.commissioning.answers import NO_LINE, LineFacts, doubts_of, vehicle_table
from gateway.calibration.contradicted import contradictions
from gateway.calibration.half_car.fit import fit_cross_spectrum
from gateway.calibration.known_run import KnownRun
from gateway.calibration.line.line import Line, Sister, line_of
from gateway.errors import CampaignError, LineError
from gateway.sim.vans import VANS
from gateway.sim.vehicle import Load
from gateway.stated.facts import DIVISION_KG, VehicleAnswers

SEED: Final = 20304  # arbitrary, of this study alone
N_LINES: Final = 3  # chosen: one of each type
N_RIGHT: Final = 20  # chosen: true vehicles of all lines
POUNDS_PER_KG: Final = 1.0 / 0.45359237  # international pound
ABOARD_AT: Final = 0.7  # chosen: wheelbases behind the front axle
PASSED: Final = "passed"

Said = dict[str, Any]
Falsified = Callable[[Said], Said]


@dataclass(frozen=True, slots=True)
class Fact:
    """One false fact: its words, how it changes true answers, the load on board, and the chosen line."""

    words: str
    falsify: Falsified = dict
    aboard_kg: float = 0.0
    line: str = "own"


def _changed(**factors: float) -> Falsified:
    return lambda said: said | {name: factor * said[name] for name, factor in factors.items()}


def _weights(front: float, rear: float) -> Falsified:
    return _changed(kerb_front_axle_kg=front, kerb_rear_axle_kg=rear)


def _exchanged(said: Said) -> Said:
    return said | {
        "kerb_front_axle_kg": said["kerb_rear_axle_kg"],
        "kerb_rear_axle_kg": said["kerb_front_axle_kg"],
    }


def _moved(name: str, by: float) -> Falsified:
    return lambda said: said | {name: said[name] + by}


def _to_the_rear(said: Said) -> Said:
    """The same gross weight, 28 % of it in front."""
    gross_kg = said["kerb_front_axle_kg"] + said["kerb_rear_axle_kg"]
    return said | {"kerb_front_axle_kg": 0.28 * gross_kg, "kerb_rear_axle_kg": 0.72 * gross_kg}


FALSE: Final = (
    Fact("420 kg aboard, called empty", aboard_kg=420.0),
    Fact("200 kg aboard, called empty", aboard_kg=200.0),
    Fact("the line of another model", line="another"),
    Fact("the line of another model of the same wheelbase and mass", line="alike"),
    Fact("front and rear axle weight exchanged", _exchanged),
    Fact("the same gross weight, 28 % in front", _to_the_rear),
    Fact("axle weights in pounds", _weights(POUNDS_PER_KG, POUNDS_PER_KG)),
    Fact("front axle weight a decimal place too small", _weights(0.1, 1.0)),
    Fact("rear axle weight a decimal place too large", _weights(1.0, 10.0)),
    Fact("axle weights of the laden vehicle, a third more", _weights(1.1, 1.6)),
    Fact("axle weights 15 % too small", _weights(0.85, 0.85)),
    Fact("wheelbase 10 % too long", _changed(wheelbase_m=1.1)),
    Fact("wheelbase 10 % too short", _changed(wheelbase_m=0.9)),
    Fact("wheelbase in feet", _changed(wheelbase_m=1.0 / 0.3048)),
    Fact("sensor half a metre from where it is said to be", _moved("sensor_position_m", -0.5)),
    Fact("sensor measured in inches", _changed(sensor_position_m=1.0 / 0.0254)),
    Fact("track width in feet", _changed(track_width_m=1.0 / 0.3048)),
    Fact("largest payload a decimal place too large", lambda said: said | {"payload_range_kg": (0.0, 9000.0)}),
    Fact("permitted gross weight in tonnes", lambda said: said | {"gross_limit_kg": 3.5}),
    Fact("permitted front axle load of a car", lambda said: said | {"front_axle_limit_kg": 500.0}),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Tried:
    """One commissioning: the fact, with a line or without, and the check that caught it."""

    words: str
    has_line: bool
    caught_by: str


Found = tuple[list[Tried], list[Tried]]  # false facts, and true ones


def numbers(seed: int, n: int, lines: Sequence[Found]) -> dict[str, Any]:
    """Every false fact once in each line, and vans of these lines with true answers."""
    false, right = ([one for of_line in lines for one in of_line[which]] for which in (0, 1))
    return {
        "seed": seed,
        "n_lines": n,
        "rows": [_row(fact.words, false) for fact in FALSE],
        "right": {str(has): _counts(right, has_line=has) for has in (True, False)},
    }


@dataclass(frozen=True, slots=True)
class _Known:
    """A line as a fitter would choose it."""

    line: Line
    facts: LineFacts


def of_line(seed: int, number: int) -> Found:
    """All false facts in one line, and its part of the vans with true answers."""
    sister_seeds, false_seeds, right_seeds, other_seeds = np.random.SeedSequence([seed, number]).spawn(4)
    own = _known(_drawn(seed, number), sister_seeds)
    another_seeds, alike_seeds = other_seeds.spawn(2)
    alike = _known(_drawn(seed, number + len(VANS)), alike_seeds)
    lines = {
        "own": own,
        "another": _known(_drawn(seed, number + 1), another_seeds),
        "alike": _Known(
            replace(alike.line, wheelbase_m=own.line.wheelbase_m, empty_mass_kg=own.line.empty_mass_kg), own.facts
        ),
    }
    false: list[Tried] = []
    for fact, seeds in zip(FALSE, false_seeds.spawn(len(FALSE)), strict=True):
        van = drawn_van(_drawn(seed, number), "van", seeds)
        run = _empty_drive(van, fact.aboard_kg, is_mixed=False)
        said = fact.falsify(_answers(van))
        ways = (lines[fact.line], None) if fact.line == "own" else (lines[fact.line],)
        false += [Tried(fact.words, line is not None, _commissioned(said, run, line)) for line in ways]
    right: list[Tried] = []
    n_here = len(range(number % N_LINES, N_RIGHT, N_LINES))
    for i, seeds in enumerate(right_seeds.spawn(n_here)):
        van = drawn_van(_drawn(seed, number), "van", seeds)
        run = _empty_drive(van, 0.0, is_mixed=i % 2 == 1)
        right += [Tried("true", line is not None, _commissioned(_answers(van), run, line)) for line in (own, None)]
    return false, right


def _drawn(seed: int, number: int) -> DrawnLine:
    return draw_line(number, np.random.default_rng([seed, number]))


def _known(drawn: DrawnLine, seeds: np.random.SeedSequence) -> _Known:
    """A line of one sister, driven with known loads."""
    driven_sister = sister(drawn, "sister", seeds)
    vehicle = driven_sister.vehicle
    calibration = fit_cross_spectrum(driven_sister.runs, vehicle).calibration
    facts = LineFacts(
        sprung_kg=vehicle.empty_mass_kg, wheelbase_m=vehicle.wheelbase_m, track_width_m=vehicle.track_width_m
    )
    return _Known(line_of([Sister("sister", vehicle, calibration)]), facts)


def _answers(van: Drawn) -> Said:
    """The answers of a careful fitter, with scales of 20 kg."""
    share = van.van.empty_front_share_pct / 100.0
    front_kg = share * van.van.sprung_kg + 2.0 * van.van.front.wheel.unsprung_kg
    rear_kg = (1.0 - share) * van.van.sprung_kg + 2.0 * van.van.rear.wheel.unsprung_kg
    return {
        "kerb_front_axle_kg": DIVISION_KG * round(front_kg / DIVISION_KG),
        "kerb_rear_axle_kg": DIVISION_KG * round(rear_kg / DIVISION_KG),
        "wheelbase_m": round(van.van.wheelbase_m, 2),
        "sensor_position_m": round(van.vehicle.sensor_position_m, 2),
        "sensor_offset_left_m": round(float(van.vehicle.sensor_offset_left_m or 0.0), 2),
        "track_width_m": round(float(van.vehicle.track_width_m or 0.0), 2),
    }


def _empty_drive(van: Drawn, aboard_kg: float, *, is_mixed: bool) -> KnownRun:
    loads = (Load(aboard_kg, ABOARD_AT * van.van.wheelbase_m),) if aboard_kg else ()
    trip = MIXED if is_mixed else AS_CALIBRATED
    return driven(van.van, loads, trip, SCOPE, van.road_seeds, 1, van.sensors)


def _commissioned(said: Mapping[str, Any], run: KnownRun, known: _Known | None) -> str:
    """The check that refuses it or asks; ``PASSED`` if none does."""
    try:
        answers = TypeAdapter(VehicleAnswers).validate_python(dict(said))
        doubts = doubts_of(answers, known.facts if known else NO_LINE)
        vehicle = vehicle_table(answers, "van")
        if known is not None:
            known.line.prior_of(vehicle, with_roll=False)
    except ValidationError:
        return "bounds"
    except CampaignError:
        return "vehicle"
    except LineError:
        return "line"
    if doubts:
        return str(doubts[0].kind)
    empty = replace(run, payload_kg=0.0, front_share_pct=vehicle.empty_front_share_pct, payload_left_m=None)
    line = known.line if known else None
    calibration = fit_cross_spectrum([empty], vehicle, inherited=line).calibration
    found = contradictions([empty], vehicle, calibration, line)
    return str(found[0].kind) if found else PASSED


def _row(words: str, tried: Sequence[Tried]) -> dict[str, Any]:
    mine = [one for one in tried if one.words == words]
    return {"words": words, "with_line": _counts(mine, has_line=True), "without": _counts(mine, has_line=False)}


def _counts(tried: Sequence[Tried], *, has_line: bool) -> dict[str, Any]:
    mine = [one.caught_by for one in tried if one.has_line is has_line]
    caught = [by for by in mine if by != PASSED]
    return {"n": len(mine), "n_caught": len(caught), "by": sorted(set(caught))}


def false_facts_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown."""
    rows = found["rows"]
    n_with, n_without = (sum(row[way]["n_caught"] for row in rows) for way in ("with_line", "without"))
    of_with, of_without = (sum(row[way]["n"] for row in rows) for way in ("with_line", "without"))
    right_with, right_without = found["right"]["True"], found["right"]["False"]
    return page(
        "False facts at commissioning",
        "false-facts --output DIR",
        f"{len(rows)} false facts, each in a simulated van of each of {found['n_lines']} lines, stated as a fitter "
        "would type it; all else is true, axle weights read from scales of 20 kg. Each van is driven empty for ten "
        "minutes (two with a load aboard), its line is one sister calibrated with six known loads. Caught: typed "
        "answers are refused or asked about, or the drive contradicts them "
        "([commissioning](commissioning.md#doubts) lists what is asked).",
        "",
        *table_of(COLUMNS, rows),
        f"| **all** | **{n_with} of {of_with}** | **{n_without} of {of_without}** | |",
        "",
        f"True facts, {right_with['n']} other vans of the same lines, half of them driven mixed: "
        f"{right_with['n_caught']} asked about with their line, {right_without['n_caught']} without.",
        "",
        "Without a line the stiffness of the springs is unknown, and a load aboard looks like softer springs: "
        "only scales can show it. `bounds` is a number that no vehicle reaches, `line` a vehicle that its line "
        "refuses; the other names are those of the doubts.",
        "",
    )


def _caught(way: str) -> Callable[[Row], str]:
    return lambda row: f"{row[way]['n_caught']} of {row[way]['n']}" if row[way]["n"] else ""


def _by(row: Row) -> str:
    return ", ".join(f"`{by}`" for by in sorted({*row["with_line"]["by"], *row["without"]["by"]}))


COLUMNS: Final[tuple[Column, ...]] = (
    ("false fact", text("words")),
    ("caught with its line", _caught("with_line")),
    ("without a line", _caught("without")),
    ("by", _by),
)


STUDY: Final = Study(
    name="false-facts",
    does="Which false facts does commissioning catch, and does it accept true ones? ~3 minutes a line.",
    doing="commissioning simulated vans",
    of_case=of_line,
    numbers=numbers,
    page=false_facts_page,
    seed=SEED,
    n=N_LINES,
    counts="lines",
    least=1,
    kept_as=f"false-facts-{N_LINES}-{N_RIGHT}",
)
