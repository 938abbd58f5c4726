"""Which weighings are of one load: stops at which it can have changed (halts), and neighbours that agree (joined)."""

from gateway.core.loads.halts import SLACK_NS, Halt, LoadLink, clocks_of, follows, halts_of, links_of
from gateway.core.loads.joined import Loads, loads_of
from gateway.core.loads.load import FusedLoad, Weighing, Weighings, weighings_of

__all__ = [
    "SLACK_NS",
    "FusedLoad",
    "Halt",
    "LoadLink",
    "Loads",
    "Weighing",
    "Weighings",
    "clocks_of",
    "follows",
    "halts_of",
    "links_of",
    "loads_of",
    "weighings_of",
]
