"""springscale evaluate: the error table of (12)."""

from pathlib import Path
from typing import Any

import click

from gateway.calibration.campaign import Campaign, load_campaign
from gateway.calibration.file.calibration_file import CalibrationFile, load_calibration
from gateway.calibration.judgement.evaluation import Judged, error_table
from gateway.calibration.judgement.evidence import Part, evidence_of_evaluation
from gateway.cli.options import FILE, as_json, batch_settings, one_estimator, window
from gateway.cli.progress import bar, counted
from gateway.errors import ConfigurationError
from gateway.offline.campaigns import Split, judge_campaign
from gateway.records import json_line


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
    """Hold estimates against the known loads of CAMPAIGN."""
    loaded, held = load_campaign(campaign), load_calibration(calibration)
    chosen = estimator or held.estimators[0]
    if chosen not in held.estimators:
        raise ConfigurationError(f"{calibration}: holds no calibration for {chosen}, only {', '.join(held.estimators)}")
    with bar(len(loaded.runs), "reading drives") as progress:
        judged = judge_campaign(
            loaded,
            held.for_core(),
            batch_settings(window_s),
            estimator=chosen,
            split=split,
            on_run=lambda done, of: progress.update(done - progress.pos),
        )
    table = error_table(judged, loaded.vehicle, chosen)
    click.echo(json_line(table) if as_json else _table(table))
    if report is not None:
        _report(report, loaded, held, chosen, split, judged)


def _report(
    directory: Path, campaign: Campaign, held: CalibrationFile, estimator: str, split: Split, judged: list[Judged]
) -> None:
    from gateway.reports.calibration import report as calibration_report  # noqa: PLC0415 # a vehicle has no matplotlib

    part = Part(split)
    evidence = evidence_of_evaluation(campaign, held, estimator, part, judged)
    with counted("drawing") as on_chart:
        written = calibration_report.write_evaluation_report(directory, evidence, on_chart)
    click.echo(str(written), err=True)


def _table(table: dict[str, Any]) -> str:
    lines = [
        f"{table['estimator']}: {table['n_batches']} batches, {table['n_rejected']} rejected "
        f"{table['rejected_by_reason'] or ''}".rstrip(),
        f"{'':14}{'mean |e|':>10}{'+ misses':>10}{'bias':>9}{'std':>9}{'max':>9}{'mean |e|':>12}{'covered':>9}",
        _row("payload", table["payload"], "kg"),
        _row("front share", table["front_share"], "pp"),
        "",
        f"{'run':>4}  {'true':>18}{'batches':>9}{'rejected':>10}"
        f"{'payload, mean |e|':>19}{'bias':>10}{'share, mean |e|':>17}{'bias':>10}",
        *(_run_row(run) for run in table["runs"]),
    ]
    return "\n".join(lines)


def _run_row(run: dict[str, Any]) -> str:
    payload, share = run["payload"], run["front_share"]
    truth = f"{run['true_payload_kg']:g} kg at {run['true_front_share_pct']:.1f} %"
    errors = (
        _shown(payload["mean_abs_kg"], " kg", 19),
        _shown(payload["bias_kg"], " kg", 10),
        _shown(share["mean_abs_pp"], " pp", 17),
        _shown(share["bias_pp"], " pp", 10),
    )
    return f"{run['run']:>4}  {truth:>18}{run['n_batches']:>9}{run['n_rejected']:>10}{''.join(errors)}"


def _row(name: str, errors: dict[str, Any], unit: str) -> str:
    percents = ("mean_abs_pct", "mean_abs_pct_with_misses", "bias_pct", "std_pct", "max_abs_pct")
    shown = [_shown(errors[key], " %", width) for key, width in zip(percents, (10, 10, 9, 9, 9), strict=True)]
    covered = errors["coverage95"]
    share = _shown(None if covered is None else 100.0 * covered, " %", 9)
    return f"{name:14}{''.join(shown)}{_shown(errors[f'mean_abs_{unit}'], f' {unit}', 12)}{share}"


def _shown(number: float | None, unit: str, width: int) -> str:
    return f"{'-' if number is None else f'{number:.2f}{unit}':>{width}}"
