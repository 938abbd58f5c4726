"""The tables of the studies in Markdown, and their cells."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from gateway.calibration.judgement.coverage import IDEAL_SCORE

Row = Mapping[str, Any]
Column = tuple[str, Callable[[Row], str]]  # its head, and its cell in a row


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """The lines of a table."""
    head = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    return [*head, *("| " + " | ".join(cells) + " |" for cells in rows)]


def table_of(columns: Sequence[Column], rows: Iterable[Row]) -> list[str]:
    """The lines of a table, each cell computed from its row."""
    return table([head for head, _ in columns], ([cell(row) for _, cell in columns] for row in rows))


def text(key: str) -> Callable[[Row], str]:
    """A cell as it is in the row."""
    return lambda row: str(row[key])


def number(key: str, digits: int = 2, unknown: str = "none") -> Callable[[Row], str]:
    """A number with so many decimals."""
    return lambda row: unknown if row[key] is None else f"{row[key]:.{digits}f}"


def width_and_score(target: str, unit: str = "pct") -> tuple[Callable[[Row], str], Callable[[Row], str]]:
    """Half the mean interval of a target, and its interval score with what would be ideal."""
    score, error = f"{target}_interval_score_{unit}", f"{target}_mean_abs_{unit}"
    return number(f"{target}_half_width_{unit}"), lambda row: score_cell(row[score], row[error])


def refused_cell(n: int, by_reason: Mapping[str, int]) -> str:
    """How many, and why in brackets."""
    reasons = ", ".join(f"{reason} {count}" for reason, count in by_reason.items())
    return f"{n} ({reasons})" if reasons else str(n)


def all_but(exceptions: Sequence[str]) -> str:
    """Which lines of a table a verdict is true of."""
    return f"all but {', '.join(exceptions)}." if exceptions else "every line."


def share_cell(coverage: Mapping[str, Any] | None) -> str:
    """A share and its limits, percent."""
    if coverage is None:
        return "none"
    return f"{100 * coverage['share']:.0f} % ({100 * coverage['low']:.0f} to {100 * coverage['high']:.0f})"


def score_cell(score: float | None, mean_abs: float | None) -> str:
    """A mean interval score, and what is ideal for errors of this mean."""
    return "none" if score is None or mean_abs is None else f"{score:.1f} ({IDEAL_SCORE * mean_abs:.1f})"
