"""springscale estimate: logs to estimates, by the same pipeline as the service."""

from dataclasses import replace
from pathlib import Path

import click

from gateway.bus.logs import LogReport
from gateway.calibration.known_weights_file import FILE_NAME
from gateway.cli.options import FILE, as_json, batch_settings, one_estimator, window
from gateway.cli.text.estimate import sentence
from gateway.config import load_settings
from gateway.core.settings import BatchSettings
from gateway.errors import ConfigurationError
from gateway.estimate_json import estimate_to_json
from gateway.offline import estimates_of_logs
from gateway.records import json_line
from gateway.setup import Setup, load_setup, setup_of


@click.command("estimate")
@click.argument("logs", nargs=-1, required=True, type=FILE)
@click.option("--config", "config_path", type=FILE, default=None, help="springscale.toml of the service")
@click.option("--signals", default=None, help="signal map: a TOML file, or springscale:NAME")
@click.option("--calibration", type=FILE, default=None, help="calibration file")
@click.option(
    "--known-weights", type=FILE, default=None, help="known_weights.json of a service [default: that of --config]"
)
@click.option("--no-known-weights", is_flag=True, help="by the calibration alone, whatever weights the service knows")
@one_estimator
@window
@as_json
def estimate(
    logs: tuple[Path, ...],
    config_path: Path | None,
    signals: str | None,
    calibration: Path | None,
    known_weights: Path | None,
    no_known_weights: bool,
    estimator: str | None,
    window_s: float | None,
    as_json: bool,
) -> None:
    """One line per batch of every LOG, rejected ones included with their reasons.

    With several logs each line says of which it is: in front of the line, or as "log" in its JSON.
    """
    if known_weights is not None and no_known_weights:
        raise click.UsageError("give --known-weights FILE or --no-known-weights, not both")
    setup, settings, state = prepared(config_path, signals, calibration, estimator, window_s)
    if not no_known_weights:
        setup = with_known_weights(setup, known_weights, state)
    for log in logs:
        for weighed in estimates_of_logs([log], setup, settings, on_read=_tell):
            record = estimate_to_json(weighed)
            if len(logs) == 1:
                click.echo(json_line(record) if as_json else sentence(record))
            else:
                click.echo(json_line({"log": str(log), **record}) if as_json else f"{log}: {sentence(record)}")


def _tell(report: LogReport) -> None:
    """What could not be read, beside the estimates."""
    for remark in report.remarks():
        click.echo(remark, err=True)


def prepared(
    config_path: Path | None,
    signals: str | None,
    calibration: Path | None,
    estimator: str | None,
    window_s: float | None,
) -> tuple[Setup, BatchSettings, Path | None]:
    """What estimates, how batches are formed, and where the service keeps its state (None without a service)."""
    if config_path is not None:
        if signals is not None:
            raise click.UsageError("give --config or --signals, not both")
        configured = load_settings(config_path)
        if calibration is not None:
            configured = configured.model_copy(update={"calibration": calibration})
        batch = replace(configured.batch.for_core(window_s=window_s), position_decimals=configured.position.decimals)
        return setup_of(configured, estimator), batch, configured.store.directory
    if signals is None:
        raise click.UsageError("give --config FILE, or --signals FILE (and --calibration FILE)")
    return load_setup(signals, calibration, estimator), batch_settings(window_s), None


def with_known_weights(setup: Setup, named: Path | None, state: Path | None) -> Setup:
    """With those of a file that was named, which must have one of this calibration; else with the service's."""
    if named is None:
        return setup if state is None else setup.with_known_weights_of(state / FILE_NAME)
    known = setup.with_known_weights_of(named)
    if known.knowledge is None:
        calibration_id = setup.calibration.id if setup.calibration else "none"
        raise ConfigurationError(
            f"{named}: no known weight in use for the estimator {setup.estimator} and the calibration {calibration_id}"
        )
    return known
