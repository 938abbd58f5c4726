"""The ring log: the weighed frames, kept on disk as long as there is room.

Frames come in from the pipeline and never wait; gzip-compressed candump segments lie in one directory, bounded in size
and in bytes written a day, and go out by name. A disk fault loses frames, which are counted, and nothing else.
"""

from gateway.bus.ring.folder import RingLimits
from gateway.bus.ring.ring_log import RingLog
from gateway.bus.ring.segment import Segment

__all__ = ["RingLimits", "RingLog", "Segment"]
