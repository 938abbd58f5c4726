"""The error table (12) for people: in short, run by run and batch by batch."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from gateway.calibration.judgement.evidence import PART_NAMES, Judgement, Part
from gateway.reports.calibration.text import NONE, percent, shown
from gateway.reports.charts.chart import Table

_COLUMNS: Final = ("mean |e|", "bias", "std", "max", "mean |e| %", "with misses %", "of gross %", "95 % covers")


def summary_table(judgement: Judgement) -> Table:
    """Both quantities over every set."""
    rows = [
        (PART_NAMES[part], label, f"{table['n_batches'] - table['n_rejected']} of {table['n_batches']}", *cells)
        for part, table in judgement.tables.items()
        for label, cells in (("payload", _cells(table["payload"], "kg")), ("share", _cells(table["front_share"], "pp")))
    ]
    return Table(
        "Errors (12): in kg and percentage points, and in percent of the campaign's ranges; of gross: in percent of "
        "the loaded vehicle's mass",
        ("Batches of", "Quantity", "answered", *_COLUMNS),
        tuple(rows),
        n_heads=2,
    )


def _cells(errors: Mapping[str, Any], unit: str) -> tuple[str, ...]:
    return (
        *(shown(errors[f"{name}_{unit}"], f" {unit}") for name in ("mean_abs", "bias", "std", "max_abs")),
        *(shown(errors[name]) for name in ("mean_abs_pct", "mean_abs_pct_with_misses")),
        shown(errors.get("mean_abs_pct_of_gross")),
        percent(errors["coverage95"]),
    )


def runs_table(judgement: Judgement, part: Part) -> Table:
    """A line for every run of one set."""
    rows = tuple(
        (
            str(run["run"]),
            f"{run['true_payload_kg']:g} kg",
            f"{run['true_front_share_pct']:.1f} %",
            f"{run['n_batches'] - run['n_rejected']} of {run['n_batches']}",
            *(shown(run["payload"][f"{name}_kg"], " kg") for name in ("mean_abs", "bias", "max_abs")),
            percent(run["payload"]["coverage95"]),
            *(shown(run["front_share"][f"{name}_pp"], " pp") for name in ("mean_abs", "bias", "max_abs")),
            percent(run["front_share"]["coverage95"]),
        )
        for run in judgement.tables[part]["runs"]
    )
    errors = ("mean |e|", "bias", "max", "95 % covers")
    columns = (
        "Run",
        "payload",
        "front share",
        "answered",
        *(f"payload {e}" for e in errors),
        *(f"share {e}" for e in errors),
    )
    return Table(f"{PART_NAMES[part].capitalize()}, run by run", columns, rows)


def batches_table(judgement: Judgement, part: Part) -> Table:
    """A line for every batch of one set."""
    rows = tuple(_batch_row(one) for one in judgement.tables[part]["batches"])
    columns = (
        "Run",
        "until",
        "true payload",
        "estimated",
        "95 % interval",
        "true share",
        "estimated",
        "95 % interval",
        "no answer",
    )
    return Table(f"{PART_NAMES[part].capitalize()}, batch by batch", columns, rows)


def _batch_row(one: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        str(one["run"]),
        str(one["t_end"])[:19] + "Z",
        f"{one['true_payload_kg']:g} kg",
        shown(one["payload_kg"], " kg"),
        _interval(one["payload_interval95_kg"]),
        f"{one['true_front_share_pct']:.1f} %",
        shown(one["front_share_pct"], " %"),
        _interval(one["front_share_interval95_pct"]),
        ", ".join(one["rejected"]),
    )


def _interval(bounds: Sequence[float] | None) -> str:
    return NONE if bounds is None else f"{shown(bounds[0])} to {shown(bounds[1])}"
