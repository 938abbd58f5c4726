"""Writes what `make fleet-test` counted into docs/fleet.md; with --check only tells whether it stands there.

The counts are those of docs/fleet_test.json; `python docs/make_fleet.py build/fleet-test.json` takes new ones.
"""

import json
import re
import shutil
import sys
from pathlib import Path
from typing import Any, Final

from generated import keep_up_to_date

DOCS: Final = Path(__file__).parent
PAGE: Final = DOCS / "fleet.md"
COUNTS: Final = DOCS / "fleet_test.json"
PART: Final = re.compile(r"(<!-- fleet test: [^\n]* -->\n).*?(<!-- end of fleet test -->)", re.DOTALL)


def fleet_page() -> str:
    """The whole page with the counts in their place."""
    told = table(json.loads(COUNTS.read_text(encoding="utf-8")))
    return PART.sub(lambda found: found[1] + told + found[2], PAGE.read_text(encoding="utf-8"))


def table(counts: dict[str, Any]) -> str:
    """What was done and what came of it."""
    times = {1: "once", 2: "twice", 3: "three times"}
    blows = ", ".join(f"{blow} {times[n]}" for blow, n in counts["blows"].items())
    rows = {
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
    lines = "".join(f"| {name} | {number} |\n" for name, number in rows.items())
    return (
        f"`make fleet-test`, last run on {counts['machine']} with {counts['database']}: {counts['vehicles']}\n"
        "vehicles, simulated with the product's own store, outbox and uplink, over TLS, in\n"
        f"{counts['seconds']} s. Killed meanwhile: {blows}.\n\n"
        f"| | |\n|---|---|\n{lines}"
    )


def main() -> None:
    """Take new counts where a file is named; write the page, or compare it."""
    for named in (argument for argument in sys.argv[1:] if not argument.startswith("--")):
        shutil.copyfile(named, COUNTS)
    keep_up_to_date(PAGE, fleet_page(), COUNTS.name)


if __name__ == "__main__":
    main()
