"""One journal of all records on disk, in SQLite: one writer, bounded in age and size.

Any thread may write a record, and none waits for the disk. Read-only readers return the history in order of arrival,
including the records that are not yet on disk. If the disk fails, the store reports it and keeps records in memory.
"""

from gateway.store.reader import Follower, Latest, StoreReader, restored
from gateway.store.retention import Retention
from gateway.store.schema import why_no_database
from gateway.store.writer import Store

__all__ = ["Follower", "Latest", "Retention", "Store", "StoreReader", "restored", "why_no_database"]
