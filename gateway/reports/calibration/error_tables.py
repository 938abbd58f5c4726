"""The error table (12) for people: in short, run by run and batch by batch."""

import math
from typing import Final

from gateway.calibration.judgement import PART_NAMES, TARGETS, Comparison, Judged, Judgement, Part, TargetErrors
from gateway.records import iso_utc
from gateway.reports.calibration.text import NONE, decimal, percent
from gateway.reports.charts import Table

_COLUMNS: Final = ("mean |e|", "bias", "std", "max", "mean |e| %", "with misses %", "of gross %", "95 % covers")


def summary_table(judgement: Judgement) -> Table:
    """Both quantities over every set."""
    rows = [
        (PART_NAMES[part], label, table.errors.answered, *_cells(table.errors.of(target)))
        for part, table in judgement.tables.items()
        for label, target in zip(("payload", "share"), TARGETS, strict=True)
    ]
    return Table(
        "Errors (12): in kg and percentage points, and in percent of the campaign's ranges; of gross: in percent of "
        "the loaded vehicle's mass",
        ("Batches of", "Quantity", "answered", *_COLUMNS),
        tuple(rows),
        n_heads=2,
    )


def _cells(errors: TargetErrors) -> tuple[str, ...]:
    return (
        *(decimal(e, f" {errors.unit}") for e in (errors.mean_abs, errors.bias, errors.std, errors.max_abs)),
        decimal(errors.mean_abs_pct),
        decimal(errors.mean_abs_pct_with_misses),
        decimal(errors.mean_abs_pct_of_gross),
        percent(errors.coverage95),
    )


def runs_table(judgement: Judgement, part: Part) -> Table:
    """A line for every run of one set."""
    rows = tuple(
        (
            str(first.run),
            f"{first.payload_kg:g} kg",
            f"{first.front_share_pct:.1f} %",
            errors.answered,
            *_run_cells(errors.payload),
            *_run_cells(errors.front_share),
        )
        for first, errors in judgement.tables[part].runs
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


def _run_cells(errors: TargetErrors) -> tuple[str, ...]:
    figures = (errors.mean_abs, errors.bias, errors.max_abs)
    return (*(decimal(figure, f" {errors.unit}") for figure in figures), percent(errors.coverage95))


def batches_table(judgement: Judgement, part: Part) -> Table:
    """A line for every batch of one set."""
    rows = tuple(_batch_row(one) for one in judgement.tables[part].judged)
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


def _batch_row(one: Judged) -> tuple[str, ...]:
    payload, share = one.compared("payload"), one.compared("front_share")
    return (
        str(one.run),
        iso_utc(one.estimate.t_end_ns)[:19] + "Z",
        f"{payload.true:g} kg",
        *_answer_cells(payload, " kg"),
        f"{share.true:.1f} %",
        *_answer_cells(share, " %"),
        ", ".join(one.estimate.rejected),
    )


def _answer_cells(compared: Comparison, unit: str) -> tuple[str, str]:
    is_told = math.isfinite(compared.estimated)
    interval = f"{decimal(compared.low)} to {decimal(compared.high)}" if math.isfinite(compared.low) else NONE
    return decimal(compared.estimated if is_told else None, unit), interval
