"""The error table (12) for people: in short, run by run and batch by batch."""

import math
from collections.abc import Iterator, Sequence
from typing import Final

from gateway.budget import BudgetLine
from gateway.calibration.judgement import (
    PART_NAMES,
    BatchSet,
    CgLeftErrors,
    Comparison,
    Errors,
    Judged,
    Judgement,
    TargetErrors,
)
from gateway.calibration.judgement.coverage import IDEAL_SCORE
from gateway.estimate import Z95
from gateway.reasons import REMEDIES, SOURCES
from gateway.records import iso_utc
from gateway.reports.calibration.text import NONE, decimal, percent
from gateway.reports.charts import Table

_COLUMNS: Final = (
    "mean |e|",
    "bias",
    "std",
    "max",
    "mean |e| %",
    "with misses %",
    "of gross %",
    "95 % covers",
    "± (95 %)",
    "score",
)


def summary_table(judgement: Judgement) -> Table:
    """Both quantities over every set."""
    rows = [
        (PART_NAMES[part], label, table.errors.answered, *cells)
        for part, table in judgement.tables.items()
        for label, cells in _labelled(table.errors)
    ]
    return Table(
        "Errors (12): in kg and percentage points, and in percent of the campaign's ranges; of gross: in percent of "
        "the loaded vehicle's mass; where the centre of gravity lies left of the centre line: in mm. ± is the mean "
        "of half the 95 % intervals; the score is their width and 40 times what the truth lies outside, in the mean, "
        f"and {IDEAL_SCORE:g} times the mean |e| where intervals are as wide as they should be; both in percent of the "
        "range",
        ("Batches of", "Quantity", "answered", *_COLUMNS),
        tuple(rows),
        n_heads=2,
    )


def budget_table(budget: Sequence[BudgetLine]) -> Table:
    """The sources of the stated error."""
    rows = [
        (
            SOURCES[line.source].capitalize(),
            decimal(line.payload_kg, " kg", 1),
            decimal(line.front_share_pct, " pp"),
            decimal(1000.0 * line.cg_left_m, " mm", 1) if math.isfinite(line.cg_left_m) else NONE,
            f"{REMEDIES[line.remedy]}: ± {Z95 * line.payload_with_remedy_kg:.0f} kg" if line.remedy else NONE,
        )
        for line in budget
    ]
    return Table(
        "Where the stated error comes from: standard deviations by source (root mean squares over the batches, largest "
        "first), and what would narrow it, with the 95 % interval of the payload that this would leave",
        ("Source", "payload", "front share", "centre of gravity, left", "what would narrow it"),
        tuple(rows),
    )


def _labelled(errors: Errors) -> Iterator[tuple[str, tuple[str, ...]]]:
    """A line per quantity; lateral places and wheel loads only if known."""
    yield "payload", _cells(errors.payload)
    yield "share", _cells(errors.front_share)
    if errors.cg_left is not None and errors.cg_left.mean_abs_m is not None:
        yield "centre of gravity, left", _cg_left_cells(errors.cg_left)
    if errors.wheels is not None:
        of_gross = decimal(errors.wheels.mean_abs_pct_of_gross)
        yield "each wheel's load", (*[NONE] * 6, of_gross, *[NONE] * 3)


def _cg_left_cells(errors: CgLeftErrors) -> tuple[str, ...]:
    lengths_m = (errors.mean_abs_m, errors.bias_m, errors.std_m, errors.max_abs_m)
    in_mm = (decimal(None if m is None else 1000.0 * m, " mm") for m in lengths_m)
    widths_m = (errors.half_width_m, errors.interval_score_m)
    widths_in_mm = (decimal(None if m is None else 1000.0 * m, " mm") for m in widths_m)
    return (*in_mm, NONE, NONE, NONE, percent(errors.coverage95), *widths_in_mm)


def _cells(errors: TargetErrors) -> tuple[str, ...]:
    return (
        *(decimal(e, f" {errors.unit}") for e in (errors.mean_abs, errors.bias, errors.std, errors.max_abs)),
        decimal(errors.mean_abs_pct),
        decimal(errors.mean_abs_pct_with_misses),
        decimal(errors.mean_abs_pct_of_gross),
        percent(errors.coverage95),
        decimal(errors.half_width_pct),
        decimal(errors.interval_score_pct),
    )


def runs_table(judgement: Judgement, part: BatchSet) -> Table:
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
    errors = ("mean |e|", "bias", "max", "95 % covers", "± %", "score %")
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
    widths = (decimal(errors.half_width_pct), decimal(errors.interval_score_pct))
    return (*(decimal(figure, f" {errors.unit}") for figure in figures), percent(errors.coverage95), *widths)


def batches_table(judgement: Judgement, part: BatchSet) -> Table:
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
