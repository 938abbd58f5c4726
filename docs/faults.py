"""Writes docs/faults.md from tests/faults.toml and from the measurements of `make test-vm` and `make soak`.

`python docs/make.py --record` first copies the measurements of the last runs from build/ into docs/*.json.
"""

import json
import tomllib
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
PAGE, MEASURED = DOCS / "faults.md", DOCS / "faults.json"
ROWS = DOCS.parent / "tests" / "faults.toml"
SOAK, ATTACK, VM_SOAK = DOCS / "soak.json", DOCS / "soak_attack.json", DOCS / "soak_faults.json"
BUILD = DOCS.parent / "build"
RECORDED = (
    (BUILD / "vm-results.json", MEASURED),
    (BUILD / "soak.json", SOAK),
    (BUILD / "soak_attack.json", ATTACK),
    (BUILD / "vm-soak.json", VM_SOAK),
)

INTRODUCTION = """\
# Faults

Generated from `tests/faults.toml` and from the last recorded run by `python docs/make.py`; do not edit by hand.

Every row is a test. Those under `tests/vm` run the installed Debian package under real systemd on a real SocketCAN
interface, in a small virtual machine (`make test-vm`); the others run everywhere (`make test`). Recovery is measured
from the end of the cause, or from the fault if nobody has to mend anything, until the service works again.
"""


def faults_page() -> str:
    """The whole page as Markdown."""
    rows: list[dict[str, str]] = tomllib.loads(ROWS.read_text())["row"]
    measured: dict[str, Any] = json.loads(MEASURED.read_text())
    parts = [INTRODUCTION, _machine(measured["machine"])]
    for area in dict.fromkeys(row["area"] for row in rows):
        parts.append(
            f"## {area}\n\n| fault | what is done | what must happen | recovery | test |\n|---|---|---|---|---|"
        )
        parts[-1] += "".join(_line(row, measured["tests"]) for row in rows if row["area"] == area) + "\n"
    soaks = [
        _soak(json.loads(SOAK.read_text())),
        _attack(json.loads(ATTACK.read_text())),
        _vm_soak(json.loads(VM_SOAK.read_text())),
    ]
    return "\n".join([*parts, _figures(measured["figures"]), *soaks])


# Test, what it does, and the figures that tell how often, over how many records, and what the disk lost
ENDURED = (
    (
        "test_killed_again_and_again_it_loses_and_doubles_nothing",
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
ENDURED_HEAD = (
    "## Killed and cut off, again and again\n",
    "The rest of `make soak`; no committed record was lost and none came twice.\n",
    "| | times | records committed meanwhile | sectors of 512 bytes lost | slowest recovery |",
    "|---|---|---|---|---|",
)
FIGURES = {
    "security_score": "`systemd-analyze security springscale` (0 is best, 10 worst)",
    "sustained_frames_per_s": "frames/s of a timed canplayer log without one lost, by candump and by the service",
    "boot_after_power_cut_s": "s from power on to a running system after a power cut",
    "sectors_lost_at_power_cuts": "sectors of 512 bytes that power cuts lost, none of a committed record",
    "reference_std_kg": "kg: standard deviation of a 20 s batch, reference map",
    "j1939_std_kg": "kg: standard deviation of a 20 s batch, J1939",
    "reference_same_stamps_kg": "kg between HTTP and `springscale estimate` on candump's recording of the replay, "
    "reference map; 0.05 standard deviations are allowed",
    "j1939_same_stamps_kg": "kg between HTTP and `springscale estimate` on candump's recording of the replay, J1939; "
    "0.05 standard deviations are allowed",
    "late_ms": "ms that canplayer's frames were late at most, 99 of 100, in the replay compared below",
    "reference_new_stamps_kg": "kg between HTTP and `springscale estimate` on the log that canplayer read, reference "
    "map; 0.5 standard deviations are allowed, for the kernel stamps frames when they come",
    "j1939_new_stamps_kg": "kg between HTTP and `springscale estimate` on canplayer's log, J1939; the same allowance",
}


def _figures(figures: dict[str, float]) -> str:
    lines = [f"| {text} | {figures[name]:.4g} |" for name, text in FIGURES.items() if name in figures]
    return "\n".join(["## Figures\n", "Each is of the last run that measured it.\n", "| | |", "|---|---|", *lines, ""])


def _soak(soak: dict[str, Any]) -> str:
    head = (
        f"## A simulated week\n\n`make soak`: a commissioning, then {soak['hours_a_day']:g} h of driving a day through "
        "the service at high speed, nights of silence between, a client asking all the while, the database limited to "
        f"4 MB, the ring log to {soak['most_allowed']['record_mb']:g}. The process also holds the simulator that made "
        f"its drive. {_bounds(soak)}\n\n"
        "| day | estimates | rejected | memory, MB | file handles | threads | database and log, MB | recorded, MB |\n"
        "|---|---|---|---|---|---|---|---|"
    )
    keys = ("day", "estimates", "rejected", "memory_mb", "handles", "threads", "database_mb", "record_mb")
    return "\n".join([head, *("| " + " | ".join(f"{day[key]:g}" for key in keys) + " |" for day in soak["days"]), ""])


def _bounds(soak: dict[str, Any]) -> str:
    grow, most = soak["growth_allowed"], soak["most_allowed"]
    return (
        f"From the first day's end to the last's, memory may grow by {grow['memory_mb']:g} MB, file handles by "
        f"{grow['handles']:g} and threads by {grow['threads']:g}; database and log together may reach "
        f"{most['database_mb']:g} MB. Beyond that it fails."
    )


def _attack(found: dict[str, Any]) -> str:
    return (
        "## Crowds at the door while it weighs\n\n"
        f"`make soak`, over TLS: {found['crowds']} crowds, one after the other, {found['connections']} connections "
        "from four addresses that are silent, ask for the history, its exports, old streams or assets and read "
        f"nothing, during {found['hours']:g} h of driving at high speed. Of {found['estimates']} estimates "
        f"{found['different']} differed from those without an attack. Memory: {found['memory_mb']:g} MB at most, "
        f"{found['calm_mb']:g} MB without; "
        f"{found['memory_allowed_mb']:g} MB are allowed. Another client had {found['answers']} answers, half of them "
        f"within {found['answer_median_ms']:.0f} ms, the slowest after {found['answer_slowest_ms']:.0f} ms.\n"
    )


def _vm_soak(soak: dict[str, Any]) -> str:
    figures, tests = soak["figures"], soak["tests"]
    lines = [
        f"| {name} | {figures[times]} | {figures[records]} | {figures.get(lost, '')} | {run['recovery_s']:.1f} s |"
        for test, name, times, records, lost in ENDURED
        if (run := tests.get(test)) and run["outcome"] == "passed"
    ]
    return "\n".join([*ENDURED_HEAD, *lines, ""])


def _machine(machine: dict[str, Any]) -> str:
    return (
        f"Measured on {machine['backend']} with kernel {machine['kernel']} and {machine['systemd']}. Its one emulated "
        f"processor is many times slower than a vehicle's box (booting took {machine['boot_s']} s): times are upper "
        "bounds.\n"
    )


def _line(row: dict[str, str], tests: dict[str, Any]) -> str:
    file, _, name = row["test"].partition("::")
    runs = [run for test, run in tests.items() if test.partition("[")[0] == name]
    times = sorted(run["recovery_s"] for run in runs if run["recovery_s"] is not None)
    recovery = f"{times[-1]:.1f} s" if times else ""
    if file.startswith("tests/vm") and not (runs and all(run["outcome"] == "passed" for run in runs)):
        recovery = "not yet seen to pass"
    return f"\n| {row['fault']} | {row['injected']} | {row['must']} | {recovery} | [{name}](../{file}) |"


def record() -> None:
    """Store the measurements of the last runs, keeping earlier ones for what these did not measure."""
    for found, kept in RECORDED:
        if found.exists():
            measured = json.loads(kept.read_text()) if kept.exists() else {}
            for name, new in json.loads(found.read_text()).items():
                measured[name] = measured.get(name, {}) | new if isinstance(new, dict) else new
            kept.write_text(json.dumps(measured, indent=1, sort_keys=True) + "\n")
