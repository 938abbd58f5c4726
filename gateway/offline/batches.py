"""Logs in, batches out: the same decoder and scheduler as the live service, without its clock and threads."""

from dataclasses import dataclass
from pathlib import Path

from gateway.bus.logs import LogReport, motion_of_log
from gateway.bus.signals import SignalMap
from gateway.core.scheduler import Scheduler
from gateway.core.settings import BatchSettings
from gateway.records import Batch, Motion, joined
from gateway.units import NS_PER_S


def read_whole_log(log: Path, signal_map: SignalMap) -> tuple[Motion, LogReport]:
    """All rows of one log that weigh, at once, and what the reader met.

    Raises LogUnreadableError where nothing can be read.
    """
    motions, report, _ = motion_of_log(log, signal_map)
    parts = list(motions)
    report.require_frames()
    return joined(parts).weighing, report


@dataclass(frozen=True, slots=True)
class Stretch:
    """Part of a log, in seconds from the first frame that tells motion; an open end is None."""

    start_s: float = 0.0
    end_s: float | None = None


def rows_within(motion: Motion, stretch: Stretch) -> Motion:
    """Rows whose stamps lie in [start, end) of the stretch."""
    since_ns = motion.t_ns - motion.t_ns[0]
    inside = since_ns >= round(stretch.start_s * NS_PER_S)
    if stretch.end_s is not None:
        inside &= since_ns < round(stretch.end_s * NS_PER_S)
    return motion.rows(inside)


def batches_of_motion(motion: Motion, signal_map: SignalMap, settings: BatchSettings) -> tuple[Batch, ...]:
    """Every batch of rows that are already there."""
    scheduler = Scheduler(settings, signal_map.traits)
    return (*scheduler.feed(motion), *scheduler.flush())
