"""The posterior and its budget as JSON: every error by its source."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from gateway.budget import BudgetLine, Remedy
from gateway.estimate_json.kinds import FieldKind, rounded
from gateway.posterior import NORMAL_TAILS, Posterior, Source
from gateway.records import F64

DIGITS: Final = 7


def posterior_to_json(posterior: Posterior) -> dict[str, Any]:
    """The JSON object of a posterior: names as in the class, arrays as lists."""
    return {
        "mean": [rounded(x, 9) for x in posterior.mean.tolist()],
        "own": _rows(posterior.own),
        "sources": {str(name): _rows(columns) for name, columns in posterior.sources.items()},
        "tails": [rounded(x, DIGITS) for x in posterior.tails],
    }


def posterior_from_json(record: Mapping[str, Any]) -> Posterior:
    """The inverse of :func:`posterior_to_json`, within its rounding."""
    low, high = record.get("tails", NORMAL_TAILS)
    sources = {Source(name): np.array(rows, float) for name, rows in record["sources"].items()}
    return Posterior(np.array(record["mean"], float), np.array(record["own"], float), sources, (low, high))


def _rows(matrix: F64) -> list[list[float | None]]:
    return [[rounded(x, DIGITS) for x in row] for row in matrix.tolist()]


def budget_to_json(budget: Sequence[BudgetLine]) -> list[dict[str, Any]]:
    """The JSON array of a budget: one object per source."""
    return [
        {
            "source": line.source,
            "payload_kg": rounded(line.payload_kg, 4),
            "front_share_pct": rounded(line.front_share_pct, 4),
            "cg_left_m": rounded(line.cg_left_m, 4),
            "remedy": None if line.remedy is None else str(line.remedy),
            "payload_with_remedy_kg": rounded(line.payload_with_remedy_kg, 4),
        }
        for line in budget
    ]


def budget_from_json(records: Sequence[Mapping[str, Any]]) -> tuple[BudgetLine, ...]:
    """The inverse of :func:`budget_to_json`, within its rounding."""
    numbers = ("payload_kg", "front_share_pct", "cg_left_m", "payload_with_remedy_kg")
    return tuple(
        BudgetLine(
            source=record["source"],
            remedy=None if record["remedy"] is None else Remedy(record["remedy"]),
            **{name: float("nan") if record[name] is None else record[name] for name in numbers},
        )
        for record in records
    )


POSTERIOR: Final = FieldKind(
    dict[str, Any] | None, lambda one: None if one is None else posterior_to_json(one), posterior_from_json
)
BUDGET: Final = FieldKind(list[dict[str, Any]], budget_to_json, budget_from_json)
