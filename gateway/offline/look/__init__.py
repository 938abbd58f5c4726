"""Inspects an unknown log: its content, and whether it suffices to weigh a vehicle.

A log and databases go in; identifiers with their rates, the matching shipped signal maps, the axis with gravity and a
draft of a signal map come out. Only the databases are trusted.
"""

from gateway.bus.heard import Heard
from gateway.offline.look.draft import write_draft
from gateway.offline.look.look import Look, MapFit, look, why_silent
from gateway.offline.look.readings import Described
from gateway.offline.look.roles import FoundRole
from gateway.offline.look.unmapped import unmapped_roll_rate

__all__ = [
    "Described",
    "FoundRole",
    "Heard",
    "Look",
    "MapFit",
    "look",
    "unmapped_roll_rate",
    "why_silent",
    "write_draft",
]
