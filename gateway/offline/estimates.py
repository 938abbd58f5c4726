"""Estimates of logs, as `springscale estimate` prints them."""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final

from gateway.bus.logs import LogReport, motion_of_log
from gateway.bus.logs.open import open_log
from gateway.bus.signals import SignalMap
from gateway.core.events import Entry, Ledger, Rules
from gateway.core.settings import BatchSettings
from gateway.errors import LogUnreadableError
from gateway.estimate import Estimate
from gateway.setup import Setup

AS_THE_SERVICE: Final = BatchSettings()


def estimates_of_logs(
    logs: Sequence[Path | str],
    setup: Setup,
    settings: BatchSettings = AS_THE_SERVICE,
    *,
    on_read: Callable[[LogReport], None] = lambda report: None,
) -> Iterator[Estimate]:
    """Every batch of every log in turn; each log is a drive. Raises LogUnreadableError.

    ``on_read`` gets the reader's report of each log. Stretches too short for a batch are left out.
    """
    return (one for one in with_remainders(logs, setup, settings, on_read=on_read) if not one.is_remainder)


def with_remainders(
    logs: Sequence[Path | str],
    setup: Setup,
    settings: BatchSettings = AS_THE_SERVICE,
    *,
    on_read: Callable[[LogReport], None] = lambda report: None,
) -> Iterator[Estimate]:
    """The same with the stretches too short for a batch (``is_remainder``), which have a way."""
    for log in logs:
        flow = setup.flow(settings)
        motions, report, _ = motion_of_log(log, setup.signal_map)
        for motion in motions:
            yield from flow.feed(motion)
        report.require_frames()
        on_read(report)
        yield from flow.flush()


def require_order(logs: Sequence[Path], signal_map: SignalMap) -> None:
    """Raises LogUnreadableError if a log begins before the preceding one.

    Loads and trips depend on the order of drives; logs out of order would give false changes of load.
    """
    begun = [(log, start_ns) for log in logs if (start_ns := _start_ns(log, signal_map)) is not None]
    for (before, before_ns), (log, start_ns) in pairwise(begun):
        if start_ns < before_ns:
            raise LogUnreadableError(f"{log}: begins before {before}: name the logs in order of time")


def _start_ns(log: Path, signal_map: SignalMap) -> int | None:
    """The time of the first mapped frame; None without one, which the reader reports."""
    try:
        chunks, _ = open_log(log, signal_map)
        return next((int(chunk.t_ns[0]) for chunk in chunks if len(chunk)), None)
    except LogUnreadableError:
        return None


def entries_of_logs(
    logs: Sequence[Path | str], setup: Setup, settings: BatchSettings = AS_THE_SERVICE
) -> Iterator[Entry]:
    """Every event and trip of the logs, in its last revision.

    Raises LogUnreadableError at the first unreadable log, after yielding those of the logs before.
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
