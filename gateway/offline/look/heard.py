"""Who speaks in a log: every identifier of every channel."""

from pathlib import Path
from typing import Final

from gateway.bus.heard import Heard, counted, heard_on
from gateway.bus.logs import LogReport, open_whole_log

NO_CHANNEL: Final = "None"  # how python-can's readers name the channel of a log that keeps none


def heard_in(log: Path) -> tuple[tuple[Heard, ...], LogReport]:
    """Every identifier in order of channel and number. Raises LogUnreadableError where nothing can be read."""
    chunks, report = open_whole_log(log)
    of_all = counted(chunks)
    report.require_frames()
    channels = sorted(report.channels - {NO_CHANNEL})
    if len(channels) < 2:
        return heard_on(channels[0] if channels else None, of_all), report
    by_channel = [heard_on(channel, counted(open_whole_log(log, channel)[0])) for channel in channels]
    return tuple(one for heard in by_channel for one in heard), report
