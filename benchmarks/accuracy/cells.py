"""A study's table in Markdown, and what stands in its cells: a number, a share with its limits, what was refused."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from gateway.calibration.judgement.coverage import IDEAL_SCORE


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Its lines."""
    head = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    return [*head, *("| " + " | ".join(cells) + " |" for cells in rows)]


def rejected_cell(line: Mapping[str, Any]) -> str:
    """How many, and why."""
    reasons = ", ".join(f"{n} {why}" for why, n in line["rejected_by_reason"].items())
    return f"{line['n_rejected']}: {reasons}" if reasons else str(line["n_rejected"])


def refused_cell(n: int, by_reason: Mapping[str, int]) -> str:
    """How many, and why in brackets."""
    reasons = ", ".join(f"{reason} {count}" for reason, count in by_reason.items())
    return f"{n} ({reasons})" if reasons else str(n)


def all_but(exceptions: Sequence[str]) -> str:
    """Which lines of a table a verdict is true of."""
    return f"all but {', '.join(exceptions)}." if exceptions else "every line."


def number_cell(x: float | None) -> str:
    """Two decimals."""
    return "none" if x is None else f"{x:.2f}"


def share_cell(coverage: Mapping[str, Any] | None) -> str:
    """A share and its limits, percent."""
    if coverage is None:
        return "none"
    return f"{100 * coverage['share']:.0f} % ({100 * coverage['low']:.0f} to {100 * coverage['high']:.0f})"


def score_cell(score: float | None, mean_abs: float | None) -> str:
    """A mean interval score, and what is ideal for errors of this mean."""
    return "none" if score is None or mean_abs is None else f"{score:.1f} ({IDEAL_SCORE * mean_abs:.1f})"
