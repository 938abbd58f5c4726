"""springscale run: the service."""

import faulthandler
import gc
import os
from pathlib import Path

import click

from gateway.cli.options import FILE
from gateway.config import load_settings
from gateway.log import set_up_log
from gateway.service.lifecycle import live, restart


@click.command("run")
@click.option("--config", "config_path", type=FILE, required=True, help="springscale.toml")
def run(config_path: Path) -> None:
    """Read the bus, estimate, store and serve until SIGTERM."""
    gc.freeze()  # what is imported by now stays: later searches for garbage pass it over
    settings = load_settings(config_path)
    faulthandler.enable()  # systemd's watchdog ends a hung process with SIGABRT: every stack goes to the journal
    set_up_log(settings.log.level, under_journald="JOURNAL_STREAM" in os.environ)
    if live(settings):
        restart()
