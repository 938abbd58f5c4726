"""Load events (what was loaded or unloaded, where and when) and trips (what was carried how far).

They are a pure function of the estimates (numbers, times, ways), so that the live service, a log and a restarted
service give the same events.
"""

from gateway.core.change import Rules
from gateway.core.events.entry import Entry, EntryKind
from gateway.core.events.ledger import HORIZON, Ledger

__all__ = ["HORIZON", "Entry", "EntryKind", "Ledger", "Rules"]
