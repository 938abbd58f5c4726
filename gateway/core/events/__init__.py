"""Load events and trips: what was loaded or unloaded where and when, and what was carried how far.

Made of estimates alone (their numbers, their times, the way they went), purely: the service, a log and a restart give
the same.
"""

from gateway.core.change import Rules
from gateway.core.events.entry import Entry, EntryKind
from gateway.core.events.ledger import HORIZON, Ledger

__all__ = ["HORIZON", "Entry", "EntryKind", "Ledger", "Rules"]
