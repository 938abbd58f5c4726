"""springscale events: logs to load events and trips, as the service reports them."""

from pathlib import Path

import click

from gateway.cli.estimate import prepared, with_known_weights
from gateway.cli.options import FILE, as_json, one_estimator, window
from gateway.cli.text.events import entry_sentence
from gateway.offline.estimates import entries_of_logs, require_order
from gateway.records import json_line


@click.command("events")
@click.argument("logs", nargs=-1, required=True, type=FILE)
@click.option("--config", "config_path", type=FILE, default=None, help="springscale.toml of the service")
@click.option("--signals", default=None, help="signal map: a TOML file, or springscale:NAME")
@click.option("--calibration", type=FILE, default=None, help="calibration file")
@one_estimator
@window
@as_json
def events(
    logs: tuple[Path, ...],
    config_path: Path | None,
    signals: str | None,
    calibration: Path | None,
    estimator: str | None,
    window_s: float | None,
    as_json: bool,
) -> None:
    """What was loaded and unloaded, and every trip, from the LOGs of one vehicle in order of time.

    One line each; with --json the objects that the service stores, in their last revision. Loads take the known
    weights of the service of --config into account.
    """
    setup, settings, state = prepared(config_path, signals, calibration, estimator, window_s)
    require_order(logs, setup.signal_map)
    for entry in entries_of_logs(logs, with_known_weights(setup, None, state), settings):
        click.echo(json_line(entry.record) if as_json else entry_sentence(entry))
