"""The counts of `make fleet-test` (docs/fleet.md): docs/fleet_test.json, the last run with each number of vehicles."""

import json
from pathlib import Path
from typing import Any, Final

DOCS: Final = Path(__file__).parent
COUNTS: Final = DOCS / "fleet_test.json"


def counted() -> str:
    """The faults injected and their effect, for the last run with each number of vehicles."""
    return table(json.loads(COUNTS.read_text(encoding="utf-8")))


def table(runs: list[dict[str, Any]]) -> str:
    """The faults injected and their effect, a column for each number of vehicles."""
    times = {1: "once", 2: "twice", 3: "three times"}
    first = runs[0]
    blows = ", ".join(f"{blow} {times[n]}" for blow, n in first["blows"].items())
    columns = [rows(counts) for counts in runs]
    head = "".join(f" {counts['vehicles']} vehicles |" for counts in runs)
    lines = "".join(f"| {name} |{''.join(f' {column[name]} |' for column in columns)}\n" for name in columns[0])
    return (
        f"`make fleet-test`, last run on {first['machine']} with {first['database']}: vehicles simulated with the\n"
        "product's own store, outbox and uplink, over TLS, a hundred in each process.\n"
        f"Killed meanwhile: {blows}.\n\n"
        f"| |{head}\n|---|{'---|' * len(runs)}\n{lines}"
    )


def rows(counts: dict[str, Any]) -> dict[str, Any]:
    """One run's figures by name."""
    return {
        "Seconds": counts["seconds"],
        "Estimates written by the vehicles, rows of them": f"{counts['estimates']}, {counts['estimate_rows']}",
        "Load events, trips and alarms, rows of them": f"{counts['entries']}, {counts['entry_rows']}",
        "Lost": counts["estimates"] + counts["entries"] - counts["estimate_rows"] - counts["entry_rows"],
        "Ids in more than one row": counts["ids_doubled"],
        "Records whose predecessor is missing": counts["records_missing"],
        "Messages acknowledged by the broker": counts["messages_acknowledged"],
        "Of them said again after a break, at least": counts["messages_said_again"],
        "A record in the database, indexes included": f"{counts['bytes_of_an_estimate']} bytes",
        "Connections that the vehicles made": counts["connections_of_vehicles"],
    }


def take(counts: dict[str, Any]) -> None:
    """Store these counts in place of the last run with as many vehicles."""
    others = [run for run in json.loads(COUNTS.read_text(encoding="utf-8")) if run["vehicles"] != counts["vehicles"]]
    runs = sorted([*others, counts], key=lambda run: int(run["vehicles"]))
    COUNTS.write_text(json.dumps(runs, indent=1) + "\n", encoding="utf-8")
