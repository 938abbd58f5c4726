"""Estimates against the truth: the error table (12), and charts of errors, residuals and coverage of intervals."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from scipy.special import ndtri

from gateway.budget import BudgetLine
from gateway.calibration.judgement.answers import LEVELS, Answers, answers_of, observed_coverage, standardised
from gateway.calibration.judgement.assessment import PART_NAMES, PART_TEXT, BatchSet, Judgement
from gateway.calibration.judgement.coverage import IDEAL_SCORE
from gateway.calibration.judgement.evaluation import (
    TARGETS,
    CgLeftErrors,
    Comparison,
    Errors,
    Judged,
    Target,
    TargetErrors,
)
from gateway.estimate import Z95
from gateway.reasons import REMEDIES, SOURCES
from gateway.records import F64, iso_utc
from gateway.reports.charts import GREY, Axis, Chart, LineMark, Marker, Panel, Points, Rule, Section, Table
from gateway.words import NONE, counted, decimal, estimator_name, known, percent

_MARKERS: Final[Mapping[BatchSet, Marker]] = {BatchSet.LEFT_OUT: "circle", BatchSet.VALIDATION: "diamond"}
_COLOURS: Final[Mapping[BatchSet, int]] = {
    BatchSet.LEFT_OUT: 0,
    BatchSet.VALIDATION: 1,
    BatchSet.IDENTIFICATION: 3,
    BatchSet.ALL: 0,
}


def accuracy_section(judgement: Judgement, budget: Sequence[BudgetLine] = ()) -> Section:
    """The errors of one estimator; ``budget`` has the sources of its stated errors."""
    name = estimator_name(judgement.estimator)
    targets = [target for target in TARGETS if _has_answers(judgement, target)]
    charts = (
        _estimated_over_true(judgement, targets),
        _residuals(judgement, targets),
        _coverage(judgement, targets),
    )
    tables = tuple(runs_table(judgement, part) for part in judgement.tables)
    batches = tuple(batches_table(judgement, part) for part in judgement.tables)
    return Section(
        f"accuracy-{judgement.estimator.replace('_', '-')}",
        f"Accuracy of the {name}",
        (*(PART_TEXT[part] for part in judgement.tables), *_sideways(judgement)),
        tuple(chart for chart in charts if chart is not None),
        (summary_table(judgement), *([budget_table(budget)] if budget else [])),
        (("Errors run by run", tables), ("Every batch", batches)),
    )


def _sideways(judgement: Judgement) -> Iterator[str]:
    """A sentence for every set with known and answered lateral places."""
    for part, table in judgement.tables.items():
        found = table.errors.cg_left
        if found is None or found.mean_abs_m is None:
            continue
        wheels = table.errors.wheels
        of_wheels = wheels.mean_abs_pct_of_gross if wheels else None
        n_told = sum(bool(np.isfinite(one.cg_left[:2]).all()) for one in table.judged)
        yield (
            f"To the side, {PART_NAMES[part]}: the centre of gravity's place beside the centre line errs by "
            f"{1000.0 * found.mean_abs_m:.0f} mm on average over {counted(n_told, 'answer')} to a load whose place was "
            f"noted, and its 95 % intervals contain the truth in {percent(found.coverage95)}"
            + ("." if of_wheels is None else f"; a wheel's load errs by {of_wheels:.1f} % of the gross weight.")
        )


def _has_answers(judgement: Judgement, target: Target) -> bool:
    return any(table.errors.of(target).mean_abs is not None for table in judgement.tables.values())


_TRUE: Final = {"payload": "payload [kg]", "front_share": "front share [%]"}
_ERROR: Final = {"payload": "error of payload [kg]", "front_share": "error of front share [pp]"}


def _sets(judgement: Judgement, target: Target) -> list[tuple[BatchSet, Answers]]:
    """The sets that were not fitted, or all if there are none."""
    unfitted = [part for part in judgement.tables if part is not BatchSet.IDENTIFICATION]
    sets = [(part, answers_of(judgement.tables[part].judged, target)) for part in unfitted or judgement.tables]
    return [(part, answers) for part, answers in sets if len(answers.run)]


def _points(part: BatchSet, answers: Answers, x: F64, y: F64, half: F64 | None = None) -> Points:
    low, high = (None, None) if half is None else (y - half, y + half)
    return Points(x, y, PART_NAMES[part], _COLOURS[part], _MARKERS.get(part, "square"), low, high)


def _estimated_over_true(judgement: Judgement, targets: Sequence[Target]) -> Chart | None:
    if not targets:
        return None
    panels = []
    for target in targets:
        sets = _sets(judgement, target)
        ends = np.array([f([f(a.true) for _, a in sets]) for f in (min, max)])
        marks = [_points(part, a, a.true, a.estimated, a.half95) for part, a in sets]
        exact = LineMark(ends, ends, "exact", GREY, "dash")
        panels.append(Panel(Axis(f"true {_TRUE[target]}"), Axis(f"estimated {_TRUE[target]}"), (exact, *marks)))
    name = estimator_name(judgement.estimator)
    return Chart(
        f"estimated_over_true_{judgement.estimator}",
        f"Estimates of the {name} over the truth, with 95 % intervals. On the dashed line an estimate is exact.",
        f"Estimated over true {' and '.join(_PLAIN[each] for each in targets)} of the {name}. {_summary(judgement)}",
        tuple(panels),
        row_height_px=400,
    )


_PLAIN: Final = {"payload": "payload", "front_share": "front share"}


def _summary(judgement: Judgement) -> str:
    return " ".join(
        f"{PART_NAMES[part].capitalize()}: mean error {decimal(table.errors.payload.mean_abs, ' kg')} and "
        f"{decimal(table.errors.front_share.mean_abs, ' pp')}."
        for part, table in judgement.tables.items()
    )


def _residuals(judgement: Judgement, targets: Sequence[Target]) -> Chart | None:
    """Errors over the truth, over speed, and against a normal distribution."""
    if not targets:
        return None
    panels = [panel for target in targets for panel in _residual_panels(judgement, target)]
    return Chart(
        f"residuals_{judgement.estimator}",
        "Errors over the truth and over speed: a slope or a bow is something the model misses. Right: errors in their "
        "own standard deviations, in order, over those of a normal law; on the dashed line intervals are as wide as "
        "errors are, a steeper course means intervals too narrow.",
        f"Residuals of the {estimator_name(judgement.estimator)} over truth, speed and normal quantiles.",
        tuple(panels),
        most_columns=3,
        row_height_px=300,
    )


def _residual_panels(judgement: Judgement, target: Target) -> list[Panel]:
    sets = _sets(judgement, target)
    zero, error = Rule(0.0), Axis(_ERROR[target])
    over_truth = tuple(_points(part, a, a.true, a.error) for part, a in sets)
    over_speed = tuple(_points(part, a, 3.6 * a.speed_mps, a.error) for part, a in sets)
    dof = judgement.dof.get(target)
    in_order = tuple(_in_order(part, a, dof) for part, a in sets)
    ends = np.array([-2.5, 2.5])
    return [
        Panel(Axis(f"true {_TRUE[target]}"), error, (zero, *over_truth)),
        Panel(Axis("mean speed [km/h]"), error, (zero, *over_speed)),
        Panel(
            Axis("normal quantile"),
            Axis(f"{_PLAIN[target]}: error / standard deviation"),
            (LineMark(ends, ends, "exact", GREY, "dash"), *in_order),
        ),
    ]


def _in_order(part: BatchSet, answers: Answers, dof: float | None) -> Points:
    z = standardised(answers, dof)
    order = np.argsort(z, kind="stable")
    expected = ndtri((np.arange(len(z)) + 0.5) / len(z))
    return Points(expected, z[order], PART_NAMES[part], _COLOURS[part], _MARKERS.get(part, "square"))


def _coverage(judgement: Judgement, targets: Sequence[Target]) -> Chart | None:
    panels = [panel for target in targets if (panel := _coverage_panel(judgement, target)) is not None]
    if not panels:
        return None
    return Chart(
        f"coverage_{judgement.estimator}",
        "How often intervals of each nominal level hold the truth. Above the dashed line they are wider than they "
        "need be, below it narrower than they claim. Bars: what so few runs can tell, batches of one run being alike.",
        f"Observed over nominal coverage of the {estimator_name(judgement.estimator)}: "
        + " ".join(
            f"95 % intervals of payload hold {percent(table.errors.payload.coverage95)} over the {PART_NAMES[part]}."
            for part, table in judgement.tables.items()
        ),
        tuple(panels),
        row_height_px=360,
    )


def _coverage_panel(judgement: Judgement, target: Target) -> Panel | None:
    ends = np.array([0.0, 100.0])
    dof = judgement.dof.get(target)
    marks = []
    for shift, (part, answers) in enumerate(_sets(judgement, target)):
        if len(np.unique(answers.run)) > 1:
            share, low, high = 100.0 * observed_coverage(answers, dof).T
            x, marker = 100.0 * LEVELS + 0.8 * shift, _MARKERS.get(part, "square")
            marks.append(Points(x, share, PART_NAMES[part], _COLOURS[part], marker, low, high))
    if not marks:
        return None
    nominal = LineMark(ends, ends, "exact", GREY, "dash")
    return Panel(Axis("nominal [%]"), Axis("observed [%]"), (nominal, *marks), _PLAIN[target])


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
            known(first.payload_kg, " kg"),
            known(first.front_share_pct, " %", ".1f"),
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
