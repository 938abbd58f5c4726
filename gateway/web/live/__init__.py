"""The current state: the board that shows the latest estimate, and the streams that send each new one.

Estimates come from the pipeline's thread; the latest with its age goes out, thousands of times a second if need be, and
each new one as an event to every stream, after the events that a client missed.
"""

from gateway.web.live.board import Board, Shown, boot_clock_s
from gateway.web.live.latest import LatestResponse, LatestShortcut
from gateway.web.live.stream import EVENT_SCHEMA, EventStream

__all__ = ["EVENT_SCHEMA", "Board", "EventStream", "LatestResponse", "LatestShortcut", "Shown", "boot_clock_s"]
