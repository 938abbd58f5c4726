"""Estimates against the truth: the error table (12), and a chart of the estimates over it."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from gateway.calibration.judgement.assessment import PART_NAMES, PART_TEXT, BatchSet, Judgement
from gateway.calibration.judgement.coverage import IDEAL_SCORE
from gateway.calibration.judgement.evaluation import CgLeftErrors, Errors, Target, TargetErrors
from gateway.estimates.batch_estimate import Z95
from gateway.estimates.budget import BudgetLine
from gateway.estimates.reasons import REMEDIES, SOURCES
from gateway.records import F64
from gateway.reports.charts import GREY, Axis, Chart, LineMark, Marker, Panel, Points, Section, Table
from gateway.words import NONE, decimal, estimator_name, known, percent

_SETS: Final[Mapping[BatchSet, tuple[int, Marker]]] = {  # colour and marker
    BatchSet.LEFT_OUT: (0, "circle"),
    BatchSet.VALIDATION: (1, "diamond"),
    BatchSet.IDENTIFICATION: (3, "square"),
    BatchSet.ALL: (0, "square"),
}
_TARGETS: Final[Mapping[Target, tuple[str, str]]] = {"payload": ("payload", "kg"), "front_share": ("front share", "%")}


def accuracy_section(judgement: Judgement, budget: Sequence[BudgetLine] = ()) -> Section:
    """The errors of one estimator; ``budget`` has the sources of its stated errors."""
    name = estimator_name(judgement.estimator)
    tables = tuple(runs_table(judgement, part) for part in judgement.tables)
    return Section(
        f"accuracy-{judgement.estimator.replace('_', '-')}",
        f"Accuracy of the {name}",
        tuple(PART_TEXT[part] for part in judgement.tables),
        tuple(_charts(judgement, name)),
        (summary_table(judgement), *([budget_table(budget)] if budget else [])),
        (("Errors run by run", tables),),
    )


def _charts(judgement: Judgement, name: str) -> Iterator[Chart]:
    """Estimates over the truth, of the sets that were not fitted, or else of all."""
    unfitted = [part for part in judgement.tables if part is not BatchSet.IDENTIFICATION]
    panels = []
    for target, (what, unit) in _TARGETS.items():
        answers = {part: _answered(judgement, part, target) for part in unfitted or judgement.tables}
        every = np.concatenate([np.empty(0), *(rows[:, 0] for rows in answers.values())])
        if every.size:
            ends = np.array([every.min(), every.max()])
            marks = [
                Points(rows[:, 0], rows[:, 1], PART_NAMES[part], *_SETS[part], low=rows[:, 2], high=rows[:, 3])
                for part, rows in answers.items()
                if len(rows)
            ]
            axes = (Axis(f"true {what} [{unit}]"), Axis(f"estimated {what} [{unit}]"))
            panels.append(Panel(*axes, (LineMark(ends, ends, "exact", GREY, "dash"), *marks)))
    if panels:
        errors = [(PART_NAMES[part], table.errors) for part, table in judgement.tables.items()]
        yield Chart(
            f"estimated_over_true_{judgement.estimator}",
            f"Estimates of the {name} over the truth, with 95 % intervals. On the dashed line an estimate is exact.",
            f"Estimates of the {name} over the truth. "
            + " ".join(
                f"{part.capitalize()}: mean error {decimal(of.payload.mean_abs, ' kg')} and "
                f"{decimal(of.front_share.mean_abs, ' pp')}."
                for part, of in errors
            ),
            tuple(panels),
            row_height_px=400,
        )


def _answered(judgement: Judgement, part: BatchSet, target: Target) -> F64:
    """Rows (n, 4) of Comparison of the batches with an answer and a known truth."""
    rows = np.array([one.compared(target) for one in judgement.tables[part].judged], float).reshape(-1, 4)
    return np.asarray(rows[np.isfinite(rows[:, :2]).all(axis=1)])


_COLUMNS: Final = (
    "mean |e|", "bias", "std", "max", "mean |e| %", "with misses %", "of gross %", "95 % covers", "± (95 %)", "score",
)  # fmt: skip


def summary_table(judgement: Judgement) -> Table:
    """Both quantities over every set."""
    rows = [
        (PART_NAMES[part], label, table.errors.answered, *cells)
        for part, table in judgement.tables.items()
        for label, cells in _labelled(table.errors)
    ]
    return Table(
        "Errors (12): in kg and percentage points, and in percent of the vehicle's ranges; of gross: in percent of "
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
    widths_m = (errors.half_width_m, errors.interval_score_m)
    first, last = ([decimal(None if m is None else 1000.0 * m, " mm") for m in of] for of in (lengths_m, widths_m))
    return (*first, NONE, NONE, NONE, percent(errors.coverage95), *last)


def _cells(errors: TargetErrors) -> tuple[str, ...]:
    return (
        *(decimal(e, f" {errors.unit}") for e in (errors.mean_abs, errors.bias, errors.std, errors.max_abs)),
        *map(decimal, (errors.mean_abs_pct, errors.mean_abs_pct_with_misses, errors.mean_abs_pct_of_gross)),
        percent(errors.coverage95),
        *map(decimal, (errors.half_width_pct, errors.interval_score_pct)),
    )


def runs_table(judgement: Judgement, part: BatchSet) -> Table:
    """A line for every run of one set."""
    chosen = (0, 1, 3, 7, 8, 9)  # of _COLUMNS
    rows = tuple(
        (
            str(first.drive.number),
            known(first.drive.payload_kg, " kg"),
            known(first.drive.front_share_pct, " %", ".1f"),
            errors.answered,
            *(_cells(of)[n] for of in (errors.payload, errors.front_share) for n in chosen),
        )
        for first, errors in judgement.tables[part].runs
    )
    figures = (f"{what} {_COLUMNS[n]}" for what in ("payload", "share") for n in chosen)
    caption = f"{PART_NAMES[part].capitalize()}, run by run; ± and score in percent of the range"
    return Table(caption, ("Run", "payload", "front share", "answered", *figures), rows)
