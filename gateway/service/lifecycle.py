"""Lifecycle of the service: run one gateway with the calibration in use, and restart for another calibration."""

import os
import sys
from typing import Final

from gateway.bus.live.source import OpenReceiver
from gateway.config import Settings
from gateway.service.commissioning import commissioned, with_commissioned
from gateway.service.gateway import Gateway, OnStarted
from gateway.service.reload import LoadSettings

RESTART_CODE: Final = 75  # exit code after which systemd restarts the service (deploy/springscale.service)


def live(
    settings: Settings,
    load: LoadSettings,
    *,
    on_started: OnStarted = lambda gateway: None,
    open_receiver: OpenReceiver | None = None,
) -> bool:
    """Serve until stopped -> whether to restart. Raises as ``setup_of`` and as :meth:`Gateway.run`.

    A calibration made on the vehicle takes effect between two drives, when no window is open: the service ends and
    restarts. ``load`` reads the settings again for a reload; ``open_receiver`` is as of :class:`Gateway`.
    """
    chosen, setup, fault = commissioned(settings)
    gateway = Gateway(
        chosen,
        setup,
        load=lambda: with_commissioned(load()),
        setup_fault=fault,
        on_started=on_started,
        open_receiver=open_receiver,
    )
    gateway.run()
    return gateway.needs_restart


def restart() -> None:
    """Restart the process: under systemd by the exit code, else by executing the same command again."""
    if "NOTIFY_SOCKET" in os.environ:
        sys.exit(RESTART_CODE)
    sys.stdout.flush()
    sys.stderr.flush()
    os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
