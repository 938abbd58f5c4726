"""A service's life: one gateway, with the calibration that is in use when it begins."""

import os
import sys
from typing import Final

from gateway.bus.live import OpenReceiver
from gateway.config import Settings
from gateway.service.commissioning import commissioned, with_commissioned
from gateway.service.gateway import Gateway, OnStarted
from gateway.service.reload import LoadSettings

START_ANEW: Final = 75  # exit code by which systemd starts the service anew (deploy/springscale.service)


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
    return gateway.is_to_start_anew


def start_anew() -> None:
    """End this process so that another replaces it: systemd's by the exit code, else the same command once more."""
    if "NOTIFY_SOCKET" in os.environ:
        sys.exit(START_ANEW)
    sys.stdout.flush()
    sys.stderr.flush()
    os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
