"""springscale estimate: logs to estimates, by the same pipeline as the service."""

from pathlib import Path

import click

from gateway.cli.options import FILE, as_json, batch_settings, one_estimator, window
from gateway.cli.sentence import sentence
from gateway.config import load_settings
from gateway.core.settings import BatchSettings
from gateway.offline.estimates import Setup, estimates_of_logs, load_setup, setup_of
from gateway.records import estimate_to_json, json_line


@click.command("estimate")
@click.argument("logs", nargs=-1, required=True, type=FILE)
@click.option("--config", "config_path", type=FILE, default=None, help="springscale.toml of the service")
@click.option("--signals", default=None, help="signal map: a TOML file, or springscale:NAME")
@click.option("--calibration", type=FILE, default=None, help="calibration file")
@one_estimator
@window
@as_json
def estimate(
    logs: tuple[Path, ...],
    config_path: Path | None,
    signals: str | None,
    calibration: Path | None,
    estimator: str | None,
    window_s: float | None,
    as_json: bool,
) -> None:
    """One line per batch of every LOG, rejected ones included with their reasons."""
    setup, settings = _prepared(config_path, signals, calibration, estimator, window_s)
    for found in estimates_of_logs(logs, setup, settings):
        record = estimate_to_json(found)
        click.echo(json_line(record) if as_json else sentence(record))


def _prepared(
    config_path: Path | None,
    signals: str | None,
    calibration: Path | None,
    estimator: str | None,
    window_s: float | None,
) -> tuple[Setup, BatchSettings]:
    if config_path is not None:
        if signals is not None:
            raise click.UsageError("give --config or --signals, not both")
        configured = load_settings(config_path)
        if calibration is not None:
            configured = configured.model_copy(update={"calibration": calibration})
        return setup_of(configured, estimator), configured.batch.for_core(window_s=window_s)
    if signals is None:
        raise click.UsageError("give --config FILE, or --signals FILE (and --calibration FILE)")
    return load_setup(signals, calibration, estimator), batch_settings(window_s)
