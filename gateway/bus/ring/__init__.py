"""The ring log: the mapped frames, recorded on disk as long as there is room.

The pipeline hands frames over without waiting. They are written as gzip-compressed candump segments into one directory,
limited in size and in bytes written per day, and can be fetched by name. A disk fault loses frames, which are counted.
"""

from gateway.bus.ring.folder import RingLimits
from gateway.bus.ring.ring_log import RingLog

__all__ = ["RingLimits", "RingLog"]
