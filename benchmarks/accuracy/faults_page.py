"""The page of the sensor faults, from the numbers of their study alone."""

from collections.abc import Mapping
from typing import Any, Final

from benchmarks.accuracy.markdown import all_but, page, refused_cell, table

COLUMNS: Final = (
    "Fault", "Strength", "Batches", "Refused, and why", "Held", "Outside",
    "Payload outside by up to", "Share outside by up to",
)  # fmt: skip
LEAST_SAFE: Final = 0.9  # chosen: of the batches


def faults_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown, from the numbers of benchmarks.accuracy.faults."""
    lines = found["lines"]
    total = {name: sum(line[name] for line in lines) for name in ("n_batches", "n_refused", "n_held")}
    wrong = [line for line in lines if _n_outside(line)]
    unsafe = [
        f"{line['fault']} {line['strength']}".strip()
        for line in lines
        if _n_outside(line) > (1.0 - LEAST_SAFE) * line["n_batches"]
    ]
    return page(
        "Sensor faults",
        f"faults {found['campaign']} --calibration FILE --seed {found['seed']} --output DIR",
        f"What ordinary faults of sensors do to the answers. The logs of {found['n_drives']} recorded drives with "
        "known loads are rewritten, each time with one fault from the first frame on, and weighed as `springscale "
        "estimate` weighs them, by a calibration that was made with a sound sensor. A fault is harmless where the "
        "batch is refused, or where the 95 % intervals of both payload and front share hold the truth. An answer "
        "outside is the worst that can happen: nobody sees it. The distance outside is given in half-widths of the "
        f"interval. The {total['n_batches']} batches took {found['cpu_s'] / 60:.0f} minutes of one core.",
        "",
        f"- Refused: {total['n_refused']} of {total['n_batches']} batches.",
        f"- Answered, and held by both intervals: {total['n_held']}.",
        f"- Answered outside an interval: {total['n_batches'] - total['n_refused'] - total['n_held']}, under "
        f"{len(wrong)} of {len(lines)} faults and strengths. The first line has no fault: such answers are among "
        "the 5 % that an interval of 95 % leaves out of each quantity.",
        f"- Refused or held in at least {100.0 * LEAST_SAFE:.0f} % of the batches: {all_but(unsafe)}",
        "",
        *table(COLUMNS, map(_cells, lines)),
        "",
    )


def _n_outside(line: Mapping[str, Any]) -> int:
    return int(line["n_batches"] - line["n_refused"] - line["n_held"])


def _cells(line: Mapping[str, Any]) -> list[str]:
    furthest = (line["payload_furthest"], line["front_share_furthest"])
    return [
        line["fault"],
        line["strength"],
        str(line["n_batches"]),
        refused_cell(line["n_refused"], line["refused_by_reason"]),
        str(line["n_held"]),
        str(_n_outside(line)),
        *(f"{x:.2f}" if x else "" for x in furthest),
    ]
