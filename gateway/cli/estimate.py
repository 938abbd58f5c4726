"""springscale estimate: logs to estimates, by the same pipeline as the service."""

from pathlib import Path

import click

from gateway.cli.options import FILE, as_json, batch_settings, one_estimator, window
from gateway.config import load_settings
from gateway.core.settings import BatchSettings
from gateway.offline.estimates import Setup, estimates_of_logs, load_setup, setup_of
from gateway.records import Estimate, estimate_to_json, iso_utc, json_line


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
        click.echo(json_line(estimate_to_json(found)) if as_json else _sentence(found))


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


def _sentence(found: Estimate) -> str:
    when = f"{iso_utc(found.t_start_ns)[:19]}Z"
    if not found.counted:
        return f"{when}  no estimate: {', '.join(found.rejected)}"
    return (
        f"{when}  payload {found.payload_kg:7.1f} kg ± {found.payload_std_kg:5.1f}   "
        f"front share {found.front_share_pct:5.2f} % ± {found.front_share_std_pct:4.2f}   "
        f"{found.mean_speed_mps * 3.6:5.1f} km/h"
    )
