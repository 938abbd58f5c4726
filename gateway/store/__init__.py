"""Estimates, events and calibrations in SQLite: one writer, read-only readers, bounded in age and size."""

from gateway.store.database import Retention
from gateway.store.reader import Event, Latest, Page, StoreReader
from gateway.store.writer import Store, StoreHealth, StoreState

__all__ = ["Event", "Latest", "Page", "Retention", "Store", "StoreHealth", "StoreReader", "StoreState"]
