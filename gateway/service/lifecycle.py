"""Lifecycle of the service: checks before the start, one gateway with the calibration in use, and the restart."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from gateway.bus.listen import OpenReceiver
from gateway.bus.receiver import what_lacks
from gateway.bus.signals.mapping import SignalMap
from gateway.calibration.file import load_calibration
from gateway.calibration.sister import sister_in
from gateway.config import Settings
from gateway.errors import ConfigurationError
from gateway.records import Signal
from gateway.service.calibration_in_use import learnt
from gateway.service.gateway import Gateway, OnStarted
from gateway.service.parts import tls_of
from gateway.store import why_no_database
from gateway.web.access.serving import refuse_open_address
from gateway.web.access.tokens import TokenFile


def startable_faults(settings: Settings, signal_map: SignalMap) -> Iterator[str]:
    """Faults that would prevent the start or a fresh estimate, each with its remedy."""
    yield from _signals_that_lack(signal_map)
    yield from _store_that_cannot_be_written(settings.store.directory)
    lacking = what_lacks(settings.bus.interface)
    if lacking is not None:
        yield f"[bus] {lacking}"
    try:
        if settings.learning.like is not None:
            sister_in(load_calibration(settings.learning.like))
        has_tls = tls_of(settings) is not None
        refuse_open_address(settings.web.host, has_tokens=_has_tokens(settings), has_tls=has_tls)
    except ConfigurationError as fault:
        yield str(fault)
    if settings.web.stale_after_s < settings.batch.window_s:
        yield (
            f"[web] stale_after_s = {settings.web.stale_after_s:g} is below [batch] window_s = "
            f"{settings.batch.window_s:g}: every estimate would be stale before the next; set it to three windows"
        )


def _signals_that_lack(signal_map: SignalMap) -> Iterator[str]:
    """Missing signals: weighing needs two inertial signals and a speed."""
    mapped = set(signal_map.signals)
    for signal in (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE):
        if signal not in mapped:
            yield f"{signal_map.name} maps no {signal}, which every estimate needs: add [signals.{signal}]"
    if not mapped & {Signal.SPEED, Signal.WHEEL_SPEED}:
        yield f"{signal_map.name} maps no speed, which every estimate needs: add [signals.speed]"


def _store_that_cannot_be_written(directory: Path) -> Iterator[str]:
    """Faults of the store's directory, found by making a database in it, or in the folder that it would be made in.

    A directory of another user, to which this one may not write, is not checked.
    """
    there = next(path for path in (directory, *directory.absolute().parents) if path.exists())
    if not there.is_dir():
        yield f"[store] directory = {directory}: {there} is a file; name a folder"
    elif os.statvfs(there).f_flag & os.ST_RDONLY:
        yield f"[store] directory = {directory}: is on a read-only file system; name a folder elsewhere"
    elif not os.access(there, os.W_OK | os.X_OK) and (there != directory or there.stat().st_uid == os.geteuid()):
        yield f"[store] directory = {directory}: {there} cannot be written; chmod u+w it, or name another folder"
    elif os.access(there, os.W_OK | os.X_OK) and (why := why_no_database(there)) is not None:
        yield f"[store] directory = {directory}: {there} cannot hold a database ({why}); name a folder on a disk"


def _has_tokens(settings: Settings) -> bool:
    """Whether the service has tokens; also true if this user may not read the file."""
    try:
        return bool(TokenFile(settings.store.directory / "tokens.json").tokens())
    except ConfigurationError:
        return True


RESTART_CODE: Final = 75  # exit code after which systemd restarts the service (deploy/springscale.service)


def live(
    settings: Settings,
    *,
    on_started: OnStarted = lambda gateway: None,
    open_receiver: OpenReceiver | None = None,
) -> bool:
    """Serve until stopped -> whether to restart. Raises as ``setup_of`` and as :meth:`Gateway.run`.

    A calibration that was learnt takes effect between two drives, when no window is open: the service ends and
    restarts. ``open_receiver`` is as of :class:`Gateway`.
    """
    chosen, setup, fault = learnt(settings)
    gateway = Gateway(
        chosen,
        setup,
        setup_fault=fault,
        on_started=on_started,
        open_receiver=open_receiver,
        by_file=settings.calibration,
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
