"""The accuracy with fewer runs: errors over their number, found by leaving runs out."""

from collections.abc import Iterator, Sequence

import numpy as np

from gateway.calibration.judgement.evaluation import TARGETS
from gateway.calibration.judgement.learning_curve import LearningCurve, Rung, ScoreSpread
from gateway.reports.charts import Axis, Chart, Marker, Panel, Points, Rule, Section, Table
from gateway.words import NONE, decimal, estimator_name, percent

_MARKERS: tuple[Marker, ...] = ("circle", "diamond", "square", "x")
_ERRORS = "Mean |error| in percent of the ranges (12)"
_FIGURES = (
    "± its standard deviation between choices, and that of the worst choice; ± is half the 95 % intervals, the score "
    "their width and 40 times what the truth lies outside; refused batches are in no mean"
)


def learning_section(curve: LearningCurve) -> Section:
    """Errors on runs left out of the calibration, and on the later part of all runs."""
    names = sorted({rung.estimator for rung in curve.rungs})
    sizes = sorted({rung.n_runs for rung in curve.rungs})
    runs = Axis("known-load runs", places=tuple(map(str, sizes)))
    panels = tuple(
        Panel(
            runs,
            Axis(f"mean |error| of {target.replace('_', ' ')} [% of range]"),
            (Rule(0.0), *_points(curve, names, sizes, target)),
        )
        for target in TARGETS
    )
    chart = Chart(
        "learning_curve",
        "Mean errors on batches of runs that were left out, over the number of runs calibrated on: means over choices "
        "of runs, bars their standard deviation between choices. Every choice holds the empty run, if there is one.",
        "Learning curve: mean error of payload and front share over the number of known-load runs. " + _in_words(curve),
        panels,
    )
    tables = [_table(f"{_ERRORS} over choices of runs, the empty one among them", curve.rungs)]
    if curve.triples:
        what = "over every triple of the empty run and two loads at different positions"
        tables.append(_table(f"{_ERRORS} {what}", curve.triple_rungs))
    return Section("learning-curve", "With fewer runs", (), (chart,), tuple(tables))


def _points(curve: LearningCurve, names: Sequence[str], sizes: Sequence[int], target: str) -> list[Points]:
    points = []
    for colour, name in enumerate(names):
        rows = [
            (sizes.index(rung.n_runs), *_mean_and_std(rung.left_out, target))
            for rung in curve.rungs
            if rung.estimator == name
        ]
        known = np.array([row for row in rows if None not in row], dtype=float).reshape(-1, 3)
        if len(known):
            place, mean, std = known.T
            x = place + 0.06 * colour  # beside one another
            points.append(Points(x, mean, estimator_name(name), colour, _MARKERS[colour], mean - std, mean + std))
    return points


def _mean_and_std(spread: ScoreSpread, target: str) -> tuple[float | None, float | None]:
    return getattr(spread, f"{target}_mean_pct"), getattr(spread, f"{target}_std_pct")


def _in_words(curve: LearningCurve) -> str:
    return " ".join(
        f"{rung.n_runs} runs, {estimator_name(rung.estimator)}: {decimal(rung.left_out.payload_mean_pct, ' %', 1)}."
        for rung in curve.rungs
        if rung.left_out.payload_mean_pct is not None
    )


def _table(caption: str, rungs: Sequence[Rung]) -> Table:
    rows = tuple(
        (str(rung.n_runs), estimator_name(rung.estimator), _tried(rung), judged, *_cells(spread))
        for rung in rungs
        for judged, spread in (("runs left out", rung.left_out), ("later part of all", rung.validation))
        if spread.n_trials
    )
    errors = ("worst", "95 % covers", "±", "score")
    columns = ("Runs", "estimator", "choices", "judged on", "payload", *errors, "share", *errors, "refused")
    return Table(f"{caption}; {_FIGURES}", columns, rows, n_heads=2)


def _tried(rung: Rung) -> str:
    return f"{rung.n_subsets - rung.n_refused} of {rung.n_subsets}" if rung.n_refused else str(rung.n_subsets)


def _cells(spread: ScoreSpread) -> Iterator[str]:
    for target in TARGETS:
        mean, std = _mean_and_std(spread, target)
        yield NONE if mean is None or std is None else f"{mean:.1f} ± {std:.1f} %"
        yield decimal(getattr(spread, f"{target}_worst_pct"), " %", 1)
        yield percent(getattr(spread, f"{target}_coverage95"))
        yield decimal(getattr(spread, f"{target}_half_width_pct"), " %", 1)
        yield decimal(getattr(spread, f"{target}_interval_score_pct"), " %", 1)
    yield percent(spread.rejected_share)
