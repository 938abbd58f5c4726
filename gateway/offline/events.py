"""Logs in, load events and trips out: what `springscale events` prints, and the service tells of the same frames."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from gateway.core.events import Entry, Ledger, Rules
from gateway.core.settings import BatchSettings
from gateway.errors import LogUnreadableError
from gateway.offline.estimates import AS_THE_SERVICE, with_remainders
from gateway.setup import Setup


def entries_of_logs(
    logs: Sequence[Path | str], setup: Setup, settings: BatchSettings = AS_THE_SERVICE
) -> Iterator[Entry]:
    """Every event and trip of the logs in turn, as their last batch left them.

    Raises LogUnreadableError at the first log of which nothing can be read, once those of the logs before are told.
    """
    ledger = Ledger(Rules.of(setup.calibrated.vehicle) if setup.calibrated else Rules())
    told: dict[str, Entry] = {}
    unreadable: LogUnreadableError | None = None
    try:
        for estimate in with_remainders(logs, setup, settings):
            told |= {entry.id: entry for entry in ledger.add(estimate)}
    except LogUnreadableError as fault:
        unreadable = fault
    yield from sorted(told.values(), key=lambda entry: (entry.t_end_ns, entry.kind, entry.id))
    if unreadable is not None:
        raise unreadable
