"""springscale run: the service."""

import faulthandler
import gc
import os
from functools import partial
from pathlib import Path

import click

from gateway.cli.options import FILE, trusted_keys
from gateway.config import load_settings
from gateway.log import set_up_log
from gateway.service.lifecycle import live, restart


@click.command("run")
@click.option("--config", "config_path", type=FILE, required=True, help="springscale.toml")
@trusted_keys
def run(config_path: Path, trusted_keys: Path | None) -> None:
    """Read the bus, estimate, store and serve until SIGTERM."""
    gc.freeze()  # what is imported by now stays: later searches for garbage pass it over
    load = partial(load_settings, config_path, trusted_keys)
    settings = load()
    faulthandler.enable()  # systemd's watchdog ends a hung process with SIGABRT: every stack goes to the journal
    set_up_log(settings.log.level, under_journald="JOURNAL_STREAM" in os.environ)
    if live(settings, load):
        restart()
