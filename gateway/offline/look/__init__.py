"""What an unknown log holds, and whether a vehicle can be weighed from it.

A log and databases come in; identifiers with their rates, the shipped signal maps that fit, the axis that carries
gravity and a first signal map of one's own go out. Nothing is taken for granted but what the databases say.
"""

from gateway.bus.heard import Heard
from gateway.offline.look.draft import write_draft
from gateway.offline.look.look import Fit, Look, look, why_silent
from gateway.offline.look.readings import Described
from gateway.offline.look.roles import Found
from gateway.offline.look.unmapped import unmapped_roll_rate

__all__ = [
    "Described",
    "Fit",
    "Found",
    "Heard",
    "Look",
    "look",
    "unmapped_roll_rate",
    "why_silent",
    "write_draft",
]
