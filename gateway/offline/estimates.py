"""Logs in, estimates out: what `springscale estimate` prints."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

from gateway.bus.logs import LogReport, motion_of_log
from gateway.core.settings import BatchSettings
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
    """Every batch of every log in turn; each log is a drive of its own. Raises LogUnreadableError.

    ``on_read`` hears of each log, once it is read, what its reader met. What is too short to be a batch is left out.
    """
    return (one for one in with_remainders(logs, setup, settings, on_read=on_read) if not one.is_remainder)


def with_remainders(
    logs: Sequence[Path | str],
    setup: Setup,
    settings: BatchSettings = AS_THE_SERVICE,
    *,
    on_read: Callable[[LogReport], None] = lambda report: None,
) -> Iterator[Estimate]:
    """Likewise, and between the batches what is too short to be one (``is_remainder``): it has a way."""
    for log in logs:
        flow = setup.flow(settings)
        motions, report, _ = motion_of_log(log, setup.signal_map)
        for motion in motions:
            yield from flow.feed(motion)
        report.require_frames()
        on_read(report)
        yield from flow.flush()
