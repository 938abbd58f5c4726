"""Logs in, estimates out: what `springscale estimate` prints."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from gateway.bus.logs.open import motion_of_log
from gateway.core.settings import BatchSettings
from gateway.estimate import Estimate
from gateway.setup import Setup


def estimates_of_logs(logs: Sequence[Path], setup: Setup, settings: BatchSettings) -> Iterator[Estimate]:
    """Every batch of every log in turn; each log is a drive of its own. Raises LogUnreadableError."""
    for log in logs:
        flow = setup.flow(settings)
        motions, report, _ = motion_of_log(log, setup.signal_map)
        for motion in motions:
            yield from flow.feed(motion)
        report.require_frames()
        yield from flow.flush()
