"""Recorded frames: candump logs by a fast reader of our own, other formats through python-can.

A path comes in, plain or compressed; frames, or motion by a signal map, go out (``motion_of_log``) with a report of
what could not be read and where. Damaged lines are counted and left out, they never end the reading.
"""

from gateway.bus.logs.candump_write import write_candump
from gateway.bus.logs.log_report import LogReport
from gateway.bus.logs.open import is_named_as_log, motion_of_log, open_whole_log

__all__ = ["LogReport", "is_named_as_log", "motion_of_log", "open_whole_log", "write_candump"]
