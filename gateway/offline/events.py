"""Logs in, load events and trips out: what `springscale events` prints, and the service tells of the same frames."""

from collections.abc import Sequence
from pathlib import Path

from gateway.core.events import Entry, Ledger, Rules
from gateway.core.settings import BatchSettings
from gateway.offline.estimates import AS_THE_SERVICE, estimates_of_logs
from gateway.setup import Setup


def entries_of_logs(
    logs: Sequence[Path | str], setup: Setup, settings: BatchSettings = AS_THE_SERVICE
) -> tuple[Entry, ...]:
    """Every event and trip of the logs in turn, as their last batch left them. Raises LogUnreadableError."""
    ledger = Ledger(Rules.of(setup.calibrated.vehicle) if setup.calibrated else Rules())
    told: dict[str, Entry] = {}
    for estimate in estimates_of_logs(logs, setup, settings):
        told |= {entry.id: entry for entry in ledger.add(estimate)}
    return tuple(sorted(told.values(), key=lambda entry: (entry.t_end_ns, entry.kind, entry.id)))
