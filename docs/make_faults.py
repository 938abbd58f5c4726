"""Writes docs/faults.md from tests/faults.toml, docs/faults.json (`make test-vm`) and docs/soak.json (`make soak`).

--record takes the measurements of the last runs (build/vm-results.json, build/soak.json) into docs first; --check only
tells whether the page is up to date.
"""

import json
import sys
import tomllib
from pathlib import Path
from typing import Any

from generated import keep_up_to_date

DOCS = Path(__file__).parent
PAGE, MEASURED = DOCS / "faults.md", DOCS / "faults.json"
ROWS = DOCS.parent / "tests" / "faults.toml"
SOAK = DOCS / "soak.json"
BUILD = DOCS.parent / "build"
RECORDED = ((BUILD / "vm-results.json", MEASURED), (BUILD / "soak.json", SOAK))

INTRODUCTION = """\
# Faults

Generated from `tests/faults.toml` and from the last recorded run by `python docs/make_faults.py`; do not edit by hand.

Every row is a test. Those under `tests/vm` run the installed Debian package under real systemd on a real SocketCAN
interface, in a small virtual machine (`make test-vm`); the others run everywhere (`make test`). Recovery is measured
from the moment the cause is gone, or from the fault where nobody has to mend anything, until the service does again
what it is for.
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
    return "\n".join([*parts, _figures(measured["figures"]), _soak(json.loads(SOAK.read_text()))])


FIGURES = {
    "security_score": "`systemd-analyze security springscale` (0 is best, 10 worst)",
    "sustained_frames_per_s": "frames/s of a timed canplayer log without one lost, by candump and by the service",
    "boot_after_power_cut_s": "s from power on to a running system after a power cut",
    "sectors_lost_at_power_cuts": "sectors of 512 bytes that power cuts lost, none of a committed record",
    "same_stamps_kg": "kg between HTTP and `springscale estimate` on candump's recording of the replay, 20 s batches",
    "late_ms": "ms that canplayer's frames were late at most, 99 of 100, in the replay compared below",
    "reference_new_stamps_kg": "kg between HTTP and `springscale estimate` on the log that canplayer read",
    "j1939_new_stamps_kg": "the same for a J1939 log",
}


def _figures(figures: dict[str, float]) -> str:
    lines = [f"| {text} | {figures[name]:.4g} |" for name, text in FIGURES.items() if name in figures]
    return "\n".join(["## Figures of the same run\n", "| | |", "|---|---|", *lines, ""])


def _soak(soak: dict[str, Any]) -> str:
    head = (
        f"## A simulated week\n\n`make soak`: {soak['hours_a_day']:g} h of driving a day through the service at high "
        "speed, nights of silence between, a client asking all the while, the database limited to 4 MB. The process "
        "also holds the simulator that made its drive.\n\n"
        "| day | estimates | rejected | memory, MB | file handles | threads | database and log, MB |\n"
        "|---|---|---|---|---|---|---|"
    )
    keys = ("day", "estimates", "rejected", "memory_mb", "handles", "threads", "database_mb")
    return "\n".join([head, *("| " + " | ".join(f"{day[key]:g}" for key in keys) + " |" for day in soak["days"]), ""])


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
    """Keep the measurements of the last runs, where there are any."""
    for found, kept in RECORDED:
        if found.exists():
            kept.write_text(json.dumps(json.loads(found.read_text()), indent=1, sort_keys=True) + "\n")


def main() -> None:
    """Write the page, or compare it."""
    if "--record" in sys.argv[1:]:
        record()
    keep_up_to_date(PAGE, faults_page(), "docs/faults.json with tests/faults.toml")


if __name__ == "__main__":
    main()
