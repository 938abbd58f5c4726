"""springscale study: what a calibration is worth, found out by experiment. Each takes minutes."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from gateway.calibration.campaign import load_campaign
from gateway.calibration.judgement.learning_curve import MOST_SUBSETS, SEED
from gateway.cli.options import FILE, as_json, batch_settings, window
from gateway.cli.progress import bar
from gateway.cli.study_text import advice_table, learning_curve_table
from gateway.config import ESTIMATOR_NAMES
from gateway.offline import coverage as coverage_study
from gateway.offline.advice_study import advice_study
from gateway.offline.coverage_drives import Scope
from gateway.offline.learning_curve import learning_curve as study_learning_curve
from gateway.records import json_line
from gateway.reports.coverage_page import coverage_page
from gateway.reports.study_pages import advice_page, learning_curve_page

_estimators = click.option(
    "--estimator", "estimators", type=click.Choice(ESTIMATOR_NAMES), multiple=True, help="[default: all]"
)
_output = click.option("--output", type=FILE, default=None, help="directory to write the numbers and their page to")
_seed = click.option("--seed", type=click.IntRange(min=0), default=SEED, show_default=True)


@click.group("study")
def study() -> None:
    """Experiments on calibration: fewer runs, advised runs, coverage of intervals. Each takes minutes."""


@study.command("learning-curve")
@click.argument("campaign", type=FILE)
@_estimators
@click.option(
    "--subsets",
    "most_subsets",
    type=click.IntRange(min=1),
    default=MOST_SUBSETS,
    show_default=True,
    help="choices of runs to try for each number of runs",
)
@_seed
@_output
@window
@as_json
def learning_curve(
    campaign: Path,
    estimators: tuple[str, ...],
    most_subsets: int,
    seed: int,
    output: Path | None,
    window_s: float | None,
    as_json: bool,
) -> None:
    """How accurate would CAMPAIGN be with 2, 3, 4, 6, 10 of its runs? Found by leaving runs out."""
    loaded = load_campaign(campaign)
    with bar(len(loaded.runs), "reading drives") as progress:

        def on_trial(done: int, of: int) -> None:
            progress.label, progress.length = "calibrating and judging", of
            progress.update(done - progress.pos)

        curve = study_learning_curve(
            loaded,
            batch_settings(window_s),
            estimators=estimators or ESTIMATOR_NAMES,
            most_subsets=most_subsets,
            seed=seed,
            on_run=lambda done, of: progress.update(done - progress.pos),
            on_trial=on_trial,
        )
    found = curve.to_json()
    _write(output, "learning_curve", found, learning_curve_page(found))
    click.echo(json_line(found) if as_json else learning_curve_table(curve))


@study.command("advice")
@click.argument("campaign", type=FILE)
@_output
@window
@as_json
def advice(campaign: Path, output: Path | None, window_s: float | None, as_json: bool) -> None:
    """Does it help to drive what --plan advises? Tried with CAMPAIGN's own runs as the next ones."""
    loaded = load_campaign(campaign)
    with bar(len(loaded.runs), "reading drives") as progress:

        def on_fit(done: int, of: int) -> None:
            progress.label, progress.length = "calibrating and judging", of
            progress.update(done - progress.pos)

        found = advice_study(
            loaded,
            batch_settings(window_s),
            on_run=lambda done, of: progress.update(done - progress.pos),
            on_fit=on_fit,
        )
    numbers = found.to_json()
    _write(output, "advice", numbers, advice_page(numbers))
    click.echo(json_line(numbers) if as_json else advice_table(found))


@study.command("coverage")
@click.option("--vans", "n_vans", type=click.IntRange(min=2), default=Scope().n_vans, show_default=True)
@click.option("--seed", type=click.IntRange(min=0), default=coverage_study.SEED, show_default=True)
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="processes that drive")
@_output
@as_json
def coverage(n_vans: int, seed: int, workers: int, output: Path | None, as_json: bool) -> None:
    """Do 95 % intervals hold the truth? Simulated vans, each calibrated and then driven elsewhere; ~20 s a van."""
    with bar(n_vans, "calibrating and driving vans") as progress:
        found = coverage_study.coverage(
            Scope(n_vans=n_vans), seed, workers=workers, on_van=lambda done, of: progress.update(done - progress.pos)
        ).to_json()
    page = coverage_page(found)
    _write(output, "coverage", found, page)
    click.echo(json_line(found) if as_json else page)


def _write(output: Path | None, name: str, found: Mapping[str, Any], page: str) -> None:
    """The numbers as NAME.json and their page as NAME.md, where a directory was named."""
    if output is None:
        return
    output.mkdir(parents=True, exist_ok=True)
    (output / f"{name}.json").write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (output / f"{name}.md").write_text(page, encoding="utf-8")
