"""Reload by SIGHUP: changes the log level and the certificate of the web. All other settings need a restart.

A new calibration or signal map in the middle of a batch would give numbers that no offline run could reproduce. They
take effect at a restart, which takes about two seconds and loses only the open window; a reload checks them and reports
what the restart will find. Access tokens need no reload: the service watches their file.
"""

import logging
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import uvicorn

from gateway.config import Settings
from gateway.errors import SpringscaleError
from gateway.log import Event, log_event, set_log_level
from gateway.service.calibration_in_use import setup_in_use
from gateway.setup import Setup
from gateway.web.access.serving import Tls, renew_certificate

LIVE: Final = frozenset({"log.level", "web.tls_certificate", "web.tls_key"})

LoadSettings = Callable[[], Settings]


class Reloader:
    """Reads the settings again and applies those that can change live; faulty ones change nothing."""

    def __init__(
        self,
        running: Settings,
        load: LoadSettings,
        web: uvicorn.Config,
        setup: Setup | None = None,
        fault: str | None = None,
    ) -> None:
        """``setup`` is the one in use, with which the present files are compared.

        ``fault`` is the fault of the files at the start; each reload updates it, and the status shows it.
        """
        self._running = running
        self._load = load
        self._web = web
        self._setup = setup
        self.fault = fault

    def __call__(self) -> bool:
        """Reload -> whether the present settings and files are good. The log lists what needs a restart."""
        try:
            wanted = self._load()
            tls = tls_of(wanted)
            if tls is not None and self._web.is_ssl:
                renew_certificate(self._web, tls)
        except SpringscaleError as fault:
            log_event(Event.RELOAD_REFUSED, level=logging.ERROR, fault=str(fault))
            return False
        waiting = [key for key in changed_keys(self._running, wanted) if not self._is_live(key, tls)]
        waiting = sorted({*waiting, *self._changed_files(wanted)})
        level = logging.WARNING if waiting else logging.INFO
        log_event(Event.RELOADED, level=level, log_level=wanted.log.level, waits_for_restart=waiting)
        set_log_level(wanted.log.level)  # last, because the level "warning" would hide the line above
        return self.fault is None

    def _changed_files(self, wanted: Settings) -> list[str]:
        """Keys whose files differ from those in use. Invalid files become ``fault``."""
        if self._setup is None:
            return []
        try:
            fresh = setup_in_use(wanted)
        except SpringscaleError as fault:
            self.fault = f"{fault}; the service keeps the earlier files until these are mended and it is restarted"
            log_event(Event.SETUP_REFUSED, level=logging.ERROR, fault=str(fault))
            return []
        self.fault = None
        has_changed = {
            "calibration": self._setup.calibration_id != fresh.calibration_id,
            "signals": self._setup.signal_map != fresh.signal_map,
        }
        return [key for key, it_has in has_changed.items() if it_has]

    def _is_live(self, key: str, tls: Tls | None) -> bool:
        """Whether a key can change without a restart. Turning TLS on or off needs one: it changes the socket."""
        return key in LIVE and (not key.startswith("web.tls") or self._web.is_ssl == (tls is not None))


def tls_of(settings: Settings) -> Tls | None:
    """The certificate files these settings name; None for plain HTTP."""
    web = settings.web
    if web.tls_certificate is None or web.tls_key is None:
        return None
    return Tls(web.tls_certificate, web.tls_key, web.tls_client_ca)


def changed_keys(old: Settings, new: Settings) -> list[str]:
    """Keys such as bus.channel that differ between the two, in alphabetical order."""
    before, after = dict(_leaves(old.model_dump())), dict(_leaves(new.model_dump()))
    return sorted(key for key in before.keys() | after.keys() if before.get(key) != after.get(key))


def _leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, setting in table.items():
        if isinstance(setting, Mapping):
            yield from _leaves(setting, f"{prefix}{key}.")
        else:
            yield prefix + key, setting
