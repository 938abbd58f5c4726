"""One journal of all records on disk, in SQLite: one writer, bounded in age and size.

Records come in from any thread and never wait for the disk; pages of the history in order of arrival go out through
read-only readers, what is not yet on disk among them. A disk that refuses is told of, and waited for in memory.
"""

from gateway.store.follower import Follower
from gateway.store.reader import Event, Latest, StoreReader
from gateway.store.retention import Retention
from gateway.store.writer import Store

__all__ = ["Event", "Follower", "Latest", "Retention", "Store", "StoreReader"]
