"""A live CAN interface: the receiving thread, its bounded inbox, and the state of the bus.

An interface's name and the wanted identifiers come in; frames go out in order of arrival (``LiveSource``), with every
loss counted. After a bus error the thread waits and opens the bus again; it never dies.
"""

from gateway.bus.live.bus_survey import BusSurvey, bus_survey_of
from gateway.bus.live.python_can import require_usable_interface, usable_interfaces, what_lacks
from gateway.bus.live.receiver import Inbox
from gateway.bus.live.source import LiveSource, OpenReceiver, SourceState

__all__ = [
    "BusSurvey",
    "Inbox",
    "LiveSource",
    "OpenReceiver",
    "SourceState",
    "bus_survey_of",
    "require_usable_interface",
    "usable_interfaces",
    "what_lacks",
]
