"""A live CAN interface: the thread that receives, the bounded inbox behind it, and what state the bus is in.

An interface's name and the identifiers wanted come in; frames go out in order of arrival (``LiveSource``), with
every loss counted. Errors of a bus end in waiting and opening it anew, never in a dead thread.
"""

from gateway.bus.live.around import Around, around_of
from gateway.bus.live.inbox import Inbox
from gateway.bus.live.python_can import require_known_interface, usable_interfaces, what_lacks
from gateway.bus.live.source import LiveSource, OpenReceiver, SourceState

__all__ = [
    "Around",
    "Inbox",
    "LiveSource",
    "OpenReceiver",
    "SourceState",
    "around_of",
    "require_known_interface",
    "usable_interfaces",
    "what_lacks",
]
