"""Logs in, estimates out: what `springscale estimate` prints."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from gateway.bus.logs import motion_of_log
from gateway.core.settings import BatchSettings
from gateway.estimate import Estimate
from gateway.setup import Setup

AS_THE_SERVICE: Final = BatchSettings()


def estimates_of_logs(
    logs: Sequence[Path | str], setup: Setup, settings: BatchSettings = AS_THE_SERVICE
) -> Iterator[Estimate]:
    """Every batch of every log in turn; each log is a drive of its own. Raises LogUnreadableError."""
    for log in logs:
        flow = setup.flow(settings)
        motions, report, _ = motion_of_log(log, setup.signal_map)
        for motion in motions:
            yield from flow.feed(motion)
        report.require_frames()
        yield from flow.flush()
