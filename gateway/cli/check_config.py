"""springscale check-config: everything that can be checked without the bus."""

import os
from pathlib import Path

import click

from gateway.calibration.tare_file import FILE_NAME
from gateway.cli.options import FILE, as_json
from gateway.config import load_settings
from gateway.errors import ConfigurationError
from gateway.records import json_line
from gateway.service.startable import startable_faults
from gateway.setup import setup_of
from gateway.uplink import uplink_settings


@click.command("check-config")
@click.argument("config", type=FILE)
@as_json
def check_config(config: Path, as_json: bool) -> None:
    """Check CONFIG, its signal map, its DBC files, its calibration and its tare; name every fault."""
    settings = load_settings(config)
    setup = setup_of(settings)
    tares = settings.store.directory / FILE_NAME
    if os.access(tares, os.R_OK):  # the service's own; others may not be allowed to see it
        setup = setup.with_tare_of(tares)
    faults = tuple(startable_faults(settings))
    if faults:
        raise ConfigurationError("\n".join(f"{config}: {fault}" for fault in faults))
    forwarding = uplink_settings(settings.uplink, settings.vehicle)
    summary = {
        "config": str(config),
        "signals": [str(signal) for signal in setup.signal_map.signals],
        "calibration_id": setup.calibration.id if setup.calibration else None,
        "tare_id": setup.tare.id if setup.tare else None,
        "estimator": setup.estimator,
        "interface": settings.bus.interface,
        "channel": settings.bus.channel,
        "uplink": forwarding.broker if forwarding else None,
    }
    if as_json:
        click.echo(json_line(summary))
        return
    click.echo(f"{config}: good. Reads {', '.join(setup.signal_map.signals)} from {settings.bus.channel}.")
    if setup.calibration is None:
        click.echo("No calibration is configured: batches will carry spectra and rejected = no_calibration.")
