"""The page of the siblings, from the numbers of their study alone."""

from collections.abc import Mapping
from typing import Any, Final

from benchmarks.accuracy.markdown import number_cell, page, rejected_cell, score_cell, share_cell, table

COLUMNS: Final = (
    "Calibration of the sibling", "Batches", "Rejected",
    "Payload, mean abs. error %", "with misses", "95 % covers", "+- %", "score % (ideal)",
    "Share, mean abs. error %", "with misses", "95 % covers", "+- %", "score % (ideal)",
)  # fmt: skip


def siblings_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown, from SiblingsTable.to_json."""
    return page(
        "Siblings: one empty drive is enough",
        f"siblings --output DIR --vans {found['n_vans']} --seed {found['seed']}",
        f"{found['n_vans']} simulated vans of {found['n_lines']} lines, each line drawn about one of the "
        "simulator's three types. The vans of a line differ about it in springs by 3 %, dampers 10 %, tyres 4 %, "
        "friction 30 %, unsprung masses 3 %, mass, centre of gravity and inertia 1.5 % (standard deviations, each "
        "axle its own). Each has another sensor unit, mounted 2 cm and one degree beside where it should be. "
        "Sisters are calibrated with six known loads of ten minutes near 50 km/h. A sibling is driven empty near "
        "50 km/h, and mixed: town, country, motorway. It is judged on loads that nobody told: mixed, mixed on "
        "another day (springs changed by 1.5 %, dampers and tyres by 5 %), and at another steady speed from 30 to "
        "110 km/h. All with a roll "
        "rate. What is inherited, and how: [a whole line of vehicles](line.md).",
        "",
        "Batches of 300 s; errors are percent of the payload each van is rated for and of 20 percentage points, "
        "over batches that were answered; with misses, a rejected batch counts as a mid-range answer. +- is the "
        "mean of half the 95 % intervals; the interval score is their width and 40 times what the truth lies "
        "outside, in brackets what it would be for normal errors and intervals of the right width.",
        "",
        *table(COLUMNS, map(_cells, found["rows"])),
        "",
        "The line's own file knows nothing of the sibling, and its intervals nothing of that; knowing once that "
        "the vehicle is empty mends the "
        "zero alone. Alone, an empty drive leaves the springs' answer to load to a guess, so that the vehicle is "
        "believed near its own speeds only. The sister tells the rest.",
        "",
    )


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        row["estimator"], str(row["n_batches"]), rejected_cell(row),
        *(cell for target in ("payload", "front_share") for cell in _of_target(row, target)),
    )  # fmt: skip


def _of_target(row: Mapping[str, Any], target: str) -> tuple[str, ...]:
    return (
        number_cell(row[f"{target}_mean_abs_pct"]),
        number_cell(row[f"{target}_mean_abs_pct_with_misses"]),
        share_cell(row[f"{target}_coverage"]),
        number_cell(row[f"{target}_half_width_pct"]),
        score_cell(row[f"{target}_interval_score_pct"], row[f"{target}_mean_abs_pct"]),
    )
