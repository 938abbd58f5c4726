"""springscale evaluate: the error table of (12)."""

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import click

from gateway.calibration.campaign_file import load_campaign
from gateway.calibration.file import load_calibration
from gateway.calibration.judgement.advice import verdicts_of
from gateway.calibration.judgement.assessment import BatchSet, assess_evaluation
from gateway.calibration.judgement.evaluation import Errors, ErrorTable, Judged, TargetErrors, error_table
from gateway.cli.calibrate import report_written
from gateway.cli.options import FILE, as_json, batch_settings, one_estimator, window
from gateway.cli.progress import counted
from gateway.errors import ConfigurationError
from gateway.offline.campaigns import Split, judge_runs, split_runs
from gateway.records import json_line
from gateway.words import known


@click.command("evaluate")
@click.argument("campaign", type=FILE)
@click.option("--calibration", type=FILE, required=True, help="calibration file")
@one_estimator
@click.option("--split", type=click.Choice(["identification", "validation", "all"]), default="validation")
@click.option("--report", type=FILE, default=None, help="directory to write a report into: report.html, figures")
@window
@as_json
def evaluate(
    campaign: Path,
    calibration: Path,
    estimator: str | None,
    split: Split,
    report: Path | None,
    window_s: float | None,
    as_json: bool,
) -> None:
    """Compare estimates with the known loads of CAMPAIGN."""
    loaded, held = load_campaign(campaign), load_calibration(calibration)
    chosen = estimator or held.estimators[0]
    if chosen not in held.estimators:
        contained = ", ".join(held.estimators)
        raise ConfigurationError(f"{calibration}: contains no calibration for {chosen}, only {contained}")
    with counted("reading drives") as on_run:
        runs = split_runs(loaded, batch_settings(window_s), on_run=on_run)
    for remark in dict.fromkeys(chain.from_iterable(run.log.remarks for run in runs)):
        click.echo(remark, err=True)
    judged = judge_runs(loaded, runs, held.for_core(), chosen, split)
    table = error_table(judged, loaded.vehicle, chosen)
    assessment = assess_evaluation(loaded.vehicle, held, BatchSet(split), table)
    [verdict] = verdicts_of(assessment)
    if as_json:
        click.echo(json_line(table.to_json() | {"verdict": verdict.to_json()}))
    else:
        click.echo(f"{text_of(table)}\n\n{verdict.text}")
    if report is not None:
        report_written(report, assessment)


def text_of(table: ErrorTable) -> str:
    """The table as a person reads it."""
    errors = table.errors
    rejected = ", ".join(f"{reason} ({n})" for reason, n in errors.rejected_by_reason.items())
    reasons = f": {rejected}" if rejected else ""
    lines = [
        f"{table.estimator}: {errors.n_batches} batches, {errors.n_rejected} rejected{reasons}",
        f"{'':14}{'mean |e|':>10}{'+ misses':>10}{'bias':>9}{'std':>9}{'max':>9}{'mean |e|':>12}{'covered':>10}"
        f"{'+- (95 %)':>11}{'score':>9}",
        _row("payload", errors.payload),
        _row("front share", errors.front_share),
        *_sideways_lines(errors),
        "",
        f"{'run':>4}  {'true':>18}{'batches':>9}{'rejected':>10}"
        f"{'payload, mean |e|':>19}{'bias':>10}{'share, mean |e|':>17}{'bias':>10}",
        *(_run_row(first, of_run) for first, of_run in table.runs),
    ]
    return "\n".join(lines)


def _row(name: str, errors: TargetErrors) -> str:
    return (
        f"{name:14}{_cell(errors.mean_abs_pct, '%', 10)}{_cell(errors.mean_abs_pct_with_misses, '%', 10)}"
        f"{_cell(errors.bias_pct, '%', 9)}{_cell(errors.std_pct, '%', 9)}{_cell(errors.max_abs_pct, '%', 9)}"
        f"{_cell(errors.mean_abs, errors.unit, 12)}{_percent(errors.coverage95, 10)}"
        f"{_cell(errors.half_width_pct, '%', 11)}{_cell(errors.interval_score_pct, '%', 9)}"
    )


def _sideways_lines(errors: Errors) -> Iterator[str]:
    """The errors of the lateral position and of the wheel loads, as far as they are known."""
    cg_left, wheels = errors.cg_left, errors.wheels
    if cg_left is not None and cg_left.mean_abs_m is not None:
        lengths = ((cg_left.bias_m, 9), (cg_left.std_m, 9), (cg_left.max_abs_m, 9), (cg_left.mean_abs_m, 12))
        in_mm = "".join(_millimetres(length_m, width) for length_m, width in lengths)
        widths = f"{_millimetres(cg_left.half_width_m, 11)}{_millimetres(cg_left.interval_score_m, 9)}"
        yield f"{'c.g. left':14}{'':20}{in_mm}{_percent(cg_left.coverage95, 10)}{widths}"
    if wheels is not None:
        mean, most = wheels.mean_abs_pct_of_gross, wheels.max_abs_pct_of_gross
        yield f"{'each wheel':14}{_cell(mean, '%', 10)}{'':28}{_cell(most, '%', 9)}{'of gross weight':>21}"


def _millimetres(length_m: float | None, width: int) -> str:
    return f"{'-' if length_m is None else f'{1000.0 * length_m:.1f} mm':>{width}}"


def _percent(share: float | None, width: int) -> str:
    return _cell(None if share is None else 100.0 * share, "%", width)


def _run_row(first: Judged, errors: Errors) -> str:
    truth, payload, share = (
        f"{known(first.drive.payload_kg, ' kg')} at {known(first.drive.front_share_pct, ' %', '.1f')}",
        errors.payload,
        errors.front_share,
    )
    return (
        f"{first.drive.number:>4}  {truth:>18}{errors.n_batches:>9}{errors.n_rejected:>10}"
        f"{_cell(payload.mean_abs, 'kg', 19)}{_cell(payload.bias, 'kg', 10)}"
        f"{_cell(share.mean_abs, 'pp', 17)}{_cell(share.bias, 'pp', 10)}"
    )


def _cell(number: float | None, unit: str, width: int) -> str:
    return f"{'-' if number is None else f'{number:.2f} {unit}':>{width}}"
