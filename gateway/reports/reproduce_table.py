"""The paper's numbers beside ours: rows for the report, for docs/accuracy.md and for machines."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from gateway.reports.reproduce_evidence import Evidence

PAPER_PCT: Final = {  # mean |error| of payload and of share, percent of 450 kg and of 20 points: the paper's section 4
    ("test1", "validation"): (5.46, 6.02),
    ("test2", "validation"): (6.59, 5.69),
    ("test3", "validation"): (6.08, 6.25),
    ("experiment", "identification"): (7.87, 11.28),
    ("experiment", "validation"): (8.98, 20.55),
}
PAPER_STD_PCT: Final = {("experiment", "validation"): (4.81, 13.58)}  # called variances there; they read as deviations

TITLES: Final = {
    ("test1", "validation"): "Test 1: load 0 to 300 kg",
    ("test2", "validation"): "Test 2: share 40 to 60 %",
    ("test3", "validation"): "Test 3: ten random pairs",
    ("experiment", "identification"): "Experiment, identification",
    ("experiment", "validation"): "Experiment, validation",
    ("speeds", "validation"): "30 to 110 km/h (not in the paper)",
}

COLUMNS: Final = (
    "Drive", "Method", "Batches", "Rejected",
    "Payload, mean abs. error %", "std %", "kg", "95 % covers",
    "Share, mean abs. error %", "std %", "points", "95 % covers",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Row:
    """One drive by one method: ``errors`` is the error table of (12), None for the paper's own line."""

    title: str
    method: str
    cells: tuple[str, ...]
    errors: dict[str, Any] | None = None


def rows_of(evidence: Evidence) -> list[Row]:
    """For every drive the paper's line, where it has one, then one for each method."""
    rows = []
    for key, title in TITLES.items():
        kind, split = key
        if key in PAPER_PCT:
            rows.append(_paper_row(title, PAPER_PCT[key], PAPER_STD_PCT.get(key)))
        methods = evidence.simulated if kind.startswith("test") else evidence.experimental
        for method in methods:
            errors = evidence.table(kind, split, method)
            rows.append(Row(title, method.label, _cells(title, method.label, errors), errors))
    return rows


def markdown(rows: Sequence[Row]) -> str:
    """The table for docs/accuracy.md."""
    head = ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    return "\n".join([*head, *("| " + " | ".join(row.cells) + " |" for row in rows)]) + "\n"


def _paper_row(title: str, mean_pct: tuple[float, float], std_pct: tuple[float, float] | None) -> Row:
    payload, share = mean_pct
    payload_std, share_std = (f"{std:.2f}" for std in std_pct) if std_pct else ("", "")
    cells = (
        title, "the paper", "", "",
        f"{payload:.2f}", payload_std, f"{4.5 * payload:.1f}", "",
        f"{share:.2f}", share_std, f"{0.2 * share:.2f}", "",
    )  # fmt: skip
    return Row(title, "the paper", cells)


def _cells(title: str, method: str, errors: dict[str, Any]) -> tuple[str, ...]:
    payload, share = errors["payload"], errors["front_share"]
    return (
        title, method, str(errors["n_batches"]), str(errors["n_rejected"]),
        _shown(payload["mean_abs_pct"], 2), _shown(payload["std_pct"], 2), _shown(payload["mean_abs_kg"], 1),
        _share_shown(payload["coverage95"]),
        _shown(share["mean_abs_pct"], 2), _shown(share["std_pct"], 2), _shown(share["mean_abs_pp"], 2),
        _share_shown(share["coverage95"]),
    )  # fmt: skip


def _shown(number: float | None, digits: int) -> str:
    return "none" if number is None else f"{number:.{digits}f}"


def _share_shown(share: float | None) -> str:
    return "none" if share is None else f"{100.0 * share:.0f} %"
