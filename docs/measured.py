"""The parts of pages made from measurements: the JSON files of docs/, which benchmarks, studies and tests wrote.

``record`` and ``take`` copy the results of the last test runs there (docs/make.py --record, --counts).
"""

import json
import re
import sys
import tomllib
from itertools import groupby
from textwrap import fill
from typing import Any, Final

from made import DOCS, ROOT, numbers, table

sys.path.insert(0, str(ROOT))
from benchmarks.accuracy import coverage, disturbances, false_statements, ordinary_days  # benchmarks are not installed
from benchmarks.accuracy import faults as faults_of_sensors
from benchmarks.speed.table import Line, lines_of

# -- accuracy --

SAMPLE: Final = re.compile(
    r"(?P<mark><!-- (?P<n>\d+) lines of docs/tutorial.md, from: (?P<first>[^\n]+) -->\n)"
    r".*?(?P<end><!-- end of output -->)",
    re.DOTALL,
)


PAYLOAD_KG: Final = 700.0  # of the van in README: what it may carry
TOLD: Final = {
    "one empty drive": "one empty drive at an even speed",
    "nothing said": "one empty drive, four drives without a statement",
    "delivery notes": "one empty drive, four drives with delivery notes that are right to 6 % of the payload range",
    "ten known loads": "ten steady drives with weighed loads",
}


def kilograms() -> str:
    """What a van was told, and how well it weighs then, from the best to the worst of the three recorded vans."""
    lines = numbers("taught.json")["lines"]

    def between(told: str, figure: str, unit: str, of: float) -> str:
        found = sorted(of * line["payload"][figure] for line in lines if line["title"].endswith(f": {told}"))
        low, high = (f"{one:.0f}" for one in (found[0], found[-1]))
        return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"

    kg = PAYLOAD_KG / 100.0
    return table(
        "the van was told | usual error | stated ± (95 %) | held",
        (
            (text, between(told, "error", "kg", kg), between(told, "half", "kg", kg), between(told, "held", "%", 1.0))
            for told, text in TOLD.items()
        ),
    )


def taught() -> str:
    """Every set of drives that taught vehicles weighed: payload in percent of the range, share of 20 points."""
    found = numbers("taught.json")
    figures = ("error", "held", "half")

    def cell(figure: float | None, name: str) -> str:
        return "–" if figure is None else f"{figure:.{0 if name == 'held' else 1}f}"

    def row(line: dict[str, Any]) -> tuple[str, ...]:
        parts = [cell(line[of][name], name) for of in ("payload", "share") for name in figures]
        return line["title"].replace("_", " "), str(line["n"]), str(line["refused"]), *parts

    head = "drives | batches | refused | payload error | held | ± | share error | held | ±"
    return table(head, (row(line) for line in found["lines"] if line["n"] or line["refused"]))


ACCURACY: Final = {
    "taught": taught,
    "ordinary_days": lambda: ordinary_days.section(numbers("ordinary_days.json")),
    "false_statements": lambda: false_statements.section(numbers("false_statements.json")),
    "coverage": lambda: coverage.section(numbers("coverage.json")),
    "disturbances": lambda: disturbances.section(numbers("disturbances.json")),
    "faults": lambda: faults_of_sensors.section(numbers("sensor-faults.json")),
}
"""The parts of docs/accuracy.md."""


def with_samples(text: str) -> str:
    """``text`` with the samples of the tutorial's outputs as they are in the tutorial."""
    return SAMPLE.sub(_sample, text)


def _sample(place: re.Match[str]) -> str:
    """This many lines of the tutorial, from the first with the given beginning. Raises ValueError if there is none."""
    lines = (DOCS / "tutorial.md").read_text(encoding="utf-8").splitlines()
    first = next((number for number, line in enumerate(lines) if line.startswith(place["first"])), None)
    if first is None:
        raise ValueError(f"docs/tutorial.md has no line that begins with {place['first']!r}, which README.md shows")
    shown = "\n".join(lines[first : first + int(place["n"])])
    return f"{place['mark']}```text\n{shown}\n```\n{place['end']}"


# -- speed --


def conditions() -> str:
    """Where and how `make bench` measured, and the goals that were missed."""
    found = numbers("performance.json")
    where = found["conditions"]
    packages = ", ".join(f"{name} {version}" for name, version in where["packages"].items())
    goals = [line for line in lines_of(found) if line.goal]
    missed = [line for line in goals if not line.is_met]
    measured = (
        f"Measured by `make bench`{', cut short by `--quick`,' if where['is_quick'] else ''} on {where['machine']}, "
        f"Python {where['python']}, with {packages}. The load average was {where['load_average_before']:.1f} before "
        f"and {where['load_average_after']:.1f} after."
    )
    verdict = f"{len(goals) - len(missed)} of {len(goals)} goals are met"
    listed = "; ".join(f"{line.what} ({line.section.partition(':')[0]})" for line in missed)
    return f"{fill(measured, 120)}\n\n{fill(f'{verdict}. Missed: {listed}.' if missed else f'{verdict}.', 120)}\n"


def speeds() -> str:
    """A table for each section of the benchmarks."""
    found = {name: part for name, part in numbers("performance.json").items() if name != "simulator"}
    sections = groupby(lines_of(found), key=lambda line: line.section)
    return "\n".join(
        f"## {name[0].upper()}{name[1:]}\n\n"
        + table("what | measured | goal", ((line.what, line.figure, _goal(line)) for line in lines))
        for name, lines in sections
    )


def _goal(line: Line) -> str:
    return line.goal and f"{line.goal}: {'met' if line.is_met else 'missed'}"


# -- faults --

RECORDED: Final = {
    "vm-results.json": "faults.json",
    "soak.json": "soak.json",
    "vm-soak.json": "soak_faults.json",
}
"""What a run leaves in build/, and where it is kept."""

# Test, what it does, and the figures that tell how often, over how many records, and what the disk lost
ENDURED = (
    (
        "test_repeated_kills_lose_and_double_nothing",
        "SIGKILL",
        "kills",
        "records_after_kills",
        "",
    ),
    (
        "test_no_power_cut_loses_or_doubles_a_committed_record",
        "power cut",
        "power_cuts",
        "records_after_power_cuts",
        "sectors_lost_at_power_cuts",
    ),
)
FIGURES = {
    "security_score": "`systemd-analyze security springscale` (0 is best, 10 worst)",
    "sustained_frames_per_s": "frames/s of a timed canplayer log without one lost, by candump and by the service",
    "boot_after_power_cut_s": "s from power on to a running system after a power cut",
    "sectors_lost_at_power_cuts": "sectors of 512 bytes that power cuts lost, none of a committed record",
    "reference_std_kg": "kg: standard deviation of a 20 s batch of the replay",
    "reference_new_stamps_kg": "kg between HTTP and `springscale estimate` on the log that canplayer read",
}


def faults() -> str:
    """What the installed package does in the virtual machine, with the recoveries of the last recorded runs."""
    rows: list[dict[str, str]] = tomllib.loads((ROOT / "tests/faults.toml").read_text(encoding="utf-8"))["row"]
    tests = numbers("faults.json")["tests"]
    seen = [row for row in rows if row["test"].startswith("tests/vm/")]
    others = f"Tests of the code alone show the other {len(rows) - len(seen)} faults of `tests/faults.toml`.\n"
    return f"{table('fault | what must happen | recovery', (_fault(row, tests) for row in seen))}\n{others}"


def _fault(row: dict[str, str], tests: dict[str, Any]) -> tuple[str, ...]:
    name = row["test"].partition("::")[2]
    runs = [run for test, run in tests.items() if test.partition("[")[0] == name]
    times = sorted(run["recovery_s"] for run in runs if run["recovery_s"] is not None)
    recovery = f"{times[-1]:.1f} s" if times else ""
    if not (runs and all(run["outcome"] == "passed" for run in runs)):
        recovery = "not yet seen to pass"
    return row["fault"], row["must"], recovery


def fault_figures() -> str:
    """Each by the last run that measured it."""
    figures = numbers("faults.json")["figures"]
    return table(" | ", ((text, f"{figures[name]:.4g}") for name, text in FIGURES.items() if name in figures))


def soak_days() -> str:
    """The first and the last day of the simulated week."""
    head = "day | estimates | rejected | memory, MB | file handles | threads | database and log, MB | recorded, MB"
    keys = ("day", "estimates", "rejected", "memory_mb", "handles", "threads", "database_mb", "record_mb")
    days = numbers("soak.json")["days"]
    return table(head, ([f"{day[key]:g}" for key in keys] for day in (days[0], days[-1])))


def endured() -> str:
    """The kills and power cuts."""
    soak = numbers("soak_faults.json")
    rows = (
        (name, *(str(soak["figures"].get(key, "")) for key in keys), f"{run['recovery_s']:.1f} s")
        for test, name, *keys in ENDURED
        if (run := soak["tests"].get(test)) and run["outcome"] == "passed"
    )
    head = " | times | records committed meanwhile | sectors of 512 bytes lost | slowest recovery"
    return table(head, rows)


def record() -> None:
    """Store the measurements of the last runs, keeping earlier ones for what these did not measure."""
    for source, target in RECORDED.items():
        found, kept = ROOT / "build" / source, DOCS / target
        if found.exists():
            measured = json.loads(kept.read_text()) if kept.exists() else {}
            for name, new in json.loads(found.read_text()).items():
                measured[name] = measured.get(name, {}) | new if isinstance(new, dict) else new
            kept.write_text(json.dumps(measured, indent=1, sort_keys=True) + "\n")


# -- the fleet test --

COUNTS = DOCS / "fleet_test.json"


def fleet_test() -> str:
    """The faults injected and their effect, a column for the last run with each number of vehicles."""
    runs = json.loads(COUNTS.read_text(encoding="utf-8"))
    times = {1: "once", 2: "twice", 3: "three times"}
    first = runs[0]
    blows = ", ".join(f"{blow} {times[n]}" for blow, n in first["blows"].items())
    columns = [_counted(counts) for counts in runs]
    head = " | ".join(["", *(f"{counts['vehicles']} vehicles" for counts in runs)])
    lines = table(head, ([name, *(str(column[name]) for column in columns)] for name in columns[0]))
    return (
        f"`make fleet-test`, last run on {first['machine']} with {first['database']}: vehicles simulated with the\n"
        "product's own store, outbox and uplink, over TLS, a hundred in each process.\n"
        f"Killed meanwhile: {blows}.\n\n{lines}"
    )


def _counted(counts: dict[str, Any]) -> dict[str, Any]:
    """One run's figures by name."""
    return {
        "Seconds": counts["seconds"],
        "Estimates written by the vehicles, rows of them": f"{counts['estimates']}, {counts['estimate_rows']}",
        "Load events, trips and alarms, rows of them": f"{counts['entries']}, {counts['entry_rows']}",
        "Lost": counts["estimates"] + counts["entries"] - counts["estimate_rows"] - counts["entry_rows"],
        "Ids in more than one row": counts["ids_doubled"],
        "Records whose predecessor is missing": counts["records_missing"],
        "Repeated after a break, at least": counts["messages_said_again"],
        "A record in the database, indexes included": f"{counts['bytes_of_an_estimate']} bytes",
    }


def take(counts: dict[str, Any]) -> None:
    """Store these counts in place of the last run with as many vehicles."""
    others = [run for run in json.loads(COUNTS.read_text(encoding="utf-8")) if run["vehicles"] != counts["vehicles"]]
    runs = sorted([*others, counts], key=lambda run: int(run["vehicles"]))
    COUNTS.write_text(json.dumps(runs, indent=1) + "\n", encoding="utf-8")
