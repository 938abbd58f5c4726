"""springscale calibrate: known-load drives to a calibration file."""

import shlex
import sys
from pathlib import Path

import click

from gateway.calibration.campaign import load_campaign
from gateway.calibration.file import CalibrationFile
from gateway.cli.options import FILE, RunNumbers, as_json, batch_settings, window
from gateway.cli.progress import bar
from gateway.config import ESTIMATOR_NAMES
from gateway.offline.calibrate import calibrate as fit
from gateway.records import json_line


@click.command("calibrate")
@click.argument("campaign", type=FILE)
@click.option("--output", type=FILE, required=True, help="calibration file to write")
@click.option("--estimator", "estimators", type=click.Choice(ESTIMATOR_NAMES), multiple=True, help="[default: all]")
@click.option("--runs", "numbers", type=RunNumbers(), default=None, help="these runs only, counted from 1: 1,5,10")
@window
@as_json
def calibrate(
    campaign: Path,
    output: Path,
    estimators: tuple[str, ...],
    numbers: tuple[int, ...] | None,
    window_s: float | None,
    as_json: bool,
) -> None:
    """Fit every estimator on the identification parts of CAMPAIGN's runs."""
    loaded = load_campaign(campaign)
    with bar(len(loaded.runs) if numbers is None else len(numbers), "reading drives") as progress:
        found = fit(
            loaded,
            batch_settings(window_s),
            estimators=estimators or ESTIMATOR_NAMES,
            numbers=numbers,
            command=shlex.join(["springscale", *sys.argv[1:]]),
            on_run=lambda done, of: progress.update(done - progress.pos),
        ).file
    output.write_text(found.to_json(), encoding="utf-8")
    click.echo(json_line(_summary(found, output)) if as_json else _sentences(found, output))


def _summary(found: CalibrationFile, output: Path) -> dict[str, object]:
    return {
        "calibration_id": found.id,
        "output": str(output),
        "estimators": list(found.estimators),
        "seen": found.seen.model_dump(mode="json"),
        "expected_errors": {name: errors.model_dump(mode="json") for name, errors in found.expected_errors.items()},
        "warnings": list(found.warnings),
    }


def _sentences(found: CalibrationFile, output: Path) -> str:
    low, high = found.seen.payload_kg
    lines = [
        f"{output}: {', '.join(found.estimators)}; payloads {low:g} to {high:g} kg, "
        f"{len(found.provenance.runs)} runs, {sum(run.n_batches for run in found.provenance.runs)} batches",
        f"id {found.id}",
        *(f"warning: {warning}" for warning in found.warnings),
    ]
    return "\n".join(lines)
